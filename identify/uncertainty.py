"""95 % intervals that hold when the error is coloured and friction does not repeat exactly.

What slow waves in the errors would move the answer by gives the covariance (`waves.py`): it does not matter over how
many samples errors are correlated, as long as it is no longer than a stroke or two.

Five things are added: what the marching steps may do (on recordings without noise it is all there is), the width of the
priors where the data say nothing (a Stribeck velocity without a Stribeck effect), what the resolution of the force
leaves out (`rounding.py`), what a weaker observer moves beyond chance (`gain_drift.py`), and the share of unmodelled
force that shifts the break-away.

Gauss-Newton alone (white errors) covers 80-93 % once friction does not repeat: docs/identification.md has the table.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.gain_drift import gain_drift
from identify.latent import latent_force
from identify.polish import linearise
from identify.problem import FrictionProblem
from identify.rounding import rounding_scatter
from identify.waves import NORMAL, wave_scatter

Floats = NDArray[np.float64]

STATIC, STRIBECK, FRICTION = 1, 2, 4  # indices of F_s and v_s among the unknowns, and how many make up the friction
CURVED = 0.5  # half-width of log v_s beyond which no straight step describes the valley of the friction law
BREAKAWAY = 0.25  # of the latent force's rms: mean error of F_s over 240 windows was 0.12 to 0.24 of the force left out
AT_BOUND = 1e-6  # of a scaled unknown
INWARD = 0.1  # of the scale of forces: an unknown on a bound that may as well be so far from it is not kept there
MOST_INFLATED = 10.0  # variance over that of white errors


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

    def known(self, index: int, doubt: float) -> Uncertainty:
        """The same where an unknown is known from elsewhere to a standard deviation of `doubt`, scaled.

        What else the excess would move is known better by as much.
        """
        variance = float(self.covariance[index, index])
        if variance <= doubt**2:
            return self
        along = self.covariance[:, index] / variance
        covariance = self.covariance - (variance - doubt**2) * np.outer(along, along)
        return Uncertainty(covariance, self.at_bound, self.inflation)

    def half_widths(self, gradients: Floats) -> Floats:
        """Half-widths of the 95 % intervals of functions with `gradients` (k, size). (k,)"""
        variance = np.einsum("ki,ij,kj->k", gradients, self.covariance, gradients)
        return np.asarray(NORMAL * np.sqrt(np.maximum(variance, 0.0)), dtype=np.float64)


def uncertainty(problem: FrictionProblem, x: Floats, gain: Floats) -> Uncertainty:
    """Uncertainty of the unknowns x (size,) that minimise the loss at observer gains (5,)."""
    low, high = problem.bounds
    at_bound = (x <= low + AT_BOUND) | (x >= high - AT_BOUND)
    free = np.flatnonzero(~at_bound | _unheld(problem, x, gain, at_bound))
    error, slope = problem.jacobian(x, gain)
    slope = slope[:, free]
    variance = float(error @ error) / max(problem.samples.used - len(free), 1) + 1e-300
    prior = np.diag(1.0 / problem.prior[1][free] ** 2)
    inner = wave_scatter(error, slope, variance, prior)
    posterior = np.linalg.pinv(slope.T @ slope / variance + prior, hermitian=True)
    towards = posterior @ slope.T / variance
    shift = towards @ step_error(problem, x, gain)
    inner += np.outer(shift, shift) + posterior @ prior @ posterior
    inner += np.diag(np.where(free == STATIC, breakaway_variance(problem, x, gain), 0.0))
    drift = gain_drift(problem, x, gain, free, prior)
    if at_bound[:FRICTION].any() or NORMAL**2 * inner[STRIBECK, STRIBECK] > CURVED**2:
        drift[free < FRICTION] = 0.0
    inner += np.outer(drift, drift)
    inner += rounding_scatter(problem, x, gain, towards, np.diag(inner))
    ratio = np.diag(inner)[:4] / np.maximum(np.diag(posterior)[:4], 1e-300)
    full = np.zeros((len(x), len(x)))
    full[np.ix_(free, free)] = inner
    return Uncertainty(full, at_bound, float(np.clip(np.exp(np.mean(np.log(ratio))), 1.0, MOST_INFLATED)))


def _unheld(problem: FrictionProblem, x: Floats, gain: Floats, at_bound: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which of F_c and F_s are on a bound that nothing keeps them on: as good as free. (size,)

    On one-way motion, dry friction and a constant force are one; a search that ends on F_c = 0 knows neither.
    """
    found = np.zeros(len(x), dtype=np.bool_)
    edge = np.flatnonzero(at_bound[:STRIBECK])
    if not len(edge):
        return found
    now = linearise(problem, x[None], gain[:, None])
    normal, downhill = now.normal[0], now.downhill[0]
    free = np.flatnonzero(~at_bound)
    for index in edge:
        others = np.linalg.pinv(normal[np.ix_(free, free)], hermitian=True) @ normal[free, index]
        bend = float(normal[index, index] - normal[index, free] @ others)
        found[index] = 2.0 * abs(float(downhill[index])) * INWARD + bend * INWARD**2 < NORMAL**2
    return found


def breakaway_variance(problem: FrictionProblem, x: Floats, gain: Floats) -> float:
    """Square of what forces nobody modelled shift the scaled static force by, unseen by any scatter. [1]

    The machine leaves its rest when the sum of both passes the static force, and the model knows of one of them only.
    """
    return (BREAKAWAY * latent_force(problem, x, gain) / problem.scales.force) ** 2


def step_error(problem: FrictionProblem, x: Floats, gain: Floats) -> Floats:
    """What marching in steps may still do to the predictions: their change under steps half as long. [m] (n,)

    Of a second-order scheme four thirds of it remain; twice is taken, for reversals are less than second order. Longer
    steps would tell as much, but a delay of one step would be none of theirs.
    """
    own = problem.samples.sample_time / problem.substeps
    fine = problem.refined(0.5 * own)
    change = fine.errors(x[None], gain)[:, 0] - problem.jacobian(x, gain)[0]
    return np.asarray(2.0 * change, dtype=np.float64)
