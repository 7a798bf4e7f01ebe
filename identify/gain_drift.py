"""Does the answer depend on how strong the observer is? With a complete model it does not (Hausman 1978).

A weak observer lets a wrong model bend the parameters over whole strokes, a strong one lets the latent force take the
blame. What one Gauss-Newton step under a weaker observer moves the answer by, beyond what chance would do (by the waves
of `waves.py`), is a model error that no scatter within the window shows; it belongs into the interval.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from identify.observer import gain_table
from identify.problem import FrictionProblem
from identify.waves import WAVES, cosine_sums

Floats = NDArray[np.float64]

WEAKER = 0.1  # of rho
CHANCE = 2.0  # standard deviations of the drift


def gain_drift(problem: FrictionProblem, x: Floats, gain: Floats, free: NDArray[np.int64], prior: Floats) -> Floats:
    """What a weaker observer moves the free unknowns by, as far as it is no chance. (q,)

    Args:
        problem: what was fitted.
        x: its optimum. (size,)
        gain: of the observer there; nothing drifts where no weaker one is in the table. (4,)
        free: indices of the unknowns that are not at a bound. (q,)
        prior: precision that the data did not bring. (q, q)
    """
    gains, settings = gain_table(problem.samples.sample_time)
    own = np.flatnonzero((gains == gain[:, None]).all(axis=0))
    if not len(own) or not gain.any():
        return np.zeros(len(free))
    tau, rho = settings[:, own[0]]
    weaker = np.flatnonzero((settings[0] == tau) & (np.abs(settings[1] / (WEAKER * rho) - 1.0) < 0.1))
    if not len(weaker):
        return np.zeros(len(free))
    error, slope = problem.jacobian(x, gain)
    here = _pulls(error, slope[:, free], prior)
    error, slope = problem.differences(x, gains[:, weaker[0]])
    there = _pulls(error, slope[:, free], prior)
    apart = there - here
    drift = apart.sum(axis=0)  # the sum of `here` is what the optimum has left: nothing but the prior's pull
    chance = np.sqrt(2.0 * np.mean(cosine_sums(apart, WAVES + 1)[1:] ** 2, axis=0))
    share = 1.0 - (CHANCE * chance / np.maximum(np.abs(drift), 1e-300)) ** 2
    return np.asarray(drift * np.sqrt(np.clip(share, 0.0, 1.0)), dtype=np.float64)


def _pulls(error: Floats, slope: Floats, prior: Floats) -> Floats:
    """What each of the errors (n,) with derivatives (n, q) moves the answer by. (n, q)"""
    variance = float(error @ error) / len(error) + 1e-300
    posterior = np.linalg.pinv(slope.T @ slope + variance * prior, hermitian=True)
    return np.asarray(-(slope * error[:, None]) @ posterior, dtype=np.float64)
