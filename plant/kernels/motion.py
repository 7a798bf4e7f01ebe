"""A machine in its position loop: cascade of position and velocity controller around `advance_sample`."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from plant.kernels.laws import (
    AGAINST,
    BUMP,
    COULOMB,
    END,
    END_2,
    FRICTION,
    INVERSE_STRIBECK,
    LANES,
    MASS,
    MOTOR_POSITION,
    MOTOR_SPEED,
    POSITION,
    SPEED,
    START,
    START_2,
    SWITCH,
    VISCOUS,
)
from plant.kernels.machine import HALF, advance_sample
from plant.kernels.shift import delayed_pieces
from plant.kernels.step import FASTMATH, advance_velocity

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


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def _advance_rigid(b: Floats, drive: float, h: float, substeps: int) -> None:
    """`advance_sample` for the first lane alone, of one mass without laws under a held force: a fifth of the time."""
    step = h / substeps
    inertia, force, v = b[MASS] / step, drive - b[AGAINST], b[SPEED]
    for _ in range(substeps):
        ahead, mean = advance_velocity(v, force, 0.0, inertia, b[COULOMB], b[BUMP], b[INVERSE_STRIBECK], b[VISCOUS])
        b[FRICTION] = force - inertia * (ahead - v)
        b[POSITION] += step * mean
        v = ahead
    b[SPEED] = v


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
        b: the block at the first tick; its first lane is left at the last. (rows * LANES,)
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
    rigid = laws.shape[0] == 0 and structure == LANES and delay <= 0.0
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
            if rigid:
                _advance_rigid(b, force, tick, substeps)
            else:
                first, last, switch, first_2, last_2 = delayed_pieces(t, start, start, k, delay)
                for j in range(LANES):
                    b[START + j], b[END + j] = first, last
                    b[SWITCH + j], b[START_2 + j], b[END_2 + j] = switch, first_2, last_2
                advance_sample(b, laws, structure - HALF, t[k], tick, substeps)
    if n > 1:
        out[2, 0] = out[2, 1]
