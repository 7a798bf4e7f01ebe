"""The model everybody would fit, with the torque between two samples read in the likeliest way."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
from scipy.ndimage import convolve1d

from identify.mismatch.compare import Fit
from identify.mismatch.data import Evidence
from identify.mismatch.extended import ExtendedProblem
from identify.preprocess import Samples
from identify.problem import FrictionProblem
from identify.search import observer_search
from plant.axis import Axis

LIKELIER = 30.0  # twice the log-likelihood by which another reading of the torque must win
READINGS = {  # of a torque logged as held by a loop that runs faster than the log
    "straight between samples": (1.0,),
    "straight, averaged over three samples": (0.25, 0.5, 0.25),
    "straight, averaged over five samples": (0.2, 0.2, 0.2, 0.2, 0.2),
}


def fit_baseline(samples: Samples, axis: Axis, seed: int) -> Fit:
    """Fit the baseline model to `samples`."""
    plain = FrictionProblem(samples, axis)
    found = observer_search(plain, np.random.default_rng(seed))
    return Fit(ExtendedProblem(samples, axis, scales=plain.scales), found)


def read_torque(evidence: Evidence, axis: Axis, doubtful: bool, seed: int) -> tuple[Evidence, Fit]:
    """The baseline, and the evidence with the torque read in the likeliest way.

    A closed loop runs faster than most logs of it: what is logged as "held" is often one point of a restless force,
    and the force that acted is better told from its neighbours. An open-loop command is what its word says.

    Args:
        evidence: as gathered.
        axis: the machine.
        doubtful: True where the word on the torque cannot be relied on.
        seed: of the search.
    """
    best, chosen, word = fit_baseline(evidence.train, axis, seed), evidence, None
    if not doubtful or evidence.train.linear:
        return chosen, best
    needed = best.found.criterion - LIKELIER
    for name, weights in READINGS.items():
        other = dataclasses.replace(
            evidence,
            train=_reread(evidence.train, weights),
            held_out=_reread(evidence.held_out, weights),
            before=None if evidence.before is None else _reread(evidence.before, weights),
        )
        fitted = fit_baseline(other.train, axis, seed)
        if fitted.found.criterion < min(needed, best.found.criterion):
            best, chosen, word = fitted, other, name
    if word is not None:
        chosen = dataclasses.replace(chosen, removed=(*chosen.removed, f"torque read as {word}: likelier than held"))
    return chosen, best


def _reread(samples: Samples, weights: tuple[float, ...]) -> Samples:
    """The samples with their force averaged by `weights` and straight in between."""
    force = samples.force.copy()
    for a, b in itertools.pairwise([*samples.first.tolist(), len(samples)]):
        force[a:b] = convolve1d(samples.force[a:b], np.array(weights), mode="nearest")
    return dataclasses.replace(samples, force=force, linear=True)
