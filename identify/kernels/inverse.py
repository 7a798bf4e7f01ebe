"""The inverse model, sample by sample: the force a machine with effects would have needed for a measured motion."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from plant.kernels.laws import EXTRA, LANES, MASS, MOTOR_MASS, MOTOR_POSITION, MOTOR_SPEED, POSITION, SPEED
from plant.kernels.machine import HALF, TWO_MASSES, advance_sample, load
from plant.kernels.step import FASTMATH

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@njit(cache=True, nogil=True, fastmath=FASTMATH, error_model="numpy")
def unexplained_force(
    block: Floats,
    laws: Ints,
    structure: int,
    drive: Floats,
    position: Floats,
    velocity: Floats,
    t: Floats,
    steps: Floats,
    run: Ints,
    substeps: int,
    out: Floats,
) -> None:
    """Force that the model lacks between each sample and the next, of the machine in lane 0.

    The machine is put on the measured motion at every sample, keeps its inner states (bristles, lags, contact ages),
    and is advanced to the next sample; the velocity it misses there, times its mass over the step, is the force. A
    machine that rests, and would rest, lacks nothing.

    Args:
        block: the machine, see `plant.kernels.laws`.
        laws: active laws.
        structure: as in `plant.kernels.machine.advance_sample`.
        drive: drive force of each sample as `plant.kernels.machine.load` takes it. [N] (n, 2 or 5, 1 or LANES)
        position: measured, smooth. [m] (n,)
        velocity: its derivative. [m/s] (n,)
        t: time. [s] (n,)
        steps: time to the next sample. [s] (n,)
        run: index of the run. (n,)
        substeps: per sample.
        out: filled; 0 at the end of a run. [N] (n,)
    """
    b = block.copy()
    two = (structure & TWO_MASSES) != 0
    mass = block[MASS] + (block[MOTOR_MASS] if two else 0.0)
    current = -1
    for k in range(position.shape[0]):
        out[k] = 0.0
        if run[k] != current:
            current = run[k]
            b[:] = block
        if k + 1 == position.shape[0] or run[k + 1] != current:
            continue
        for j in range(LANES):
            b[MOTOR_POSITION + j] += position[k] - b[POSITION + j]
            b[MOTOR_SPEED + j] += velocity[k] - b[SPEED + j]
            b[POSITION + j], b[SPEED + j] = position[k], velocity[k]
            b[EXTRA + j] = 0.0
        load(b, HALF, drive, k)
        advance_sample(b, laws, structure - HALF, t[k], steps[k], substeps)
        out[k] = mass * (velocity[k + 1] - b[SPEED]) / steps[k]
