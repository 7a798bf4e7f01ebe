"""Is the optimum of a weak observer one that leads there, or a place beside it? The next stronger observer tells.

Nearly without an observer the model runs free, and where a loop creeps on the falling branch of the friction law the
free run is unstable: the likelihood is a needle, and what a search finds may be one of the dents beside it. A dent
looks like an optimum and promises intervals as short as the needle's. A stronger observer has one wide valley, and from
its answer one Gauss-Newton step under the weak observer comes back to the optimum, unless that was a dent: then the
derivatives mean nothing, and the answer of the stronger observer is the one that can be trusted.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from identify.observer import CORRELATION_TIMES, gain_table
from identify.polish import polish
from identify.problem import FrictionProblem
from identify.search import WEAK, SearchResult

Floats = NDArray[np.float64]

MISSED = 0.5  # standard errors of white noise between the optimum and where the step ends


def reachable(problem: FrictionProblem, found: SearchResult) -> SearchResult:
    """Return `found`, or the answer of the weakest observer above it that the next stronger one leads to."""
    gains, settings = gain_table(problem.samples.sample_time)
    while found.setting[1] <= WEAK:
        tau = found.setting[0] or CORRELATION_TIMES[1]
        stronger = np.flatnonzero((settings[0] == tau) & (settings[1] > found.setting[1] * 1.01))
        if not len(stronger) or _reached(problem, found, gains[:, stronger[0]]):
            return found
        index = stronger[0]
        end = polish(problem, found.x, gains[:, index])
        found = dataclasses.replace(
            found,
            x=end.x,
            criterion=end.loss,
            gain=gains[:, index].copy(),
            setting=settings[:, index].copy(),
            evaluations=found.evaluations + end.evaluations,
        )
    return found


def _reached(problem: FrictionProblem, found: SearchResult, stronger: Floats) -> bool:
    """Whether a step under the stronger observer (5,) and one under the found's own end where they began."""
    x, own = found.x, found.gain
    error = np.sqrt(np.diag(_newton(problem, x, *problem.jacobian(x, own))[1]))
    away = np.clip(x + _newton(problem, x, *problem.differences(x, stronger))[0], *problem.bounds)
    error_there, slope_there = problem.differences(away, own)
    if not (np.isfinite(error_there).all() and np.isfinite(slope_there).all()):
        return False
    back = away + _newton(problem, away, error_there, slope_there)[0]
    return bool((np.abs(back - x) < MISSED * error)[: problem.p].all())


def _newton(problem: FrictionProblem, x: Floats, error: Floats, slope: Floats) -> tuple[Floats, Floats]:
    """Gauss-Newton step from x (size,) with errors (n,) and derivatives (n, size); covariance if errors are white."""
    variance = float(error @ error) / problem.samples.used + 1e-300
    centre, width = problem.prior
    normal = slope.T @ slope / variance + np.diag(width**-2.0)
    posterior = np.asarray(np.linalg.pinv(normal, hermitian=True), dtype=np.float64)
    uphill = slope.T @ error / variance + (x - centre) * width**-2.0
    return np.asarray(-posterior @ uphill, dtype=np.float64), posterior
