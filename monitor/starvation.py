"""Samples arrive and yet no window becomes complete: says so, with the likely reason. Pure."""

from __future__ import annotations

import collections
from dataclasses import dataclass, field

from monitor.samples import GapKind, Outcome
from monitor.stream_clock import StreamClock

PATIENCE = 4  # windows' worth of samples without one complete window
APART = 1.5  # ratio of the sample times within blocks and between them: where a segment ends

WORDS = {
    GapKind.PAUSE: "jumps of the stamps",
    GapKind.MISSING: "gaps",
    GapKind.EPOCH: "new epochs",
    GapKind.JOINED_LATE: "joined late",
}


@dataclass(slots=True)
class Starvation:
    """What came of one axis since its last complete window.

    Attributes:
        taken: samples accepted.
        breaks: ends of segments, by kind.
        outdated: samples refused because their epoch is older than one seen before, since the last accepted one.
    """

    taken: int = 0
    breaks: collections.Counter[GapKind] = field(default_factory=collections.Counter)
    outdated: int = 0

    def note(self, out: Outcome) -> None:
        """Take what the assembler settled."""
        self.taken += sum(len(part) for part in out.accepted)
        self.breaks.update(gap.kind for gap in out.gaps)
        if out.splinters:
            self.breaks[GapKind.PAUSE] += out.splinters
        self.outdated = 0 if out.accepted else self.outdated + out.old_epoch
        if out.windows:
            self.taken = 0
            self.breaks.clear()

    def complaint(self, window: int, clock: StreamClock, hop: int = 0) -> str | None:
        """Why the axis is not watched though it sends; None where nothing is wrong.

        Args:
            window: samples of one window.
            clock: of the axis.
            hop: samples from one window to the next, as stretched as it is now: so many come without one anyway.
        """
        if self.outdated >= window:
            return (
                f"{self.outdated} samples were refused: their epoch is older than one seen before; "
                "restart the publisher with a larger epoch, and check whether its clock was set back"
            )
        if self.taken < max(PATIENCE * window, window + hop) or not self.breaks:
            return None
        broken = ", ".join(f"{count} {WORDS[kind]}" for kind, count in self.breaks.most_common())
        text = f"{self.taken} samples came without {window} in an unbroken row: {broken}"
        steps = clock.steps
        if steps is not None and (steps[1] > APART * steps[0] or steps[0] > APART * steps[1]):
            text += (
                f"; samples are {steps[0]:.3g} s apart in a block, {steps[1]:.3g} s from block to block: check dt_ns"
            )
        return text
