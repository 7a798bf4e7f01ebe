"""One-step predictor with a disturbance observer, for m candidates at once.

The model of eq. (5) is marched from sample to sample; at each sample the prediction error corrects position, velocity
and a latent acceleration d (an Ornstein-Uhlenbeck process that stands for every force nobody modelled). With all gains
zero it is the free run whose error eq. (4) sums; with a large gain it is equation error; all between is one family.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from plant.kernels.step import FASTMATH, advance_velocity

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


@njit(cache=True, fastmath=FASTMATH, error_model="numpy")
def predict(
    force: Floats,
    position: Floats,
    steps: Floats,
    run: Ints,
    valid: Bools,
    substeps: int,
    linear: bool,
    law: Floats,
    start: Floats,
    gain: Floats,
    state: Floats,
    error: Floats,
) -> None:
    """Fill the one-step prediction errors of m candidates over n samples in one or more runs.

    Args:
        force: drive force at the belt. [N] (n,)
        position: measured. [m] (n,)
        steps: time to the next sample; not used where the next sample begins another run. [s] (n,)
        run: index of the run a sample belongs to, ascending; the state restarts where it changes. (n,)
        valid: False where the position must not be used: the model runs on, its state is not corrected, and the
            error counts as 0. (n,)
        substeps: sub-steps per sample, >= 1.
        linear: True when the force runs straight between samples, False when it is held.
        law: rows F_c, F_s - F_c, 1/v_s, F_v, m_e, M g + F_0. (6, m)
        start: rows y, v of run 0, y, v of run 1, ... at the runs' first samples. (2 runs, m)
        gain: rows L1 [1], L2 [1/s], L3 [1/s^2], phi [1] of the observer. (4, m)
        state: scratch rows y, v, d. (3, m)
        error: measured minus predicted position. [m] (n, m)
    """
    n, m = force.shape[0], law.shape[1]
    coulomb, bump, inverse_stribeck, viscous, mass, against = law[0], law[1], law[2], law[3], law[4], law[5]
    gain_y, gain_v, gain_d, phi = gain[0], gain[1], gain[2], gain[3]
    y, v, d = state[0], state[1], state[2]
    current = -1
    for k in range(n):
        if run[k] != current:
            current = run[k]
            first_y, first_v = start[2 * current], start[2 * current + 1]
            for j in range(m):
                y[j], v[j], d[j] = first_y[j], first_v[j], 0.0
        measured = position[k]
        row = error[k]
        if valid[k]:
            for j in range(m):
                e = measured - y[j]
                row[j] = e
                y[j] += gain_y[j] * e
                v[j] += gain_v[j] * e
                d[j] += gain_d[j] * e
        else:
            for j in range(m):
                row[j] = 0.0
        if k + 1 < n and run[k + 1] == current:
            h = steps[k] / substeps
            half, inverse_h = 0.5 * h, 1.0 / h
            slope = (force[k + 1] - force[k]) / substeps if linear else 0.0
            for i in range(substeps):
                middle = force[k] + (i + 0.5) * slope
                for j in range(m):
                    ahead = advance_velocity(
                        v[j],
                        middle - against[j] + mass[j] * d[j],
                        mass[j] * inverse_h,
                        coulomb[j],
                        bump[j],
                        inverse_stribeck[j],
                        viscous[j],
                    )
                    y[j] += half * (v[j] + ahead)
                    v[j] = ahead
            for j in range(m):
                d[j] *= phi[j]
