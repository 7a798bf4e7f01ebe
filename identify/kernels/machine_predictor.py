"""The one-step predictor of `predictor.py` for a machine with any subset of effects, `LANES` candidates at once."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from identify.kernels.transmission_gain import (
    ALIKE,
    ALIKE_LATENT,
    ALIKE_SPEED,
    DECAY,
    LATENT,
    LOAD,
    LOAD_SPEED,
    MOTOR,
    MOTOR_SPEED_GAIN,
)
from plant.kernels.exponential import exp_neg
from plant.kernels.laws import (
    AGAINST,
    BENT,
    BRISTLE,
    BRISTLE_STIFFNESS,
    BUMP,
    COULOMB,
    EXTRA,
    HALF_GAP,
    HANGS,
    INVERSE_STRIBECK,
    LANES,
    MASS,
    MOTOR_MASS,
    MOTOR_POSITION,
    MOTOR_SPEED,
    POSITION,
    SPEED,
    STIFFNESS,
    Rows,
    rows,
)
from plant.kernels.machine import HALF, TWO_MASSES, WITH_BRISTLES, advance_sample, load
from plant.kernels.step import FASTMATH

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


BEGINS = 1.5  # samples from its start, at most, the first run of a recording begins
SLIDES = 0.1  # of v_s: faster, the bristles are taken as fully bent


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def _settled(b: Floats, j: int, force: float) -> float:
    """Deflection of LuGre's bristles at the start of a run: bent by the sliding, or by the force they hold. [m]."""
    v = b[SPEED + j]
    level = b[COULOMB + j] + b[BUMP + j] * exp_neg(abs(v) * b[INVERSE_STRIBECK + j])
    held = force - b[AGAINST + j]
    if abs(v) * b[INVERSE_STRIBECK + j] > SLIDES:
        held = level if v > 0.0 else -level
    bent: float = min(max(held, -level), level) / b[BRISTLE_STIFFNESS + j]
    return bent


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def _correct_one(b: Rows, d: Rows, gain: Rows, error: Rows, lanes: int) -> None:
    """Correct position, velocity and the latent acceleration d by the error; the latent force acts until the next."""
    for j in range(lanes):
        e = error[j]
        latent = gain[DECAY * LANES + j] * d[j] + gain[LATENT * LANES + j] * e
        d[j] = latent
        b[POSITION + j] += gain[LOAD * LANES + j] * e
        b[SPEED + j] += gain[LOAD_SPEED * LANES + j] * e
        b[EXTRA + j] = b[MASS + j] * latent


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def _correct_two(b: Rows, d: Rows, gain: Rows, error: Rows, lanes: int) -> None:
    """The same of two masses: each by its own gains while they touch, both alike in a gap."""
    for j in range(lanes):
        e, gap = error[j], b[HALF_GAP + j]
        apart = gap > 0.0 and abs(b[MOTOR_POSITION + j] - b[POSITION + j]) <= gap
        alike, alike_speed = gain[ALIKE * LANES + j], gain[ALIKE_SPEED * LANES + j]
        load, load_speed = gain[LOAD * LANES + j], gain[LOAD_SPEED * LANES + j]
        motor, motor_speed = gain[MOTOR * LANES + j], gain[MOTOR_SPEED_GAIN * LANES + j]
        touching, parted = gain[LATENT * LANES + j], gain[ALIKE_LATENT * LANES + j]
        latent = gain[DECAY * LANES + j] * d[j] + (parted if apart else touching) * e
        d[j] = latent
        b[POSITION + j] += (alike if apart else load) * e
        b[SPEED + j] += (alike_speed if apart else load_speed) * e
        b[MOTOR_POSITION + j] += (alike if apart else motor) * e
        b[MOTOR_SPEED + j] += (alike_speed if apart else motor_speed) * e
        b[EXTRA + j] = (b[MASS + j] + b[MOTOR_MASS + j]) * latent


@njit(cache=True, nogil=True, fastmath=FASTMATH, error_model="numpy")
def predict_machine(
    block: Floats,
    laws: Ints,
    structure: int,
    drive: Floats,
    position: Floats,
    t: Floats,
    steps: Floats,
    run: Ints,
    valid: Bools,
    substeps: int,
    observed: int,
    start: Floats,
    gain: Floats,
    memory: Floats,
    goes_on: bool,
    scratch: Floats,
    error: Floats,
    first: int,
) -> None:
    """Fill the one-step prediction errors of `LANES` (or `HALF`, see `structure`) candidates over n samples in runs.

    Args:
        block: the machines, see `plant.kernels.laws`; its states as they are before a run. (rows * LANES,)
        laws: active laws. (l, 4)
        structure: as in `plant.kernels.machine.advance_sample`.
        drive: drive force of each sample as `plant.kernels.machine.load` takes it. [N] (n, 2 or 5, 1 or LANES)
        position: measured, by all candidates or by each its own. [m] (n, 1 or LANES)
        t: time since the start of the recording. [s] (n,)
        steps: time to the next sample; not used at the end of a run. [s] (n,)
        run: index of the run a sample belongs to, ascending. The one before leads to a run where the step between them
            is known. (n,)
        valid: False where the position must not be used: the error is 0 and corrects nothing. (n,)
        substeps: sub-steps per sample, >= 1.
        observed: row of the measured position, `POSITION` or `MOTOR_POSITION`.
        start: rows y, v of run 0, y, v of run 1, ... (2 runs, LANES)
        gain: of the observer: rows L1 [1], L2 [1/s], L3 [1/s^2], phi [1], or those of `transmission_gain` for two
            masses. (>= 4, LANES)
        memory: of each run that another leads to, what effects, bristles and a transmission remember by then. Without
            it a run begins as if nothing had been, its transmission bent by the drive force; the first of a recording,
            by its shares of drive force and weight. (runs or 0, rows * LANES)
        goes_on: whether a run that another leads to is only the rest of that one; `memory` is filled.
        scratch: room for a copy of the block, and the latent acceleration. (rows * LANES + LANES,)
        error: measured minus predicted position, those of these candidates in the columns from `first` on. [m]
            (n, >= first + LANES)
        first: see `error`.
    """
    n, size = position.shape[0], block.shape[0]
    own_force, own_position = drive.shape[2] == LANES, position.shape[1] == LANES
    two, bristles = (structure & TWO_MASSES) != 0, (structure & WITH_BRISTLES) != 0
    hidden = POSITION if observed == MOTOR_POSITION else MOTOR_POSITION
    observed_speed = MOTOR_SPEED if observed == MOTOR_POSITION else SPEED
    side = -1.0 if observed == MOTOR_POSITION else 1.0
    b = scratch[:size]
    d = scratch[size:]
    lanes, state, latent, gains = structure & (LANES | HALF), rows(b), rows(d), rows(gain)
    current = -1
    for k in range(n):
        if run[k] != current:
            current = run[k]
            leads, begins = k > 0 and steps[k - 1] > 0.0, t[k] < BEGINS * steps[k]
            if leads and goes_on:
                load(b, lanes, drive, k - 1)
                advance_sample(b, laws, structure, t[k - 1], steps[k - 1], substeps)
                memory[current] = b
            else:
                known = leads and len(memory) > 0
                b[:] = memory[current] if known else block
                for j in range(LANES):
                    y, v = start[2 * current, j], start[2 * current + 1, j]
                    carried = drive[k, 0, j if own_force else 0]
                    if two and known:
                        faster = v - b[observed_speed + j]
                        b[SPEED + j] += faster
                        b[MOTOR_SPEED + j] += faster
                        b[hidden + j] += y - b[observed + j]
                    else:
                        b[SPEED + j] = v
                        b[MOTOR_SPEED + j] = v
                        bends = b[BENT + j] * carried + b[HANGS + j] * b[AGAINST + j]
                        stretch = (bends if begins else carried) / b[STIFFNESS + j] if two else 0.0
                        stretch += b[HALF_GAP + j] if carried > 0.0 else -b[HALF_GAP + j]
                        b[hidden + j] = y + side * stretch
                    b[observed + j] = y
                    d[j] = 0.0
                    if bristles and not known:
                        b[BRISTLE + j] = _settled(b, j, carried)
        errors = rows(error[k, first:])
        if not valid[k]:
            for j in range(lanes):
                errors[j] = 0.0
        elif own_position:
            measured = rows(position[k])
            for j in range(lanes):
                errors[j] = measured[j] - state[observed + j]
        else:
            at = position[k, 0]
            for j in range(lanes):
                errors[j] = at - state[observed + j]
        if two:
            _correct_two(state, latent, gains, errors, lanes)
        else:
            _correct_one(state, latent, gains, errors, lanes)
        if k + 1 < n and run[k + 1] == current:
            load(b, lanes, drive, k)
            advance_sample(b, laws, structure, t[k], steps[k], substeps)
