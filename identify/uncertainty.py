"""95 % intervals that hold when the error is coloured and friction does not repeat exactly.

Scatter of blocks (Bell & McCaffrey 2002): the recording is cut into blocks; what each block alone would move the answer
by gives the covariance. Neighbouring samples, strokes and cycles that err together stay together in a block, whatever
their correlation. A block that carries much of the information hides its own error in the fit, by its leverage: the
correction (1 - leverage)^-1/2 is unbiased for white errors ("CR2"), (1 - leverage)^-1 is the jackknife that leaves the
block out ("CR3") and a little too wide; we take the middle, which the study of coverage finds nearest to 95 %. Three
ways to cut are averaged, because ten blocks alone know their own scatter only to a quarter; Student's t pays for the
rest.

Five things are added: what the marching steps may do (on recordings without noise it is all there is), the width of the
priors where the data say nothing (a Stribeck velocity without a Stribeck effect), what the resolution of the force
leaves out (`rounding.py`), what a weaker observer moves beyond chance (`gain_drift.py`), and the share of unmodelled
force that shifts the break-away.

Where the likeliest fit is the free run and its errors are white by test, nothing unmodelled shows; then the covariance
of white errors is right but for the chance that the test errs, the blocks' is wide, and most of the former is taken.

Gauss-Newton alone (white errors) covers 80-93 % once friction does not repeat, Bartlett windows 84-94 %:
docs/identification.md has the table.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2
from scipy.stats import t as student

from identify.gain_drift import gain_drift
from identify.latent import supplied_force
from identify.problem import FrictionProblem
from identify.rounding import rounding_scatter

Floats = NDArray[np.float64]

BLOCKS = (7, 10, 13)  # no common divisor: their edges fall on different phases of a periodic motion
LAGS = 10  # samples
WHITE = 0.7  # weight of the white covariance where errors are white; the blocks' alone covers 98 %, it alone 94 %
STATIC, STRIBECK, FRICTION = 1, 2, 4  # indices of F_s and v_s among the unknowns, and how many make up the friction
CURVED = 0.5  # half-width of log v_s beyond which no straight step describes the valley of the friction law
BREAKAWAY = 0.25  # of the latent force's rms: mean error of F_s over 240 windows was 0.12 to 0.24 of the force left out
LEVEL = 0.95
NORMAL = 1.959964
AT_BOUND = 1e-6  # of a scaled unknown
MOST_INFLATED = 10.0  # variance over that of white errors
LEVERAGE = 0.75  # exponent of the correction: 1/2 is CR2, 1 the jackknife
HIGHEST_LEVERAGE = 1.0 - 1e-6  # keeps a block that carries everything from dividing by zero


@dataclass(frozen=True, slots=True, eq=False)
class Uncertainty:
    """How far functions of the unknowns can be trusted.

    Attributes:
        covariance: of the scaled unknowns, widened so that `NORMAL` standard deviations are a 95 % interval.
            (size, size)
        at_bound: unknowns that ended on a bound; they carry no interval. (size,)
        inflation: variance over that of white errors, on average of the unknowns. [1] >= 1
    """

    covariance: Floats
    at_bound: NDArray[np.bool_]
    inflation: float = 1.0

    def part(self, count: int) -> Uncertainty:
        """The same for the first `count` unknowns."""
        return Uncertainty(self.covariance[:count, :count].copy(), self.at_bound[:count], self.inflation)

    def half_widths(self, gradients: Floats) -> Floats:
        """Half-widths of the 95 % intervals of functions with `gradients` (k, size). (k,)"""
        variance = np.einsum("ki,ij,kj->k", gradients, self.covariance, gradients)
        return np.asarray(NORMAL * np.sqrt(np.maximum(variance, 0.0)), dtype=np.float64)


def uncertainty(problem: FrictionProblem, x: Floats, gain: Floats) -> Uncertainty:
    """Uncertainty of the unknowns x (size,) that minimise the loss at observer gains (4,)."""
    low, high = problem.bounds
    at_bound = (x <= low + AT_BOUND) | (x >= high - AT_BOUND)
    free = np.flatnonzero(~at_bound)
    error, slope = problem.jacobian(x, gain)
    slope = slope[:, free]
    variance = float(error @ error) / max(problem.samples.used - len(free), 1) + 1e-300
    prior = np.diag(1.0 / problem.prior[1][free] ** 2)
    inner = np.zeros((len(free), len(free)))
    for blocks in BLOCKS:
        widen = float(student.ppf(0.5 + LEVEL / 2, blocks - 1)) / NORMAL
        inner += widen**2 / len(BLOCKS) * block_scatter(error, slope, variance, prior, blocks)
    posterior = np.linalg.pinv(slope.T @ slope / variance + prior, hermitian=True)
    if not gain.any() and is_white(error[problem.samples.valid]):
        inner = (1.0 - WHITE) * inner + WHITE * posterior
    towards = posterior @ slope.T / variance
    shift = towards @ step_error(problem, x, gain)
    inner += np.outer(shift, shift) + posterior @ prior @ posterior
    inner += np.diag(np.where(free == STATIC, breakaway_variance(problem, x, gain, error), 0.0))
    drift = gain_drift(problem, x, gain, free, prior)
    if at_bound[:FRICTION].any() or NORMAL**2 * inner[STRIBECK, STRIBECK] > CURVED**2:
        drift[free < FRICTION] = 0.0
    inner += np.outer(drift, drift)
    inner += rounding_scatter(problem, x, gain, towards, np.diag(inner))
    ratio = np.diag(inner)[:4] / np.maximum(np.diag(posterior)[:4], 1e-300)
    full = np.zeros((len(x), len(x)))
    full[np.ix_(free, free)] = inner
    return Uncertainty(full, at_bound, float(np.clip(np.exp(np.mean(np.log(ratio))), 1.0, MOST_INFLATED)))


def breakaway_variance(problem: FrictionProblem, x: Floats, gain: Floats, error: Floats) -> float:
    """Square of what forces nobody modelled shift the scaled static force by, unseen by any scatter of blocks. [1]

    The machine leaves its rest when the sum of both passes the static force, and the model knows of one of them only.
    """
    latent = supplied_force(problem, x, gain, error)
    return (BREAKAWAY * latent / problem.scales.force) ** 2


def is_white(error: Floats) -> bool:
    """Whether errors (n,) show no correlation over the first `LAGS` samples (Box & Pierce 1970, 1 % level)."""
    centred = error - error.mean()
    power = float(centred @ centred)
    if power == 0.0 or len(error) <= 2 * LAGS:
        return False
    correlation = np.array([centred[lag:] @ centred[:-lag] for lag in range(1, LAGS + 1)]) / power
    return bool(len(error) * float(correlation @ correlation) < chi2.ppf(0.99, LAGS))


def step_error(problem: FrictionProblem, x: Floats, gain: Floats) -> Floats:
    """What marching in steps may still do to the predictions: their change under steps twice as long. [m] (n,)

    Of a second-order scheme a third of it remains; half is taken, for reversals are less than second order.
    """
    own = problem.samples.sample_time / problem.substeps
    rough = problem.refined(2.0 * own)
    change = rough.errors(x[None], gain)[:, 0] - problem.jacobian(x, gain)[0]
    return np.asarray(0.5 * change, dtype=np.float64)


def block_scatter(error: Floats, slope: Floats, variance: float, prior: Floats, blocks: int) -> Floats:
    """Covariance (q, q) of a least-squares fit from what each block moves it by.

    Args:
        error: residuals. [m] (n,)
        slope: their derivatives. [m] (n, q)
        variance: of the residuals. [m²]
        prior: precision that the data did not bring. (q, q)
        blocks: pieces of equal length.
    """
    edges = np.linspace(0, len(error), blocks + 1).astype(np.int64)
    normal = np.stack([slope[a:b].T @ slope[a:b] for a, b in itertools.pairwise(edges)]) / variance
    score = np.add.reduceat(slope * error[:, None], edges[:-1], axis=0) / variance
    # Whitened by the whole, a block's own normal equations are its leverage: eigenvalues from 0 to 1.
    size, turn = np.linalg.eigh(normal.sum(axis=0) + prior)
    root = turn / np.sqrt(np.maximum(size, size[-1] * 1e-15))
    leverage, axes = np.linalg.eigh(root.T @ normal @ root)
    weight = (1.0 - np.clip(leverage, 0.0, HIGHEST_LEVERAGE)) ** -LEVERAGE
    along = np.einsum("bji,bj->bi", axes, score @ root)
    moved = np.einsum("bij,bj->bi", axes, weight * along) @ root.T
    moved -= moved.mean(axis=0)
    return np.asarray(moved.T @ moved * (blocks / (blocks - 1)), dtype=np.float64)
