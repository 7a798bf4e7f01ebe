"""A likelihood with many peaks: a population climbs it, or a scan of one place; a slope only ends on the next peak.

Sides meet and part: each moment at which a gap closes may come before or after a sample; as the gap's width passes,
the likelihood rises and falls. The cross-entropy method (Rubinstein & Kroese 2004) draws candidates from a normal
distribution, keeps the best, and fits the distribution to them; it needs values, no slopes, and a block of the
simulator gives many at once.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from identify.mismatch.compare import SEED, Fit, fit
from identify.mismatch.extended import ExtendedProblem
from identify.mismatch.guise import Guise

Floats = NDArray[np.float64]

CANDIDATES, BEST = 160, 20  # of a generation, and what is kept of it
GENERATIONS = 12
FRICTION, OWN = 0.1, 0.3  # first standard deviations of the scaled unknowns: of the rest of the model, of the effect
FORGETS = 0.7  # of the distribution, in a generation
NARROWER = 0.6  # of the standard deviations, each time the search is begun again
CLIMBS = 3  # at most
WORTH = 25.0  # of the loss: a climb that gains less is the last
CLOUD = 48  # candidates around a start, itself among them
SCATTER = 0.35  # of the scaled unknowns, one standard deviation
ALONG = 64  # places that are scanned
JITTER = 1e-14  # of a scaled unknown's variance: what never varies needs a covariance too


def moved(found: Fit, guise: Guise) -> Fit:
    """The fit, or a likelier one of the same model whose effect `guise` is elsewhere along its coordinate.

    Beside a gap, each contact between here and there is a peak of its own.
    """
    place = guise.place()
    if place is None or guise.wave is not None:
        return found
    problem, index = found.problem, found.problem.slot(guise).start + place
    low, high = (bound[index] for bound in problem.bounds)
    x = np.repeat(found.x[None], ALONG, axis=0)
    x[:, index] = np.linspace(low, high, ALONG + 2)[1:-1]
    with np.errstate(all="ignore"):
        loss = np.nan_to_num(problem.losses(x, found.found.gain), nan=np.inf)
    if loss.min() >= found.found.criterion:
        return found
    other = fit(problem, x[[int(np.argmin(loss))]], rounds=0)
    return fit(problem, other.x[None]) if other.found.criterion < found.found.criterion else found


def scattered(problem: ExtendedProblem, guise: Guise, x: Floats, gains: Floats) -> Floats:
    """The likeliest of a cloud around each of the points x (k, size) whose unknowns of `guise` vary, at `gains` (5, k).

    A start of a gap that is a quarter too wide lies on another peak, and a short polish stays there.
    """
    draw = np.random.default_rng(SEED)
    slot, found = problem.slot(guise), x.copy()
    for k in range(len(x)):
        cloud = np.repeat(x[[k]], CLOUD, axis=0)
        cloud[1:, slot] += SCATTER * draw.normal(size=(CLOUD - 1, guise.size))
        cloud = np.clip(cloud, *problem.bounds)
        with np.errstate(all="ignore"):
            loss = np.nan_to_num(problem.losses(cloud, gains[:, k]), nan=np.inf)
        found[k] = cloud[int(np.argmin(loss))]
    return found


def climbed(found: Fit, guise: Guise) -> Fit:
    """The likeliest fit of the same model around `found`, whose effect `guise` has a likelihood of many peaks."""
    problem, begun = found.problem, found
    spread = np.zeros(problem.size)
    spread[: problem.p] = FRICTION
    spread[problem.slot(guise)] = OWN
    draw = np.random.default_rng(SEED)
    for _ in range(CLIMBS):
        higher = fit(problem, _generations(found, spread, draw)[None], rounds=0)
        gained = found.found.criterion - higher.found.criterion
        found = higher if gained > 0.0 else found
        if gained < WORTH:
            break
        spread *= NARROWER
    return found if found is begun else fit(problem, found.x[None])


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
