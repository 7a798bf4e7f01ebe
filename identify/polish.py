"""Local polish: Levenberg-Marquardt on the prediction errors, within bounds, all trial steps at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.problem import FrictionProblem

Floats = NDArray[np.float64]

DAMPINGS = 10.0 ** np.arange(-5.0, 3.0)  # eight trial steps fill the lanes of one predictor run
SMALL_GAIN = 1e-3  # of the loss (a log-likelihood, so an absolute number): less is not worth an iteration


@dataclass(frozen=True, slots=True, eq=False)
class Polished:
    """Where the polish ended: x (size,), its loss, and how many candidate runs it cost."""

    x: Floats
    loss: float
    evaluations: int


def polish(problem: FrictionProblem, x: Floats, gain: Floats, iterations: int = 30) -> Polished:
    """Descend from x until an iteration gains less than `SMALL_GAIN`; never ends higher than it began."""
    low, high = problem.bounds
    centre, spread = problem.prior
    x = np.clip(x, low, high)
    loss = float(problem.losses(x[None], gain)[0])
    evaluations = 1
    for _ in range(iterations):
        error, slope = problem.jacobian(x, gain)
        variance = float(error @ error) / len(error) + 1e-300
        normal = slope.T @ slope / variance + np.diag(1.0 / spread**2)
        downhill = -(slope.T @ error) / variance - (x - centre) / spread**2
        if not (np.isfinite(normal).all() and np.isfinite(downhill).all()):
            break
        trials = _trial_steps(x, normal, downhill, low, high)
        losses = problem.losses(trials, gain)
        evaluations += problem.p + 3 + len(trials)
        best = int(np.argmin(losses))
        gained = loss - float(losses[best])
        if gained > 0:
            x, loss = trials[best], float(losses[best])
        if gained < SMALL_GAIN:
            break
    return Polished(x, loss, evaluations)


def _trial_steps(x: Floats, normal: Floats, downhill: Floats, low: Floats, high: Floats) -> Floats:
    """One step per damping; unknowns that a bound holds back stay where they are. (8, size)"""
    free = ~(((x <= low) & (downhill < 0)) | ((x >= high) & (downhill > 0)))
    index = np.flatnonzero(free)
    inner = normal[np.ix_(index, index)]
    scale = np.diag(inner)
    trials = np.repeat(x[None], len(DAMPINGS), axis=0)
    damped = inner[None] + DAMPINGS[:, None, None] * np.diag(scale)[None]
    trials[:, index] += np.linalg.solve(
        damped, np.broadcast_to(downhill[index], (len(DAMPINGS), len(index)))[..., None]
    )[..., 0]
    return np.clip(trials, low, high)
