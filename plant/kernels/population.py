"""Marching eq. (5) for a whole population: candidates innermost, so that one vector instruction serves many of them."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from plant.kernels.step import FASTMATH, advance_velocity

Floats = NDArray[np.float64]


@njit(cache=True, fastmath=FASTMATH, error_model="numpy")
def march(
    force: Floats,
    steps: Floats,
    substeps: int,
    linear: bool,
    law: Floats,
    y: Floats,
    v: Floats,
    positions: Floats,
) -> None:
    """March m candidates over n samples.

    Args:
        force: drive force at the belt at each sample. [N] (n,)
        steps: time from each sample to the next. [s] (n - 1,)
        substeps: sub-steps per sample, >= 1.
        linear: True when the force runs straight between samples, False when it is held.
        law: rows F_c, F_s - F_c, 1/v_s, F_v, m_e, force against the motion-independent sum M g + F_0. (6, m)
        y: positions at the first sample; left at the last. [m] (m,)
        v: velocities, likewise. [m/s] (m,)
        positions: filled. [m] (n, m)
    """
    m = y.shape[0]
    coulomb, bump, inverse_stribeck, viscous, mass, against = law[0], law[1], law[2], law[3], law[4], law[5]
    for j in range(m):
        positions[0, j] = y[j]
    for k in range(steps.shape[0]):
        h = steps[k] / substeps
        inverse_h = 1.0 / h
        slope = (force[k + 1] - force[k]) / substeps if linear else 0.0
        for i in range(substeps):
            middle = force[k] + (i + 0.5) * slope
            for j in range(m):
                ahead, mean = advance_velocity(
                    v[j],
                    middle - against[j],
                    slope,
                    mass[j] * inverse_h,
                    coulomb[j],
                    bump[j],
                    inverse_stribeck[j],
                    viscous[j],
                )
                y[j] += h * mean
                v[j] = ahead
        for j in range(m):
            positions[k + 1, j] = y[j]
