"""A machine in its position loop: cascade of position and velocity controller around `advance_sample`."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from plant.kernels.laws import END, FRICTION, LANES, MOTOR_POSITION, MOTOR_SPEED, SPEED, START
from plant.kernels.machine import advance_sample
from plant.kernels.shift import delayed
from plant.kernels.step import FASTMATH

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

(
    POSITION_GAIN,  # [1/s]
    VELOCITY_GAIN,  # [N s/m]
    INTEGRAL_RATE,  # 1/T_i, 0 for a P controller [1/s]
    FEED_VELOCITY,  # share of the reference velocity [1]
    FEED_MASS,  # times the reference acceleration [kg]
    FEED_FORCE,  # constant, e.g. the weight [N]
    FIRST_INTEGRAL,  # force of the integrator at the start [N]
    LIMIT,  # of the drive force [N]
    ENCODER,  # step of the measured position; 0 measures exactly [m]
    SMOOTHING,  # share of the new difference in the measured velocity [1]
    SETTINGS,
) = range(11)


@njit(cache=True, nogil=True, fastmath=FASTMATH, error_model="numpy")
def closed_loop(
    b: Floats,
    laws: Ints,
    structure: int,
    t: Floats,
    reference: Floats,
    settings: Floats,
    delay: float,
    substeps: int,
    observed: int,
    start: Floats,
    out: Floats,
) -> None:
    """March one machine (all lanes alike) through n ticks of its controller, which holds the force for a tick.

    The integrator stands still while the force is at its limit and the error would drive it further.

    Args:
        b: the block at the first tick; left at the last. (rows * LANES,)
        laws: as in `advance_sample`. (l, 4)
        structure: as in `advance_sample`.
        t: ticks since the start of the recording. [s] (n,)
        reference: rows position [m], velocity [m/s], acceleration [m/s²]. (3, n)
        settings: as named above. (SETTINGS,)
        delay: dead time from controller to motor. [s]
        substeps: per tick, >= 1.
        observed: offset of the measured position.
        start: filled with the force that the controller asks for. [N] (n,)
        out: filled with measured side's true position [m], velocity [m/s], friction force [N]. (3, n)
    """
    n = t.shape[0]
    speed = MOTOR_SPEED if observed == MOTOR_POSITION else SPEED
    step, limit = settings[ENCODER], settings[LIMIT]
    integral, seen, slope = settings[FIRST_INTEGRAL], b[observed], b[speed]
    for k in range(n):
        y, v = b[observed], b[speed]
        out[0, k], out[1, k], out[2, k] = y, v, b[FRICTION]
        if step > 0.0:
            before, seen = seen, np.round(y / step) * step
            if k > 0:
                slope += settings[SMOOTHING] * ((seen - before) / (t[k] - t[k - 1]) - slope)
        else:
            seen, slope = y, v
        wanted = settings[FEED_VELOCITY] * reference[1, k] + settings[POSITION_GAIN] * (reference[0, k] - seen)
        error = settings[VELOCITY_GAIN] * (wanted - slope)
        free = error + integral + settings[FEED_FORCE] + settings[FEED_MASS] * reference[2, k]
        force = min(max(free, -limit), limit)
        start[k] = force
        if k + 1 < n:
            tick = t[k + 1] - t[k]
            if free == force or (free > force) != (error > 0.0):
                integral += settings[INTEGRAL_RATE] * tick * error
            first, last = delayed(t, start, start, k, delay)
            for j in range(LANES):
                b[START + j], b[END + j] = first, last
            advance_sample(b, laws, structure, t[k], tick, substeps)
    if n > 1:
        out[2, 0] = out[2, 1]
