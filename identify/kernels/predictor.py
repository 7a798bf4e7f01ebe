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


WIDTH = 16  # candidates marched together: two vectors hide each other's latency, so sixteen cost what one does


@njit(cache=True, nogil=True, fastmath=FASTMATH, error_model="numpy")
def predict(
    force: Floats,
    after: Floats,
    position: Floats,
    steps: Floats,
    run: Ints,
    valid: Bools,
    substeps: int,
    law: Floats,
    start: Floats,
    gain: Floats,
    error: Floats,
) -> None:
    """Fill the one-step prediction errors of m candidates, a multiple of `WIDTH`, over n samples in one or more runs.

    Args:
        force: drive force at the belt, just after each sample. [N] (n,)
        after: the same just before the next sample; straight in between. [N] (n,)
        position: measured. [m] (n,)
        steps: time to the next sample; not used where the next sample begins another run. [s] (n,)
        run: index of the run a sample belongs to, ascending; the state restarts where it changes. (n,)
        valid: False where the position must not be used: the model runs on, its state is not corrected, and the
            error counts as 0. (n,)
        substeps: sub-steps per sample, >= 1.
        law: rows F_c, F_s - F_c, 1/v_s, F_v, m_e, M g + F_0. (6, m)
        start: rows y, v of run 0, y, v of run 1, ... at the runs' first samples. (2 runs, m)
        gain: rows L1 [1], L2 [1/s], L3 [1/s^2], phi [1] of the observer, and what they are of. (>= 4, m)
        error: measured minus predicted position. [m] (n, m)
    """
    n = force.shape[0]
    c = np.empty((13, WIDTH))  # law, gain, and y, v, d: one array, so that the compiler sees what cannot overlap
    for block in range(0, law.shape[1], WIDTH):
        for j in range(WIDTH):
            for r in range(6):
                c[r, j] = law[r, block + j]
            for r in range(4):
                c[6 + r, j] = gain[r, block + j]
        current = -1
        for k in range(n):
            if run[k] != current:
                current = run[k]
                for j in range(WIDTH):
                    c[10, j], c[11, j], c[12, j] = start[2 * current, block + j], start[2 * current + 1, block + j], 0.0
            measured = position[k]
            if valid[k]:
                for j in range(WIDTH):
                    e = measured - c[10, j]
                    error[k, block + j] = e
                    c[10, j] += c[6, j] * e
                    c[11, j] += c[7, j] * e
                    c[12, j] += c[8, j] * e
            else:
                for j in range(WIDTH):
                    error[k, block + j] = 0.0
            if k + 1 < n and run[k + 1] == current:
                h = steps[k] / substeps
                inverse_h = 1.0 / h
                slope = (after[k] - force[k]) / substeps
                for i in range(substeps):
                    middle = force[k] + (i + 0.5) * slope
                    for j in range(WIDTH):
                        v = c[11, j]
                        ahead, mean = advance_velocity(
                            v,
                            middle - c[5, j] + c[4, j] * c[12, j],
                            slope,
                            c[4, j] * inverse_h,
                            c[0, j],
                            c[1, j],
                            c[2, j],
                            c[3, j],
                        )
                        c[10, j] += h * mean
                        c[11, j] = ahead
                for j in range(WIDTH):
                    c[12, j] *= c[9, j]
