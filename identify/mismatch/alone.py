"""One recording by itself, where all together show nothing: what acts in it alone is unseen data to nobody.

Physics that one motion wakes and the others do not (a torque limit, friction after rests, a mode that only a sweep
reaches) is not in what is fitted, or not in what judges. A recording that leaves far more force by itself than all
together do says that something is there; its own end then judges what.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from identify.mismatch.baseline import read_torque
from identify.mismatch.compare import compare
from identify.mismatch.conclusion import Conclusion
from identify.mismatch.data import Evidence, Judges, at_one_rate, join, of_today, split
from identify.mismatch.result import Verdict
from identify.preprocess import Samples
from plant.recording import Recording

LOUDER = 1.4  # times the latent force of all recordings together
ALONE = "{} asked by itself: it leaves {:.2g} {unit} without a model, all recordings together {:.2g} {unit}"


@dataclass(frozen=True, slots=True, eq=False)
class Alone:
    """A recording to ask by itself.

    Attributes:
        recordings: it, and those of commissioning.
        evidence: from these.
        others: all other recordings of today.
    """

    recordings: tuple[Recording, ...]
    evidence: Evidence
    others: Samples

    def stands(self, found: Conclusion) -> bool:
        """Whether `found` is told by this recording, and the others do not speak against its names."""
        if found.verdict is Verdict.NO_MISMATCH:
            return False
        chosen = found.selection
        return not chosen.steps or compare(chosen.baseline, chosen.chosen, self.others).foreseen > 0.0


def loudest_alone(
    together: Conclusion, recordings: Sequence[Recording], removed: tuple[str, ...], doubtful: bool
) -> Alone | None:
    """The recording that leaves most force by itself, and `LOUDER` times that of all; None where none does.

    Args:
        together: what all recordings say.
        recordings: all of them.
        removed: what was left out before, in words.
        doubtful: as in `baseline.read_torque`.
    """
    today = of_today(recordings)
    if len(today) < 2:
        return None
    axis, quiet = together.axis, together.selection.baseline.latent_force
    ready = at_one_rate(recordings, axis)
    single = {number: split(recordings, ready, Judges.LAST, removed, only=number) for number in today}
    left = {number: read_torque(one, axis, doubtful, together.seed)[1].latent_force for number, one in single.items()}
    loudest = max(left, key=lambda number: left[number])
    if left[loudest] <= LOUDER * quiet:
        return None
    name = Path(recordings[loudest].source).name or f"recording {loudest + 1}"
    said = ALONE.format(name, left[loudest], quiet, unit=axis.force_unit)
    evidence = single[loudest]
    return Alone(
        tuple(r for number, r in enumerate(recordings) if number == loudest or number not in today),
        replace(evidence, removed=(*evidence.removed, said)),
        join([ready[number] for number in today if number != loudest]),
    )
