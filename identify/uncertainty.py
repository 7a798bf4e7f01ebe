"""95 % intervals that hold when the error is coloured and friction does not repeat exactly.

Three covariances compete, and the widest interval wins: the one of white errors (Gauss-Newton), and two sandwiches over
blocks of the recording (Huber 1967; Liang & Zeger 1986), which see that neighbouring samples, strokes and cycles err
together. Few blocks know little of their own scatter, hence Student's t.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from identify.problem import FrictionProblem

Floats = NDArray[np.float64]

BLOCKS = (6, 20)  # pieces of the recording: long ones for cycles that differ, short ones for many of them
LEVEL = 0.95
NORMAL = 1.959964
AT_BOUND = 1e-6  # of a scaled unknown


@dataclass(frozen=True, slots=True, eq=False)
class Uncertainty:
    """How far functions of the unknowns can be trusted.

    Attributes:
        covariances: one per way to count the errors, in scaled unknowns. (c, size, size)
        quantiles: half-width of a 95 % interval in standard deviations, one per covariance. (c,)
        at_bound: unknowns that ended on a bound; they carry no interval. (size,)
    """

    covariances: Floats
    quantiles: Floats
    at_bound: NDArray[np.bool_]

    def part(self, count: int) -> Uncertainty:
        """The same for the first `count` unknowns."""
        return Uncertainty(self.covariances[:, :count, :count].copy(), self.quantiles, self.at_bound[:count])

    def half_widths(self, gradients: Floats) -> Floats:
        """Half-widths of the 95 % intervals of functions with `gradients` (k, size). (k,)"""
        variance = np.einsum("ki,cij,kj->ck", gradients, self.covariances, gradients)
        return np.asarray((np.sqrt(np.maximum(variance, 0.0)) * self.quantiles[:, None]).max(axis=0), dtype=np.float64)


def uncertainty(problem: FrictionProblem, x: Floats, gain: Floats) -> Uncertainty:
    """Uncertainty of the unknowns x (size,) that minimise the loss at observer gains (4,)."""
    low, high = problem.bounds
    at_bound = (x <= low + AT_BOUND) | (x >= high - AT_BOUND)
    free = np.flatnonzero(~at_bound)
    error, slope = problem.jacobian(x, gain)
    slope = slope[:, free]
    variance = float(error @ error) / max(len(error) - len(free), 1)
    precision = slope.T @ slope / variance + np.diag(1.0 / problem.prior[1][free] ** 2)
    white = np.linalg.pinv(precision, hermitian=True)
    covariances, quantiles = [white], [NORMAL]
    for blocks in BLOCKS:
        edges = np.linspace(0, len(error), blocks + 1).astype(np.int64)[:-1]
        scores = np.add.reduceat(slope * error[:, None], edges, axis=0) / variance
        scores -= scores.mean(axis=0)
        meat = scores.T @ scores * blocks / (blocks - 1)
        covariances.append(white @ meat @ white)
        quantiles.append(float(student.ppf(0.5 + LEVEL / 2, blocks - 1)))
    full = np.zeros((len(covariances), len(x), len(x)))
    full[:, free[:, None], free[None, :]] = covariances
    return Uncertainty(full, np.array(quantiles), at_bound)
