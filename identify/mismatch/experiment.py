"""The next experiment: the smallest change of the running motion that tells apart what these recordings cannot.

Every candidate is simulated for every rival with its fitted parameters, within the limits of torque and travel; the
separation is predicted by the statistic that decides a tie, and the least intrusive candidate that suffices is chosen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from identify.mismatch.motions import Running, again, changes_of
from identify.mismatch.rivals import Rival
from identify.mismatch.separation import Model, Motion, apart_by, loaded, simulated

Floats = NDArray[np.float64]

NEEDED = 90.0  # expected evidence that tells two names apart nine times of ten: the rule's 25, its z, and luck
TRAVEL_ROOM = 0.25  # of the recorded travel that may be added at each end where the axis file knows no travel
DRIFT = 5.0  # times the travel: a simulated open loop that runs further away says nothing about this machine
FORCE_ROOM = 1.2  # times the largest recorded force, where the drive's rating is not known
LONGEST = 300.0  # s of an experiment that is worth asking for


@dataclass(frozen=True, slots=True)
class Experiment:
    """One candidate and what it promises.

    Attributes:
        motion: what to do, in words and in numbers.
        chosen: the set of names that the diagnosis gives first.
        told: each set tied with it, and the predicted fall of the information criterion between the two. [1]
    """

    motion: Motion
    chosen: tuple[str, ...]
    told: tuple[tuple[tuple[str, ...], float], ...]

    @property
    def separation(self) -> float:
        """That of the least separable set. [1]."""
        return min(value for _, value in self.told)

    @property
    def settled(self) -> int:
        """How many of the tied sets it tells from the first."""
        return sum(value >= NEEDED for _, value in self.told)

    def to_dict(self) -> dict[str, Any]:
        """JSON."""
        return {
            "motion": self.motion.words,
            "seconds": self.motion.seconds,
            "separation": self.separation,
            "needed": NEEDED,
            "sufficient": self.separation >= NEEDED,
            "tells_from": [{"names": list(names), "separation": value} for names, value in self.told],
        }


def propose(rivals: Sequence[Rival], closed: bool) -> tuple[Experiment, ...]:
    """Candidates in the order of how much they disturb, with what they would tell; empty without a rival.

    Args:
        rivals: fits of the tied sets, the chosen one first.
        closed: True where the machine runs in a position loop.
    """
    if len(rivals) < 2:
        return ()
    problem = rivals[0].fit.problem
    running = Running.of(problem.samples, problem.axis, closed)
    models = [Model.of(rival.fit) for rival in rivals]
    found = [_unchanged(again(running), rivals)]
    for motion in changes_of(running):
        told = _told(running, motion, rivals, models)
        if told is not None:
            found.append(told)
    return tuple(found)


def _unchanged(motion: Motion, rivals: Sequence[Rival]) -> Experiment:
    """What the running motion once more would tell: as much per second as the recordings that exist."""
    chosen = rivals[0]
    share = motion.seconds / max(float(chosen.fit.problem.samples.steps.sum()), motion.step)
    told = [(one.names, abs(2.0 * float((chosen.fit.terms() - one.fit.terms()).sum())) * share) for one in rivals[1:]]
    return Experiment(motion, chosen.names, tuple(told))


def _told(running: Running, motion: Motion, rivals: Sequence[Rival], models: Sequence[Model]) -> Experiment | None:
    """What `motion` tells between the chosen model and each rival; None beyond the limits."""
    limit = _force_limit(running)
    axis = loaded(running.axis, motion.payload)
    recorded = []
    for model in models:
        samples = simulated(model, motion, limit, float(running.position[0]))
        if samples is None or not _inside(running, samples.position):
            return None
        recorded.append(samples)
    told = []
    for index in range(1, len(rivals)):
        ways = [
            apart_by(models[a], models[b], recorded[a], axis)
            for a, b in ((0, index), (index, 0))
            if not set(rivals[a].fit.names) < set(rivals[b].fit.names)  # a model that holds the truth misses nothing
        ]
        told.append((rivals[index].names, min(ways)))
    return Experiment(motion, rivals[0].names, tuple(told))


def _force_limit(running: Running) -> float:
    """Largest drive force that may be asked for. [N]."""
    recorded = float(abs(running.force).max())
    return max(running.axis.drive.rated_force or FORCE_ROOM * recorded, recorded)


def _inside(running: Running, position: Floats) -> bool:
    """Whether a motion stays on the rail.

    An open loop drifts with the smallest constant force, and whoever runs it trims that away: only its strokes count.
    """
    low, high = running.lowest - 0.02 * running.travel, running.highest + 0.02 * running.travel
    known = running.axis.mechanics.travel
    room = TRAVEL_ROOM * running.travel
    low, high = (
        min(low, low - room if known is None else known[0]),
        max(high, high + room if known is None else known[1]),
    )
    if running.closed:
        return bool(low <= position.min() and position.max() <= high)
    strokes = position - uniform_filter1d(position, max(3, round(1.0 / (running.frequency * running.step))))
    inner = strokes[len(strokes) // 8 : -len(strokes) // 8]
    return bool(np.ptp(inner) <= high - low and np.ptp(position) <= DRIFT * (high - low))


def settling(candidates: Sequence[Experiment]) -> Experiment | None:
    """The least intrusive candidate that tells the first set from most of the others; else the one that tells most."""
    if not candidates:
        return None
    most = max(one.settled for one in candidates)
    if most:
        return next(one for one in candidates if one.settled == most)
    return max(candidates, key=lambda one: max(value for _, value in one.told))


def in_words(one: Experiment) -> str:
    """The contract's string: what to do, and what it is expected to tell."""
    first = _said(one.chosen)
    apart = [(_said(names), value) for names, value in one.told if value >= NEEDED]
    together = [(_said(names), value) for names, value in one.told if value < NEEDED]
    text = f"{one.motion.words}; record it along with these"
    if apart:
        said = ", from ".join(f"{name} (expected evidence {value:.0f})" for name, value in apart)
        rest = (
            "; not from " + ", not from ".join(f"{name} ({value:.0f})" for name, value in together) if together else ""
        )
        return f"{text}. It should tell {first} from {said}{rest}; {NEEDED:.0f} tell two names apart nine times of ten"
    name, value = max(together, key=lambda pair: pair[1])
    seconds = one.motion.seconds * NEEDED / max(value, 1e-9)
    promise = f"expected evidence for {first} against {name} {value:.0f} of the {NEEDED:.0f} that tell them apart"
    if seconds <= LONGEST:
        return f"{text}, {seconds / one.motion.seconds:.1f} times as long: {promise} in {one.motion.seconds:.0f} s"
    return (
        f"none of the small changes that were simulated separates the names; the best is {one.motion.words}: {promise}"
    )


def _said(names: tuple[str, ...]) -> str:
    """A set of effects in words."""
    return " with ".join(name.replace("_", " ") for name in names)
