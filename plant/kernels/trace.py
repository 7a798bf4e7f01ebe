"""Marching eq. (5) for one candidate, keeping velocity and friction force as well."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from plant.kernels.step import FASTMATH, advance_velocity

Floats = NDArray[np.float64]


@njit(cache=True, fastmath=FASTMATH, error_model="numpy")
def trace(
    start: Floats, end: Floats, steps: Floats, substeps: int, law: Floats, y: float, v: float, out: Floats
) -> None:
    """March one candidate over n samples.

    Args:
        start: drive force just after each sample. [N] (n - 1,)
        end: drive force just before the next. [N] (n - 1,)
        steps: time from each sample to the next. [s] (n - 1,)
        substeps: sub-steps per sample, >= 1.
        law: F_c, F_s - F_c, 1/v_s, F_v, m_e, force against the motion-independent sum M g + F_0. (6,)
        y: position at the first sample. [m]
        v: velocity at the first sample. [m/s]
        out: rows position [m], velocity [m/s], friction force over the sub-step before the sample [N]. (3, n)
    """
    out[0, 0], out[1, 0] = y, v
    for k in range(steps.shape[0]):
        h = steps[k] / substeps
        slope = (end[k] - start[k]) / substeps
        for i in range(substeps):
            force = start[k] + (i + 0.5) * slope - law[5]
            ahead = advance_velocity(v, force, law[4] / h, law[0], law[1], law[2], law[3])
            friction = force - law[4] * (ahead - v) / h
            y += 0.5 * h * (v + ahead)
            v = ahead
            if k == 0 and i == 0:
                out[2, 0] = friction
        out[0, k + 1], out[1, k + 1], out[2, k + 1] = y, v, friction
