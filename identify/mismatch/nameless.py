"""What a force without a name is worth: evidence, unseen data, newtons."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from identify.mismatch.locate import coordinates
from identify.mismatch.probes import View

Floats = NDArray[np.float64]

EVIDENCE = 60.0  # twice the log of how much likelier the force is than none
HELD_OUT = 25.0  # of the same, that the shape must gain on data it has not seen
AGREED = 2.5  # z of the blocks of those data
MOST = 1.0 - 1e-9  # of the errors that may be taken out
SMALLEST = 0.03  # of the dry friction, rms past what friction itself can take: its own curve is known no better
LOCAL = 0.003  # of the same along the travel, of a tone, of a band of speeds: friction's own curve has none of them ...
BANDS = {
    "position",
    "velocity",
    "time_since_reversal",
    "distance_since_reversal",
}  # a short stretch of these is no curve
SURE = 4.0  # ... where the blocks agree so well
MOST_OF_IT, NEARLY = 0.6, 0.9  # of a free shape's evidence


@dataclass(frozen=True, slots=True)
class Structure:
    """Force that depends on a coordinate though no name stands for it.

    Attributes:
        coordinate: of the contract.
        interval: where on it.
        evidence: twice the log marginal likelihood ratio. [1]
        z: of its gain on data that were not fitted. [1]
        force: rms past what friction itself could take; 0 where that is not known. [N]
        like: physics that is in no catalogue but would explain it; empty where none would.
        acting: the force where it acts, if it is an equal one over a short stretch away from both ends; else 0. [N]
        also: coordinates that the same force may depend on as well.
    """

    coordinate: str
    interval: tuple[float, float]
    evidence: float
    z: float
    force: float
    like: str = ""
    acting: float = 0.0
    also: tuple[str, ...] = ()

    @property
    def p_value(self) -> float:
        """Probability of such a gain on unseen data by chance."""
        return float(norm.sf(self.z))


def simplest_first(found: list[Structure]) -> list[Structure]:
    """Structures, most evident first, but before a free shape what explains `MOST_OF_IT` with two or three numbers.

    A shape has a number for each of its places; physics along the same coordinate has fewer, and so have a tone, which
    unseen data must agree on better, and physics along another one, if it explains `NEARLY` all of it besides.
    """
    first = found[0]
    much = [one for one in found if one.evidence > MOST_OF_IT * first.evidence]
    simple = [
        one
        for one in much
        if (one.like and one.coordinate == first.coordinate)
        or (
            one.z > first.z and (one.coordinate == "frequency" or (one.like and one.evidence > NEARLY * first.evidence))
        )
    ]
    return sorted(found, key=lambda one: one is not simple[0]) if simple and not first.like else found


def gained(view: View, change: Floats) -> Floats:
    """Twice the log-likelihood that a change of the prediction errors gains, per sample. (n,)"""
    return np.asarray((view.error**2 - (view.error + change) ** 2) / view.variance, dtype=np.float64)


def net_force(view: View, force: Floats) -> float:
    """Rms of a force series past what a constant, dry and viscous friction could take. [N]."""
    problem = view.fit.problem
    known = coordinates(problem.samples, problem.axis)
    speed, sign = known["velocity"], known["direction"]
    bend = np.exp(-np.abs(speed) * problem.law(view.x[None])[2, 0])
    design = np.stack([np.ones_like(speed), sign, speed, sign * bend], axis=1)
    rest = force - design @ np.linalg.lstsq(design, force, rcond=None)[0]
    return float(np.sqrt(np.mean(rest**2)))


def likelier(view: View, gain: float) -> float:
    """Twice the log of how much likelier the errors are once a `gain` at the present variance is taken out of them."""
    count = len(view.error)
    return -count * float(np.log1p(-min(gain / count, MOST)))


def gain_of_one(view: View, seen: Floats) -> float:
    """What one response (n,) gains."""
    return float(seen @ view.error) ** 2 / max(float(seen @ seen), 1e-300) / view.variance


def gain_of_pair(view: View, seen: Floats) -> float:
    """What two responses (n, 2) together gain."""
    weights = np.linalg.lstsq(seen, view.error, rcond=None)[0]
    return float(weights @ (seen.T @ view.error)) / view.variance


def gains_of_pairs(view: View, forces: Floats) -> Floats:
    """What each pair of neighbouring force series (n, 2 q) together gains. (q,)"""
    seen = view.responses(forces)
    along = (seen.T @ view.error).reshape(-1, 2)
    one, two = seen[:, 0::2], seen[:, 1::2]
    a, b, c = (np.einsum("nq,nq->q", *pair) for pair in ((one, one), (one, two), (two, two)))
    determinant = a * c - b * b
    usable = determinant > 1e-9 * np.maximum(a * c, 1e-300)
    gained = c * along[:, 0] ** 2 - 2 * b * along[:, 0] * along[:, 1] + a * along[:, 1] ** 2
    return np.where(usable, gained / np.where(usable, determinant, 1.0), 0.0) / view.variance


def large_enough(found: Structure, dry_level: float) -> bool:
    """Whether a structure is sure, and more than how imperfectly the friction curve is known at this level [N]."""
    if found.acting > 0.0 and found.coordinate in BANDS and found.z >= AGREED and found.acting >= SMALLEST * dry_level:
        return True
    local = found.coordinate in {"position", "frequency"} or (found.acting > 0.0 and found.coordinate == "velocity")
    if local and found.z >= SURE:
        return found.force >= LOCAL * dry_level
    return found.z >= AGREED and found.force >= SMALLEST * dry_level
