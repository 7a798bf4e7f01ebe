"""A likelihood with many peaks, where sides meet and part: a population climbs it, a slope only ends on the next peak.

Each moment at which a gap closes may come before or after a sample; as the gap's width passes, the likelihood rises and
falls. The cross-entropy method (Rubinstein & Kroese 2004) draws candidates from a normal distribution, keeps the best,
and fits the distribution to them; it needs values, no slopes, and a block of the simulator gives many at once.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from identify.mismatch.compare import SEED, Fit, fit
from identify.mismatch.guise import Guise

Floats = NDArray[np.float64]

CANDIDATES, BEST = 160, 20  # of a generation, and what is kept of it
GENERATIONS = 12
FRICTION, OWN = 0.1, 0.3  # first standard deviations of the scaled unknowns: of the rest of the model, of the effect
FORGETS = 0.7  # of the distribution, in a generation
NARROWER = 0.6  # of the standard deviations, each time the search is begun again
CLIMBS = 3  # at most
WORTH = 25.0  # of the loss: a climb that gains less is the last
JITTER = 1e-14  # of a scaled unknown's variance: what never varies needs a covariance too


def climbed(found: Fit, guise: Guise) -> Fit:
    """The likeliest fit of the same model around `found`, whose effect `guise` has a likelihood of many peaks."""
    problem = found.problem
    spread = np.zeros(problem.size)
    spread[: problem.p] = FRICTION
    spread[problem.slot(guise)] = OWN
    draw = np.random.default_rng(SEED)
    for _ in range(CLIMBS):
        higher = fit(problem, _generations(found, spread, draw)[None])
        gained = found.found.criterion - higher.found.criterion
        found = higher if gained > 0.0 else found
        if gained < WORTH:
            break
        spread *= NARROWER
    return found


def _generations(found: Fit, spread: Floats, draw: np.random.Generator) -> Floats:
    """The likeliest candidate of all generations, at the observer of `found`. (size,)"""
    problem, gain = found.problem, found.found.gain
    never = JITTER * np.eye(problem.size)
    best, least = found.x, float(found.found.criterion)
    mean, covariance = best, np.diag(spread**2)
    for _ in range(GENERATIONS):
        x = draw.multivariate_normal(mean, covariance + never, CANDIDATES, method="cholesky")
        x[0] = best
        x = np.clip(x, *problem.bounds)
        with np.errstate(all="ignore"):
            loss = np.nan_to_num(problem.losses(x, gain), nan=np.inf)
        kept = np.argsort(loss)[:BEST]
        if loss[kept[0]] < least:
            best, least = x[kept[0]].copy(), float(loss[kept[0]])
        mean = x[kept].mean(axis=0)
        away = x[kept] - mean
        covariance = (1.0 - FORGETS) * covariance + FORGETS * (away.T @ away) / BEST
    return best
