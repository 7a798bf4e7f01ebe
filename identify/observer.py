"""Gains of the disturbance observer: from "output error" to "equation error" in one family.

State y, v, d with d an Ornstein-Uhlenbeck acceleration of correlation time tau and strength rho = sigma_d/sigma_y;
steady-state Kalman gains of the discrete Riccati equation (Ljung 1999, ch. 4.3: innovation form).
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_discrete_are

CORRELATION_TIMES = (0.03, 0.15, 1.0)  # s; one alone invites false findings when the unmodelled force is slow
RATIOS = tuple(10.0 ** (0.5 * k) for k in range(1, 9))  # 1/s^2, half decades
STRONGEST = 0.1  # of rho T_s^2: beyond it the observer forgets within five samples and explains the friction itself
FREE_RUN = (0.0, 0.0, 0.0, 0.0, 0.0)


def kalman_gain(sample_time: float, correlation_time: float, ratio: float) -> tuple[float, float, float, float, float]:
    """Steady-state gains L1 [1], L2 [1/s], L3 [1/s²], and phi [1] and rho [1/s²] they are of.

    Args:
        sample_time: T_s. [s]
        correlation_time: tau of the latent acceleration. [s]
        ratio: rho = sigma_d/sigma_y. [1/s²]
    """
    phi = float(np.exp(-sample_time / correlation_time))
    # In units of T_s the equation is well scaled: states y, v T_s, d T_s^2.
    transition = np.array([[1.0, 1.0, 0.5], [0.0, 1.0, 1.0], [0.0, 0.0, phi]])
    strength = (ratio * sample_time**2) ** 2 * (1.0 - phi**2)
    noise = np.diag([1e-12 * strength, 1e-12 * strength, strength])
    measure = np.array([[1.0, 0.0, 0.0]])
    covariance = solve_discrete_are(transition.T, measure.T, noise, np.eye(1))
    gain = covariance[:, 0] / (covariance[0, 0] + 1.0)
    return float(gain[0]), float(gain[1] / sample_time), float(gain[2] / sample_time**2), phi, ratio


@lru_cache(maxsize=64)
def gain_table(sample_time: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """All gains of the grid, the free run first.

    Returns:
        gains (5, g) as the predictors take them, and (2, g) with tau [s] and rho [1/s²] (0, 0 for the free run).
    """
    gains, settings = [FREE_RUN], [(0.0, 0.0)]
    for tau in CORRELATION_TIMES:
        for rho in RATIOS:
            if rho * sample_time**2 > STRONGEST * 1.01:
                continue
            gains.append(kalman_gain(sample_time, tau, rho))
            settings.append((tau, rho))
    return np.ascontiguousarray(np.array(gains).T), np.array(settings).T
