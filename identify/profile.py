"""Look along the valley of F_c, F_s and v_s when the straight-line intervals cannot be trusted.

A window that hardly visits the speeds around v_s fits almost as well with another v_s and other F_c and F_s: the valley
is curved, and intervals from derivatives at its bottom miss the rest of it. Refits with v_s held at other values tell;
those the recording cannot reject belong to the answer (profile likelihood, Raue et al. 2009).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.polish import polish_all
from identify.problem import LONGEST_SUBSTEP, FrictionProblem
from identify.uncertainty import Uncertainty, uncertainty

Floats = NDArray[np.float64]

STRIBECK = 2  # index of log v_s among the unknowns
GRID = np.log([0.01, 0.02, 0.04, 0.08, 0.16, 0.32, 0.64, 1.28, 2.56])  # v_s over the fastest speed
DOUBTFUL = 0.5  # half-width of log v_s beyond which derivatives at the optimum say too little
SLOW = np.log(0.05)  # v_s over the fastest speed: so few samples lie below that another v_s may do as well
CHI2 = 3.841  # 95 % of one degree of freedom
WORTH = 20.0  # of the loss: how far from the best a refit in long steps may be to be looked at in fine ones
ENOUGH = 0.05  # of the loss: an iteration that gains less is the last
BETTER = 1.0  # of the loss: the profile found a better optimum than the search
SPEEDS = np.linspace(0.1, 1.0, 10)  # of the fastest, where a refit begins with the same friction


@dataclass(frozen=True, slots=True, eq=False)
class Alternative:
    """Unknowns (size,) that fit about as well, their loss above the optimum's, and their intervals with v_s held."""

    x: Floats
    worse: float
    spread: Uncertainty


def doubtful(x: Floats, spread: Uncertainty) -> bool:
    """Whether derivatives at x (size,) can be trusted to describe the valley."""
    half = float(spread.half_widths(np.eye(len(x))[STRIBECK : STRIBECK + 1])[0])
    return bool(spread.at_bound[:4].any() or half > DOUBTFUL or x[STRIBECK] < SLOW)


def alternatives(problem: FrictionProblem, x: Floats, gain: Floats, spread: Uncertainty) -> list[Alternative]:
    """Answers with other v_s that the recording does not reject, likeliest first.

    Args:
        problem: searched; the refits march in the search's own coarse steps, weak windows need no micrometres.
        x: its optimum. (size,)
        gain: of the observer there. (5,)
        spread: intervals at x; their inflation over white errors widens what counts as not rejected.
    """
    best = float(problem.losses(x[None], gain)[0])
    starts = np.array([same_friction(x, float(value)) for value in GRID[np.abs(GRID - x[STRIBECK]) > 0.2]])
    rough = problem.refined(LONGEST_SUBSTEP)
    ends = polish_all(rough, starts, gain, 15, ENOUGH, pinned=STRIBECK)
    worth = ends.loss < min(float(rough.losses(x[None], gain)[0]), ends.loss.min()) + WORTH * spread.inflation
    if not worth.any():
        return []
    ends = polish_all(problem, ends.x[worth], gain, 5, ENOUGH, pinned=STRIBECK)
    limit = min(best, float(ends.loss.min())) + CHI2 * spread.inflation
    found = []
    for k in np.argsort(ends.loss):
        if ends.loss[k] <= limit:
            held = problem.pinned(STRIBECK, float(ends.x[k, STRIBECK]))
            found.append(Alternative(ends.x[k], float(ends.loss[k]) - best, uncertainty(held, ends.x[k], gain)))
    return found


def same_friction(x: Floats, log_stribeck: float) -> Floats:
    """Unknowns with another v_s and F_c, F_s, F_v such that friction at the visited speeds stays as it was. (size,)"""
    bump, wanted_bump = (np.exp(-SPEEDS / np.exp(value)) for value in (x[STRIBECK], log_stribeck))
    friction = x[0] + (x[1] - x[0]) * bump + x[3] * SPEEDS
    design = np.stack([1.0 - wanted_bump, wanted_bump, SPEEDS], axis=1)
    level, static, viscous = np.linalg.lstsq(design, friction, rcond=1e-6)[0]
    start = x.copy()
    start[:4] = level, static, log_stribeck, viscous
    return start
