"""Eq. (5) with any subset of effects, for `LANES` candidates at once: the one law of simulator and fitter.

The sub-step is that of `step.py`: position drifts by half a step, forces that depend on position or time are taken
there, the velocity is solved twice with set-valued friction, position drifts again. Two masses (spring, damper, free
travel) are eliminated to one equation for the load; LuGre's bristle is integrated exactly for frozen speed, so that
neither needs a smaller step for stability, only for accuracy. Row names: `laws.py`.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from plant.kernels.exponential import exp_neg, power
from plant.kernels.laws import (
    AFTER,
    AGAINST,
    AHEAD,
    BACKWARD,
    BRISTLE,
    BRISTLE_DAMPING,
    BRISTLE_POWER,
    BRISTLE_STIFFNESS,
    BUMP,
    CLIMB,
    COULOMB,
    DAMPING,
    DECAYS,
    DOWN,
    DRAG,
    DRIVE,
    END,
    END_2,
    EXTRA,
    FOLLOWS,
    FORCE,
    FORWARD,
    FRICTION,
    HALF_GAP,
    HARDENING,
    HELD,
    INVERSE_STRIBECK,
    LANES,
    LEVEL,
    MASS,
    MIDDLE,
    MOTOR_AHEAD,
    MOTOR_FORCE,
    MOTOR_MASS,
    MOTOR_MIDDLE,
    MOTOR_POSITION,
    MOTOR_SHARE,
    MOTOR_SPEED,
    PACE,
    POSITION,
    RESIST,
    RISE,
    SOFTER,
    SPEED,
    STAGE_FORCE,
    STAGE_LEVEL,
    START,
    START_2,
    STIFFNESS,
    SWITCH,
    TO_DRIVE,
    TO_STAGE,
    TO_STEP,
    TRANSMITTED,
    UP,
    VELOCITY,
    VISCOUS,
    VISCOUS_BACKWARD,
    VISCOUS_FORWARD,
    address,
    call,
    rows,
)
from plant.kernels.step import FASTMATH, turning

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

TWO_MASSES, WITH_BRISTLES, SWITCHED = 1, 2, 4  # bits of `structure`
HARDEST = 2.25  # contact rate times sub-step, squared
YIELDED = 0.01  # of what is left before bristles slide: a power of less is as if it were so much
SMALL = 0.02  # below it (1 - exp(-x))/x is taken from its series


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def _lay_out(b: Floats, fraction: float, half: float, two: bool) -> None:
    """Mid-step position and drive force, and neutral values where the laws will add."""
    for j in range(LANES):
        b[DRIVE + j] = b[START + j] + fraction * (b[END + j] - b[START + j])
        b[VELOCITY + j] = b[SPEED + j]
        b[AHEAD + j] = b[SPEED + j]
        b[MIDDLE + j] = b[POSITION + j] + half * b[SPEED + j]
        b[FORCE + j] = 0.0
        b[MOTOR_FORCE + j] = 0.0
        b[FORWARD + j] = 1.0
        b[BACKWARD + j] = 1.0
        b[CLIMB + j] = 0.0
        b[RISE + j] = 0.0
        b[LEVEL + j] = 0.0
        b[VISCOUS_FORWARD + j] = b[VISCOUS + j]
        b[VISCOUS_BACKWARD + j] = b[VISCOUS + j]
        b[DRAG + j] = 0.0
        b[STAGE_LEVEL + j] = 0.0
        b[STAGE_FORCE + j] = 0.0
    if two:
        for j in range(LANES):
            b[MOTOR_MIDDLE + j] = b[MOTOR_POSITION + j] + half * b[MOTOR_SPEED + j]
            b[MOTOR_AHEAD + j] = b[MOTOR_SPEED + j]
    else:
        for j in range(LANES):
            b[MOTOR_MIDDLE + j] = b[MIDDLE + j]


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def _switch(b: Floats, first: float, last: float) -> None:
    """Drive force where it switches within the sample: its mean from the fraction `first` to `last` of the sample."""
    length = last - first
    for j in range(LANES):
        part = min(max((b[SWITCH + j] - first) / length, 0.0), 1.0)
        before, after = first + 0.5 * length * part, last - 0.5 * length * (1.0 - part)
        force = b[START + j] + before * (b[END + j] - b[START + j])
        force_2 = b[START_2 + j] + after * (b[END_2 + j] - b[START_2 + j])
        b[DRIVE + j] = part * force + (1.0 - part) * force_2


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def load(b: Floats, drive: Floats, k: int) -> None:
    """Put the drive force of sample k into the block: `drive` as in `run`."""
    own = drive.shape[2] == LANES
    for j in range(LANES):
        column = j if own else 0
        b[START + j], b[END + j] = drive[k, 0, column], drive[k, 1, column]
        if drive.shape[1] == 5:
            b[SWITCH + j] = drive[k, 2, column]
            b[START_2 + j], b[END_2 + j] = drive[k, 3, column], drive[k, 4, column]


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def _dispatch(b: Floats, laws: Ints, phase: int, t: float, h: float) -> None:
    """Call the laws of one phase."""
    base = address(b)
    for i in range(laws.shape[0]):
        if laws[i, 0] == phase:
            call(laws[i, 1], t, h, base + 8 * laws[i, 2], base + 8 * laws[i, 3], base)


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def _carry(b: Floats, two: bool) -> None:
    """Estimate the force that the transmission carries: the drive force, or that of the spring between two masses."""
    if two:
        for j in range(LANES):
            stretch = b[MOTOR_MIDDLE + j] - b[MIDDLE + j]
            pressed = stretch - min(max(stretch, -b[HALF_GAP + j]), b[HALF_GAP + j])
            damping = b[DAMPING + j] if pressed != 0.0 else 0.0
            harder = 1.0 + b[HARDENING + j] * pressed * pressed
            b[TRANSMITTED + j] = harder * b[STIFFNESS + j] * pressed + damping * (b[MOTOR_SPEED + j] - b[SPEED + j])
    else:
        for j in range(LANES):
            b[TRANSMITTED + j] = b[DRIVE + j]


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def _estimate(b: Floats) -> None:
    """The velocity that the laws of a stage see, and room for what they add."""
    for j in range(LANES):
        b[VELOCITY + j] = 0.5 * (b[SPEED + j] + b[AHEAD + j])
        b[STAGE_LEVEL + j] = 0.0
        b[STAGE_FORCE + j] = 0.0


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def _resist(b: Floats) -> None:
    """Dry level each way and viscous coefficient at the estimated velocity; HELD acts whatever happens."""
    for j in range(LANES):
        velocity = 0.5 * (b[SPEED + j] + b[AHEAD + j])
        speed = abs(velocity)
        bump = b[BUMP + j] + b[RISE + j] - b[CLIMB + j]
        level = b[COULOMB + j] + b[CLIMB + j] + bump * exp_neg(speed * b[INVERSE_STRIBECK + j])
        added = b[LEVEL + j] + b[STAGE_LEVEL + j]
        up, down = b[VISCOUS_FORWARD + j], b[VISCOUS_BACKWARD + j]
        b[VELOCITY + j] = velocity
        b[UP + j] = max(level * b[FORWARD + j] + added, 0.0)
        b[DOWN + j] = max(level * b[BACKWARD + j] + added, 0.0)
        b[RESIST + j] = (up if velocity >= 0.0 else down) + b[DRAG + j] * speed
        b[HELD + j] = 0.0


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def _bristles(b: Floats, h: float) -> None:
    """Replace the set-valued friction by LuGre's: z' = v - lambda z, lambda = sigma_0 |v|/g, exact for frozen speed.

    The mean over the sub-step is linear in the mid-step velocity V: F = HELD + RESIST V. Bristles that yield with
    another power than LuGre's (Dahl 1968) do so, over the sub-step, at the pace of its beginning.
    """
    yields = 0
    for j in range(LANES):
        b[PACE + j] = 1.0
        yields += 0 if b[BRISTLE_POWER + j] == 0.0 else 1
    if yields:
        for j in range(LANES):
            velocity = b[VELOCITY + j]
            level = max(b[UP + j] if velocity >= 0.0 else b[DOWN + j], 1e-9)
            bent = b[BRISTLE_STIFFNESS + j] * b[BRISTLE + j] / level
            left = max(abs(1.0 - (bent if velocity >= 0.0 else -bent)), YIELDED)
            b[PACE + j] = power(left, b[BRISTLE_POWER + j])
    for j in range(LANES):
        velocity = b[VELOCITY + j]
        level = max(b[UP + j] if velocity >= 0.0 else b[DOWN + j], 1e-9)
        sigma0, sigma1, pace = b[BRISTLE_STIFFNESS + j], b[BRISTLE_DAMPING + j], b[PACE + j]
        rate = pace * sigma0 * abs(velocity) / level
        x = rate * h
        safe = max(x, SMALL)
        keeps = (1.0 - exp_neg(safe)) / safe
        keeps = keeps if x > SMALL else 1.0 - x * (0.5 - x * (1.0 / 6.0 - x * (1.0 / 24.0 - x / 120.0)))
        gains = (1.0 - keeps) / safe
        gains = gains if x > SMALL else 0.5 - x * (1.0 / 6.0 - x * (1.0 / 24.0 - x * (1.0 / 120.0 - x / 720.0)))
        b[FOLLOWS + j] = pace * h * keeps
        b[DECAYS + j] = x * keeps
        b[HELD + j] = (sigma0 - sigma1 * rate) * keeps * b[BRISTLE + j]
        b[RESIST + j] += pace * (sigma0 * gains * h + sigma1 * keeps)
        b[UP + j] = 0.0
        b[DOWN + j] = 0.0


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def _solve_one(b: Floats, inverse_h: float) -> None:
    """Velocity of a single mass at the end of the sub-step."""
    for j in range(LANES):
        v = b[SPEED + j]
        force = b[DRIVE + j] - b[AGAINST + j] - b[FORCE + j] - b[MOTOR_FORCE + j] - b[STAGE_FORCE + j] + b[EXTRA + j]
        half = 0.5 * b[RESIST + j]
        inertia = b[MASS + j] * inverse_h
        q = (inertia - half) * v + (force - b[HELD + j])
        dry = min(max(q, -b[DOWN + j]), b[UP + j])
        inverse = 1.0 / (inertia + half)
        ahead = (q - dry) * inverse
        b[AHEAD + j] = ahead
        b[VELOCITY + j] = 0.5 * (v + ahead)
        b[FRICTION + j] = dry + b[HELD + j] + half * (v + ahead)


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def _slide(b: Floats, inverse_h: float) -> int:
    """`_resist` and the velocity of a rigid machine, as if it came to rest nowhere; how many lanes do."""
    turns = 0
    for j in range(LANES):
        v = b[SPEED + j]
        seen = 0.5 * (v + b[AHEAD + j])
        speed = abs(seen)
        bump = b[BUMP + j] + b[RISE + j] - b[CLIMB + j]
        level = b[COULOMB + j] + b[CLIMB + j] + bump * exp_neg(speed * b[INVERSE_STRIBECK + j])
        added = b[LEVEL + j] + b[STAGE_LEVEL + j]
        forward, backward = b[VISCOUS_FORWARD + j], b[VISCOUS_BACKWARD + j]
        half = 0.5 * ((forward if seen >= 0.0 else backward) + b[DRAG + j] * speed)
        force = b[DRIVE + j] - b[AGAINST + j] - b[FORCE + j] - b[MOTOR_FORCE + j] - b[STAGE_FORCE + j] + b[EXTRA + j]
        inertia = b[MASS + j] * inverse_h
        up = max(level * b[FORWARD + j] + added, 0.0)
        down = max(level * b[BACKWARD + j] + added, 0.0)
        inverse = 1.0 / (inertia + half)
        slide = ((inertia - half) * v + force - (up if v > 0.0 else -down)) * inverse
        b[UP + j], b[DOWN + j], b[RESIST + j], b[HELD + j] = up, down, inverse, force
        b[AHEAD + j] = slide
        b[VELOCITY + j] = 0.5 * (v + slide)
        turns += 0 if v * slide > 0.0 else 1
    return turns


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def _turn(b: Floats) -> None:
    """The velocity where lanes come to rest on their way, or are at rest."""
    for j in range(LANES):
        force = b[HELD + j]
        restart = (force - min(max(force, -b[DOWN + j]), b[UP + j])) * b[RESIST + j]
        b[AHEAD + j], b[VELOCITY + j] = turning(b[SPEED + j], b[AHEAD + j], restart)


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def _soften(b: Floats, h: float, inverse_h: float) -> None:
    """Soften a contact that the sub-step cannot follow: else it throws the sides apart."""
    for j in range(LANES):
        closing = 0.5 * ((b[MOTOR_SPEED + j] + b[MOTOR_AHEAD + j]) - (b[SPEED + j] + b[AHEAD + j]))
        expected = b[MOTOR_POSITION + j] - b[POSITION + j] + 0.5 * h * closing
        pressed = abs(expected) - b[HALF_GAP + j]
        k = b[STIFFNESS + j] * (1.0 + b[HARDENING + j] * pressed * pressed)
        reduced = b[MOTOR_MASS + j] * b[MASS + j] / (b[MOTOR_MASS + j] + b[MASS + j])
        softer = min(HARDEST * reduced * inverse_h * inverse_h / k, 1.0)
        b[SOFTER + j] = math.sqrt(softer) if b[HALF_GAP + j] > 0.0 else 1.0


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def _solve_two(b: Floats, h: float, inverse_h: float, bristles: bool) -> None:
    """Velocities of load and motor: the motor is eliminated from the implicit midpoint rule of the pair."""
    gaps = 0
    for j in range(LANES):
        b[SOFTER + j] = 1.0
        gaps += 1 if b[HALF_GAP + j] > 0.0 else 0
    if gaps:
        _soften(b, h, inverse_h)
    for j in range(LANES):
        v, w = b[SPEED + j], b[MOTOR_SPEED + j]
        gap = b[HALF_GAP + j]
        stretch = b[MOTOR_POSITION + j] - b[POSITION + j]
        motor = 2.0 * b[MOTOR_MASS + j] * inverse_h
        load = b[MASS + j] * inverse_h
        closing = 0.5 * ((w + b[MOTOR_AHEAD + j]) - (v + b[AHEAD + j]))
        expected = stretch + 0.5 * h * closing
        side = 1.0 if expected >= 0.0 else -1.0
        pressed = side * expected - gap
        softer = b[SOFTER + j]
        k = softer * softer * b[STIFFNESS + j] * (1.0 + b[HARDENING + j] * pressed * pressed)
        d = softer * b[DAMPING + j]
        push = k * pressed + d * side * closing
        touches = 1.0 if pressed >= 0.0 and (gap == 0.0 or push >= 0.0) else 0.0  # a contact cannot pull
        stiffness, damping = touches * k, touches * d
        spring = stiffness * (stretch - side * gap)
        coupling = 0.5 * h * stiffness + damping
        up, down, rubs = b[UP + j], b[DOWN + j], 0.0 if bristles else b[MOTOR_SHARE + j]
        viscous = rubs * b[RESIST + j]
        slowed = 1.0 / (motor + coupling + viscous)
        on_motor = motor * w + b[DRIVE + j] - b[MOTOR_FORCE + j] - spring
        pushed = on_motor + 0.5 * coupling * (v + b[AHEAD + j])
        rubbed = min(max(pushed, -rubs * down), rubs * up)
        on_motor -= rubbed
        share = coupling * slowed
        on_load = spring + share * on_motor - b[AGAINST + j] - b[FORCE + j] - b[STAGE_FORCE + j] + b[EXTRA + j]
        half = 0.5 * (b[RESIST + j] - viscous)
        resist = half + 0.5 * share * (motor + viscous)
        q = (load - resist) * v + (on_load - b[HELD + j])
        up, down = (1.0 - rubs) * up, (1.0 - rubs) * down
        inverse = 1.0 / (load + resist)
        at_rest = on_load - b[HELD + j]
        slide = (q - (up if v > 0.0 else -down)) * inverse
        restart = (at_rest - min(max(at_rest, -down), up)) * inverse
        turned, mean = turning(v, slide, restart)
        ahead = slide if bristles else turned
        b[VELOCITY + j] = 0.5 * (v + ahead) if bristles else mean
        middle = (on_motor + 0.5 * coupling * (v + ahead)) * slowed
        b[AHEAD + j] = ahead
        b[MOTOR_AHEAD + j] = 0.0 if rubs > 0.0 and rubbed == pushed else 2.0 * middle - w
        dry = q - (load + resist) * ahead + rubbed
        b[FRICTION + j] = dry + b[HELD + j] + half * (v + ahead) + viscous * middle


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def _friction(b: Floats, inverse_h: float) -> None:
    """What friction of a rigid machine must have been."""
    for j in range(LANES):
        b[FRICTION + j] = b[HELD + j] - b[MASS + j] * inverse_h * (b[AHEAD + j] - b[SPEED + j])


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def _move(b: Floats, h: float, two: bool, bristles: bool) -> None:
    """Second half of the drift; speeds and bristles reach the end of the sub-step."""
    half = 0.5 * h
    for j in range(LANES):
        b[POSITION + j] += h * b[VELOCITY + j]
        b[SPEED + j] = b[AHEAD + j]
    if two:
        for j in range(LANES):
            b[MOTOR_POSITION + j] += half * (b[MOTOR_SPEED + j] + b[MOTOR_AHEAD + j])
            b[MOTOR_SPEED + j] = b[MOTOR_AHEAD + j]
    if bristles:
        for j in range(LANES):
            b[BRISTLE + j] += b[FOLLOWS + j] * b[VELOCITY + j] - b[DECAYS + j] * b[BRISTLE + j]


@njit(cache=True, nogil=True, fastmath=FASTMATH, error_model="numpy")
def advance_sample(b: Floats, laws: Ints, structure: int, t: float, h: float, substeps: int) -> None:
    """Advance a block of `LANES` machines by one sample; the caller may change states and `EXTRA` between samples.

    Args:
        b: the block: rows as named in `laws.py`, then the effects' states and parameters. (rows * LANES,)
        laws: phase, address, first parameter, first state (offsets into `b`) of each law. (l, 4)
        structure: sum of `TWO_MASSES`, `WITH_BRISTLES`, `SWITCHED` (the force jumps within samples).
        t: time since the start of the recording. [s]
        h: time to the next sample. [s]
        substeps: >= 1.
    """
    two, bristles, many = (structure & TWO_MASSES) != 0, (structure & WITH_BRISTLES) != 0, laws.shape[0] > 0
    block = rows(b)
    staged, ages = False, False
    for i in range(laws.shape[0]):
        staged |= laws[i, 0] == TO_STAGE
        ages |= laws[i, 0] == AFTER
    step = h / substeps
    inverse = 1.0 / step
    for i in range(substeps):
        middle = t + (i + 0.5) * step
        _lay_out(block, (i + 0.5) / substeps, 0.5 * step, two)
        if structure & SWITCHED:
            _switch(block, i / substeps, (i + 1) / substeps)
        if many:
            _dispatch(block, laws, TO_DRIVE, middle, step)
            _carry(block, two)
            _dispatch(block, laws, TO_STEP, middle, step)
        for _stage in range(2):
            if staged:
                _estimate(block)
                _dispatch(block, laws, TO_STAGE, middle, step)
            if not (two or bristles):
                if _slide(block, inverse):
                    _turn(block)
            else:
                _resist(block)
                if bristles:
                    _bristles(block, step)
                if two:
                    _solve_two(block, step, inverse, bristles)
                else:
                    _solve_one(block, inverse)
        if (ages or i + 1 == substeps) and not (two or bristles):
            _friction(block, inverse)
        _move(block, step, two, bristles)
        if ages:
            _dispatch(block, laws, AFTER, middle, step)


@njit(cache=True, nogil=True, fastmath=FASTMATH, error_model="numpy")
def run(
    b: Floats,
    laws: Ints,
    structure: int,
    t: Floats,
    drive: Floats,
    substeps: int,
    observed: int,
    out: Floats,
) -> None:
    """Advance one block over n samples.

    Args:
        b: the block at the first sample; left at the last. (rows * LANES,)
        laws: as in `advance_sample`. (l, 4)
        structure: as in `advance_sample`.
        t: time stamps since the start of the recording. [s] (n,)
        drive: drive force [N] just after each sample and just before the next; where a dead time makes it switch
            also `SWITCH`, `START_2`, `END_2`; a column for all lanes or one each. (n - 1, 2 or 5, 1 or LANES)
        substeps: per sample, >= 1.
        observed: offset of the measured position, `POSITION` or `MOTOR_POSITION`.
        out: observed position [m], its velocity [m/s], friction force [N] at each sample. (n, 3, LANES)
    """
    speed = SPEED if observed == POSITION else MOTOR_SPEED
    for k in range(t.shape[0]):
        for j in range(LANES):
            out[k, 0, j], out[k, 1, j], out[k, 2, j] = b[observed + j], b[speed + j], b[FRICTION + j]
        if k + 1 < t.shape[0]:
            load(b, drive, k)
            advance_sample(b, laws, structure, t[k], t[k + 1] - t[k], substeps)
    if t.shape[0] > 1:
        for j in range(LANES):
            out[0, 2, j] = out[1, 2, j]
