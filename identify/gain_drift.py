"""Does the answer depend on how strong the observer is? With a complete model it does not (Hausman 1978).

A weak observer lets a wrong model bend the parameters over whole strokes, a strong one lets the latent force take the
blame. What one Gauss-Newton step under a weaker observer moves the answer by, beyond what chance would do (by the waves
of `waves.py`), is a model error that no scatter within the window shows; it belongs into the interval.

The weakest observers have no weaker one in the table and are asked about a stronger one. Its answer scatters more than
their own, so chance would excuse almost anything; but that this window's noise made the weakest observer the likeliest
is chance too, and no scatter within the window knows of it. Hence the smaller allowance.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from identify.observer import gain_table
from identify.problem import FrictionProblem
from identify.waves import WAVES, cosine_sums

Floats = NDArray[np.float64]

WEAKER = 0.1  # of rho
CHANCE = 2.0  # standard deviations of the drift towards a weaker observer
LUCK = 0.5  # the same towards a stronger one: 0 covered 93-98 % at 1 mm of noise, 1 covered 92-96 %


def gain_drift(problem: FrictionProblem, x: Floats, gain: Floats, free: NDArray[np.int64], prior: Floats) -> Floats:
    """What another observer moves the free unknowns by, as far as it is no chance. (q,)

    Args:
        problem: what was fitted.
        x: its optimum. (size,)
        gain: of the observer there; nothing drifts where it is none. (5,)
        free: indices of the unknowns that are not at a bound. (q,)
        prior: precision that the data did not bring. (q, q)
    """
    gains, settings = gain_table(problem.samples.sample_time)
    own = np.flatnonzero((gains == gain[:, None]).all(axis=0))
    if not len(own) or not gain.any():
        return np.zeros(len(free))
    tau, rho = settings[:, own[0]]
    other, allowed = _at(settings, tau, WEAKER * rho), CHANCE
    if not len(other):
        other, allowed = _at(settings, tau, rho / WEAKER), LUCK
    if not len(other):
        return np.zeros(len(free))
    error, slope = problem.jacobian(x, gain)
    here = _pulls(error, slope[:, free], prior)
    error, slope = problem.differences(x, gains[:, other[0]])
    there = _pulls(error, slope[:, free], prior)
    apart = there - here
    drift = apart.sum(axis=0)  # the sum of `here` is what the optimum has left: nothing but the prior's pull
    chance = np.sqrt(2.0 * np.mean(cosine_sums(apart, WAVES + 1)[1:] ** 2, axis=0))
    share = 1.0 - (allowed * chance / np.maximum(np.abs(drift), 1e-300)) ** 2
    return np.asarray(drift * np.sqrt(np.clip(share, 0.0, 1.0)), dtype=np.float64)


def _at(settings: Floats, tau: float, rho: float) -> NDArray[np.int64]:
    """Index of the observer of this correlation time [s] and strength [1/s²]; none where the table has none."""
    return np.flatnonzero((settings[0] == tau) & (np.abs(settings[1] / rho - 1.0) < 0.1))


def _pulls(error: Floats, slope: Floats, prior: Floats) -> Floats:
    """What each of the errors (n,) with derivatives (n, q) moves the answer by. (n, q)"""
    variance = float(error @ error) / len(error) + 1e-300
    posterior = np.linalg.pinv(slope.T @ slope + variance * prior, hermitian=True)
    return np.asarray(-(slope * error[:, None]) @ posterior, dtype=np.float64)
