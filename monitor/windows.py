"""From blocks to windows: which samples were received, which are missing, and which make a window. Pure.

A *segment* is a contiguous run of samples: one epoch, no sample missing, no jump of the stamps. Windows of a segment
start at its first sample + k * hop; so what the windows are depends on the samples alone, not on how they were cut into
blocks, repeated or reordered.
Every sample number of an epoch below `next_seq` was either received once or lies in exactly one reported gap.
"""

from __future__ import annotations

import collections
import dataclasses
import enum
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from plant.recording import Floats

Stamps = NDArray[np.int64]
JUMP = 1.5  # sample times between two stamps that end a segment
SPLINTER = 4  # samples: pauses after fewer are only counted, else a wrong dt_ns would fill the history
KEPT_GAPS = 256  # latest gaps of an epoch, to tell what comes late from what comes twice


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """Consecutive samples as the machine sent them; a slice of a block.

    Attributes:
        epoch: grows when the publisher starts anew.
        seq: number of the first sample in its epoch.
        t_ns: Unix time, UTC. [ns] (n,)
        drive: torque [N·m], or force [N] where `is_force`. (n,)
        position: [m or rad] (n,)
        velocity: [m/s or rad/s] (n,) or None
        temperature: [degC] (n,) or None
        load: [kg or 1] (n,) or None
    """

    epoch: int
    seq: int
    t_ns: Stamps
    drive: Floats
    position: Floats
    is_force: bool = False
    velocity: Floats | None = None
    temperature: Floats | None = None
    load: Floats | None = None

    def __len__(self) -> int:
        """Count the samples."""
        return len(self.t_ns)

    @property
    def end(self) -> int:
        """Number of the sample after the last."""
        return self.seq + len(self)

    def cut(self, first: int, end: int) -> Samples:
        """Samples numbered `first` to `end` (exclusive)."""
        part = slice(first - self.seq, end - self.seq)
        names = ("t_ns", "drive", "position", "velocity", "temperature", "load")
        cuts = {name: values[part] for name in names if (values := getattr(self, name)) is not None}
        return dataclasses.replace(self, seq=first, **cuts)


class GapKind(enum.StrEnum):
    """Why a segment ended before its successor began."""

    MISSING = "missing"  # sent, never received
    JOINED_LATE = "joined_late"  # sent in this epoch before anything was received
    PAUSE = "pause"  # nothing missing by number, but the stamps jump: the machine sends in bursts
    EPOCH = "epoch"  # the publisher started anew; what it did in between is unknown


@dataclass(frozen=True, slots=True)
class Gap:
    """A break in the stream: samples `from_seq` to `to_seq` (exclusive) were not received.

    `from_ns` is the last stamp before the break (None if there was none), `to_ns` the first after it. [ns]
    For `EPOCH`, `epoch` and `from_seq` tell where the old epoch ended; how many were lost is unknown.
    """

    kind: GapKind
    epoch: int
    from_seq: int
    to_seq: int
    from_ns: int | None
    to_ns: int

    @property
    def missing(self) -> int:
        """Samples known to be missing."""
        return self.to_seq - self.from_seq


@dataclass(frozen=True, slots=True, order=True)
class WindowId:
    """Which samples of an axis make a window: `samples` raw samples of `epoch` from number `first_seq` on."""

    epoch: int
    first_seq: int
    samples: int


@dataclass(frozen=True, slots=True)
class Window:
    """A complete window: its identity and the stamps of its first and last sample. [ns]"""

    id: WindowId
    start_ns: int
    end_ns: int


@dataclass(frozen=True, slots=True)
class WindowRule:
    """How one axis is cut.

    Attributes:
        samples: raw samples of a window.
        hop: raw samples from one window's start to the next.
        sample_time_ns: nominal; 0 = take each block's own median step. [ns]
        patience: how long a block waits for missing ones before it. [s, on the caller's clock]
        held_blocks, held_samples: what may wait at once; more, and the gap is declared.
    """

    samples: int
    hop: int
    sample_time_ns: int = 0
    patience: float = 2.0
    held_blocks: int = 256
    held_samples: int = 200_000


@dataclass(frozen=True, slots=True)
class StreamState:
    """What must survive a restart for the windows to come out the same.

    Attributes:
        epoch: current epoch; -1 before the first block.
        next_seq: number of the first sample not yet settled; -1 while the epoch's start is still open.
        last_ns: stamp of the last received sample, None before the first. [ns]
        segment_seq: first sample of the current segment.
        starts: (number, stamp [ns]) of the windows begun in this segment and not complete.
    """

    epoch: int = -1
    next_seq: int = -1
    last_ns: int | None = None
    segment_seq: int = 0
    starts: tuple[tuple[int, int], ...] = ()

    def needed_from(self) -> tuple[int, int]:
        """(epoch, number) of the oldest received sample that a future window may need."""
        return self.epoch, self.starts[0][0] if self.starts else self.next_seq


@dataclass(slots=True)
class Outcome:
    """What one call decided; the caller stores and counts it.

    `duplicates`, `late` (of a gap already declared) and `old_epoch` count samples that were not taken; `splinters` are
    pauses after fewer than `SPLINTER` samples.
    """

    accepted: list[Samples] = field(default_factory=list)
    windows: list[Window] = field(default_factory=list)
    gaps: list[Gap] = field(default_factory=list)
    duplicates: int = 0
    late: int = 0
    old_epoch: int = 0
    splinters: int = 0


class Assembler:
    """Settles the samples of one axis, in order. No clock, no I/O; `now` [s] is any clock that only grows."""

    def __init__(
        self, rule: WindowRule, state: StreamState | None = None, gaps: list[tuple[int, int]] | None = None
    ) -> None:
        """Start from `state` as stored; `gaps` are the (from, to) gaps of its epoch, to tell late from duplicate."""
        self.rule = rule
        self.stretch = 1  # windows of the rule per window that is begun
        self.state = state or StreamState()
        self._held: dict[int, tuple[Samples, float]] = {}
        self._gaps = collections.deque(gaps or [], maxlen=KEPT_GAPS)

    @property
    def held(self) -> int:
        """Blocks that wait for missing ones before them."""
        return len(self._held)

    def offer(self, block: Samples, now: float) -> Outcome:
        """Take a block as it arrived; order, repetition and overlap do not matter."""
        out = Outcome()
        if block.epoch < self.state.epoch:
            out.old_epoch += len(block)
            return out
        if block.epoch > self.state.epoch:
            self._begin_epoch(block, out)
        if self.state.next_seq < 0 and block.seq == 0:
            self._move(next_seq=0)
        block = self._hold_back(block, out)
        if len(block):
            known = self._held.get(block.seq)
            if known is None or len(known[0]) < len(block):
                self._held[block.seq] = (block, known[1] if known else now)
                out.duplicates += len(known[0]) if known else 0
            else:
                out.duplicates += len(block)
        self._take_ready(out)
        most = self.rule
        while len(self._held) > most.held_blocks or sum(len(one) for one, _ in self._held.values()) > most.held_samples:
            self._give_up_waiting(out)
        return out

    def settle(self, now: float) -> Outcome:
        """Declare the gaps that were waited for long enough."""
        out = Outcome()
        while self._held and now - min(arrived for _, arrived in self._held.values()) >= self.rule.patience:
            self._give_up_waiting(out)
        return out

    def _hold_back(self, block: Samples, out: Outcome) -> Samples:
        """Drop the part of `block` that is already settled."""
        settled = min(max(self.state.next_seq - block.seq, 0), len(block))
        if settled:
            end = block.seq + settled
            late = sum(max(0, min(end, to) - max(block.seq, start)) for start, to in self._gaps)
            out.late += late
            out.duplicates += settled - late
        return block.cut(block.seq + settled, block.end) if settled else block

    def _begin_epoch(self, block: Samples, out: Outcome) -> None:
        while self._held:
            self._give_up_waiting(out)
        old = self.state
        if old.epoch >= 0 and old.next_seq >= 0:
            first = int(block.t_ns[0])
            out.gaps.append(Gap(GapKind.EPOCH, old.epoch, old.next_seq, old.next_seq, old.last_ns, first))
        self._gaps.clear()
        self.state = StreamState(epoch=block.epoch, last_ns=old.last_ns)

    def _give_up_waiting(self, out: Outcome) -> None:
        """Declare what is missing before the first held block as a gap, and go on behind it."""
        first = min(self._held)
        start = max(self.state.next_seq, 0)
        if first > start:
            kind = GapKind.JOINED_LATE if self.state.next_seq < 0 else GapKind.MISSING
            to_ns = int(self._held[first][0].t_ns[0])
            out.gaps.append(Gap(kind, self.state.epoch, start, first, self.state.last_ns, to_ns))
            self._gaps.append((start, first))
        self._move(next_seq=first, segment_seq=first, starts=())
        self._take_ready(out)

    def _take_ready(self, out: Outcome) -> None:
        """Accept held blocks as long as they continue what is settled."""
        while self._held and self.state.next_seq >= 0 and (first := min(self._held)) <= self.state.next_seq:
            block = self._hold_back(self._held.pop(first)[0], out)
            if len(block):
                self._accept(block, out)

    def _accept(self, block: Samples, out: Outcome) -> None:
        """Append `block` to the segment, cutting it where the stamps jump."""
        stamps = block.t_ns if self.state.last_ns is None else np.concatenate(([self.state.last_ns], block.t_ns))
        steps = np.diff(stamps)
        nominal = self.rule.sample_time_ns or (int(np.median(np.diff(block.t_ns))) if len(block) > 1 else 0)
        broken = (steps <= 0) | (steps > JUMP * nominal) if nominal > 0 else steps <= 0
        offset, first = len(block) - len(steps), block.seq
        out.accepted.append(block)
        for cut in (np.flatnonzero(broken) + offset + block.seq).tolist():
            if cut > first:
                self._extend(block.cut(first, cut), out)
            if (length := cut - self.state.segment_seq) >= SPLINTER:
                before, after = int(stamps[cut - block.seq - offset]), int(block.t_ns[cut - block.seq])
                out.gaps.append(Gap(GapKind.PAUSE, block.epoch, cut, cut, before, after))
            elif length:  # else a segment begins here anyway, with its gap already told
                out.splinters += 1
            self._move(segment_seq=cut, starts=())
            first = cut
        self._extend(block.cut(first, block.end), out)

    def _extend(self, run: Samples, out: Outcome) -> None:
        """Append an unbroken run to the segment; note the windows it begins and completes."""
        rule, segment = self.rule, self.state.segment_seq
        hop = rule.hop * self.stretch
        begun = run.seq + (segment - run.seq) % hop  # first number of the hop grid at or after run.seq
        starts = [*self.state.starts, *((seq, int(run.t_ns[seq - run.seq])) for seq in range(begun, run.end, hop))]
        while starts and starts[0][0] + rule.samples <= run.end:
            seq, start_ns = starts.pop(0)
            end_ns = int(run.t_ns[seq + rule.samples - 1 - run.seq])
            out.windows.append(Window(WindowId(run.epoch, seq, rule.samples), start_ns, end_ns))
        self._move(next_seq=run.end, last_ns=int(run.t_ns[-1]), starts=tuple(starts))

    def _move(self, **changes: object) -> None:
        self.state = dataclasses.replace(self.state, **changes)  # type: ignore[arg-type]
