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

from plant.kernels.exponential import exp_neg, ln, power
from plant.kernels.laws import (
    AFTER,
    AGAINST,
    AHEAD,
    BACKWARD,
    BEFORE,
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
    EXPONENT,
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
    RAMP,
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
from plant.kernels.step import FASTMATH, sagging, turning

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Bits of `structure`. Two more say how many lanes are of interest, `LANES` or `HALF`: where few candidates are left,
# the rest of the block stands still. The compiler, which unrolls short loops of known length before it vectorises,
# does not know it.
TWO_MASSES, WITH_BRISTLES, SWITCHED, WITH_GAPS, YIELDING, BENT_CURVE = 1, 2, 4, 32, 64, 128
HALF = LANES // 2
HARDEST = 2.25  # contact rate times sub-step, squared
YIELDED = 0.01  # of what is left before bristles slide: a power of less is as if it were so much
SLOWEST = 1e-9  # of v_s: below it every curve of friction is at its top
FASTEST = 6.5  # logarithm of the largest argument of the exponential in it
SMALL = 0.02  # below it (1 - exp(-x))/x is taken from its series


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def _lay_out(b: Floats, lanes: int, fraction: float, share: float, half: float) -> None:
    """Mid-step position and drive force of a rigid machine, and neutral values where the laws will add."""
    for j in range(lanes):
        speed, viscous = b[SPEED + j], b[VISCOUS + j]
        middle = b[POSITION + j] + half * speed
        grows = b[END + j] - b[START + j]
        b[DRIVE + j] = b[START + j] + fraction * grows
        b[RAMP + j] = share * grows
        b[VELOCITY + j] = speed
        b[MIDDLE + j] = middle
        b[MOTOR_MIDDLE + j] = middle
        b[FORCE + j] = 0.0
        b[MOTOR_FORCE + j] = 0.0
        b[FORWARD + j] = 1.0
        b[BACKWARD + j] = 1.0
        b[CLIMB + j] = 0.0
        b[RISE + j] = 0.0
        b[LEVEL + j] = 0.0
        b[VISCOUS_FORWARD + j] = viscous
        b[VISCOUS_BACKWARD + j] = viscous
        b[DRAG + j] = 0.0
        b[STAGE_LEVEL + j] = 0.0
        b[STAGE_FORCE + j] = 0.0


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def _lay_out_inside(b: Floats, lanes: int, half: float, two: bool) -> None:
    """Where the motor of two masses is at mid-step, the first guess of where the speeds lead, and friction so far."""
    for j in range(lanes):
        b[BEFORE + j] = b[FRICTION + j]
        motor = b[MOTOR_POSITION + j] + half * b[MOTOR_SPEED + j]
        b[MOTOR_MIDDLE + j] = motor if two else b[MIDDLE + j]
        b[AHEAD + j] = b[SPEED + j]
        b[MOTOR_AHEAD + j] = b[MOTOR_SPEED + j]


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def _switch(b: Floats, lanes: int, first: float, last: float) -> None:
    """Drive force where it switches within the sample: its mean from the fraction `first` to `last` of the sample."""
    length = last - first
    for j in range(lanes):
        part = min(max((b[SWITCH + j] - first) / length, 0.0), 1.0)
        rest = 1.0 - part
        before, after = first + 0.5 * length * part, last - 0.5 * length * rest
        grows, grows_2 = b[END + j] - b[START + j], b[END_2 + j] - b[START_2 + j]
        force, force_2 = b[START + j] + before * grows, b[START_2 + j] + after * grows_2
        b[DRIVE + j] = part * force + rest * force_2
        b[RAMP + j] = 6.0 * part * rest * (force_2 - force) + length * (part**3 * grows + rest**3 * grows_2)


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def load(block: Floats, lanes: int, drive: Floats, k: int) -> None:
    """Put the drive force of sample k into so many lanes of the block: `drive` as in `run`."""
    b = rows(block)
    if drive.shape[2] != LANES:
        start, end = drive[k, 0, 0], drive[k, 1, 0]
        for j in range(lanes):
            b[START + j] = start
            b[END + j] = end
        return
    of = rows(drive[k, 0])  # the next rows follow
    for j in range(lanes):
        b[START + j] = of[j]
        b[END + j] = of[LANES + j]
    if drive.shape[1] == 5:
        for j in range(lanes):
            b[SWITCH + j] = of[2 * LANES + j]
            b[START_2 + j] = of[3 * LANES + j]
            b[END_2 + j] = of[4 * LANES + j]


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def _dispatch(b: Floats, laws: Ints, phase: int, t: float, h: float) -> None:
    """Call the laws of one phase."""
    base = address(b)
    for i in range(laws.shape[0]):
        if laws[i, 0] == phase:
            call(laws[i, 1], t, h, base + 8 * laws[i, 2], base + 8 * laws[i, 3], base)


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def _carry(b: Floats, lanes: int, two: bool) -> None:
    """Estimate the force that the transmission carries: the drive force, or that of the spring between two masses."""
    if two:
        for j in range(lanes):
            stretch = b[MOTOR_MIDDLE + j] - b[MIDDLE + j]
            pressed = stretch - min(max(stretch, -b[HALF_GAP + j]), b[HALF_GAP + j])
            damping = b[DAMPING + j] if pressed != 0.0 else 0.0
            harder = 1.0 + b[HARDENING + j] * pressed * pressed
            b[TRANSMITTED + j] = harder * b[STIFFNESS + j] * pressed + damping * (b[MOTOR_SPEED + j] - b[SPEED + j])
    else:
        for j in range(lanes):
            b[TRANSMITTED + j] = b[DRIVE + j]


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def _estimate(b: Floats, lanes: int) -> None:
    """The velocity that the laws of a stage see, and room for what they add."""
    for j in range(lanes):
        b[VELOCITY + j] = 0.5 * (b[SPEED + j] + b[AHEAD + j])
        b[STAGE_LEVEL + j] = 0.0
        b[STAGE_FORCE + j] = 0.0


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def _levels(b: Floats, j: int, velocity: float, bent: bool) -> tuple[float, float, float]:
    """Dry level up and down and viscous coefficient at a velocity."""
    speed = abs(velocity)
    fall = speed * b[INVERSE_STRIBECK + j]
    if bent:
        fall = exp_neg(-min(b[EXPONENT + j] * ln(max(fall, SLOWEST)), FASTEST))
    climb, added = b[CLIMB + j], b[LEVEL + j] + b[STAGE_LEVEL + j]
    bump = b[BUMP + j] + b[RISE + j] - climb
    level = b[COULOMB + j] + climb + bump * exp_neg(fall)
    forward, backward = b[VISCOUS_FORWARD + j], b[VISCOUS_BACKWARD + j]
    up, down = max(level * b[FORWARD + j] + added, 0.0), max(level * b[BACKWARD + j] + added, 0.0)
    return up, down, (forward if velocity >= 0.0 else backward) + b[DRAG + j] * speed


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def _resist(b: Floats, lanes: int, bent: bool) -> None:
    """Dry level each way and viscous coefficient at the estimated velocity; HELD acts whatever happens."""
    for j in range(lanes):
        velocity = 0.5 * (b[SPEED + j] + b[AHEAD + j])
        up, down, viscous = _levels(b, j, velocity, bent)
        b[VELOCITY + j] = velocity
        b[UP + j] = up
        b[DOWN + j] = down
        b[RESIST + j] = viscous
        b[HELD + j] = 0.0


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def _bristles(b: Floats, lanes: int, h: float, yields: bool) -> None:
    """Replace the set-valued friction by LuGre's: z' = v - lambda z, lambda = sigma_0 |v|/g, exact for frozen speed.

    The mean over the sub-step is linear in the mid-step velocity V: F = HELD + RESIST V. Bristles that yield with
    another power than LuGre's (Dahl 1968) do so, over the sub-step, at the pace of its beginning.
    """
    if yields:
        for j in range(lanes):
            velocity, up, down = b[VELOCITY + j], b[UP + j], b[DOWN + j]
            bent = b[BRISTLE_STIFFNESS + j] * b[BRISTLE + j] / max(up if velocity >= 0.0 else down, 1e-9)
            left = max(abs(1.0 - (bent if velocity >= 0.0 else -bent)), YIELDED)
            b[PACE + j] = power(left, b[BRISTLE_POWER + j])
    for j in range(lanes):
        velocity, up, down = b[VELOCITY + j], b[UP + j], b[DOWN + j]
        level = max(up if velocity >= 0.0 else down, 1e-9)
        sigma0, sigma1, pace = b[BRISTLE_STIFFNESS + j], b[BRISTLE_DAMPING + j], b[PACE + j] if yields else 1.0
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
def _pushed(b: Floats, j: int) -> float:
    """Force on a rigid machine but for friction. [N]."""
    force: float = b[DRIVE + j] - b[AGAINST + j] - b[FORCE + j] - b[MOTOR_FORCE + j] - b[STAGE_FORCE + j] + b[EXTRA + j]
    return force


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def _solve_one(b: Floats, lanes: int, inverse_h: float) -> None:
    """Velocity of a single mass at the end of the sub-step."""
    for j in range(lanes):
        v = b[SPEED + j]
        half = 0.5 * b[RESIST + j]
        inertia = b[MASS + j] * inverse_h
        q = (inertia - half) * v + (_pushed(b, j) - b[HELD + j])
        dry = min(max(q, -b[DOWN + j]), b[UP + j])
        inverse = 1.0 / (inertia + half)
        ahead = (q - dry) * inverse
        b[AHEAD + j] = ahead
        b[VELOCITY + j] = 0.5 * (v + ahead)
        b[FRICTION + j] = dry + b[HELD + j] + half * (v + ahead)


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def _begin_rigid(b: Floats, lanes: int, inverse_h: float, bent: bool) -> None:
    """First stage of `step.advance_velocity` for a rigid machine, and the velocity that the laws of the second see.

    BEFORE is the friction that the sub-step begins with.
    """
    for j in range(lanes):
        v, force, inertia = b[SPEED + j], _pushed(b, j), b[MASS + j] * inverse_h
        up, down, viscous = _levels(b, j, v, bent)
        half = 0.5 * viscous
        q = (inertia - half) * v + force
        ahead = (q - min(max(q, -down), up)) * (1.0 / (inertia + half))
        b[BEFORE + j] = (up if v > 0.0 else -down) + viscous * v
        b[AHEAD + j] = ahead
        b[VELOCITY + j] = 0.5 * (v + ahead)
        b[STAGE_LEVEL + j] = 0.0
        b[STAGE_FORCE + j] = 0.0


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def _end_rigid(b: Floats, lanes: int, h: float, inverse_h: float, bent: bool) -> None:
    """The second stage, and all that `_move` does."""
    for j in range(lanes):
        v, force, inertia = b[SPEED + j], _pushed(b, j), b[MASS + j] * inverse_h
        up, down, viscous = _levels(b, j, 0.5 * (v + b[AHEAD + j]), bent)
        half = 0.5 * viscous
        inverse = 1.0 / (inertia + half)
        dry = up if v > 0.0 else -down
        slide = ((inertia - half) * v + force - dry) * inverse
        steeper = 2.0 * (dry + half * (v + slide) - b[BEFORE + j])
        sag = sagging(b[RAMP + j], steeper, inertia)
        ahead, mean = turning(v, slide, (force - min(max(force, -down), up)) * inverse, sag)
        b[VELOCITY + j] = mean
        b[FRICTION + j] = force - inertia * (ahead - v)
        b[POSITION + j] += h * mean
        b[SPEED + j] = ahead


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def _soften(b: Floats, lanes: int, h: float, inverse_h: float) -> None:
    """Soften a contact that the sub-step cannot follow: else it throws the sides apart."""
    for j in range(lanes):
        closing = 0.5 * ((b[MOTOR_SPEED + j] + b[MOTOR_AHEAD + j]) - (b[SPEED + j] + b[AHEAD + j]))
        expected = b[MOTOR_POSITION + j] - b[POSITION + j] + 0.5 * h * closing
        pressed = abs(expected) - b[HALF_GAP + j]
        k = b[STIFFNESS + j] * (1.0 + b[HARDENING + j] * pressed * pressed)
        reduced = b[MOTOR_MASS + j] * b[MASS + j] / (b[MOTOR_MASS + j] + b[MASS + j])
        softer = min(HARDEST * reduced * inverse_h * inverse_h / k, 1.0)
        b[SOFTER + j] = math.sqrt(softer) if b[HALF_GAP + j] > 0.0 else 1.0


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def _solve_two(b: Floats, lanes: int, h: float, inverse_h: float, bristles: bool, gaps: bool) -> None:
    """Velocities of load and motor: the motor is eliminated from the implicit midpoint rule of the pair."""
    if gaps:
        _soften(b, lanes, h, inverse_h)
    for j in range(lanes):
        v, w = b[SPEED + j], b[MOTOR_SPEED + j]
        gap = b[HALF_GAP + j]
        stretch = b[MOTOR_POSITION + j] - b[POSITION + j]
        motor = 2.0 * b[MOTOR_MASS + j] * inverse_h
        load = b[MASS + j] * inverse_h
        closing = 0.5 * ((w + b[MOTOR_AHEAD + j]) - (v + b[AHEAD + j]))
        expected = stretch + 0.5 * h * closing
        side = 1.0 if expected >= 0.0 else -1.0
        pressed = side * expected - gap
        softer = b[SOFTER + j] if gaps else 1.0
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
        turned, mean = turning(v, slide, restart, 0.0)
        ahead = slide if bristles else turned
        b[VELOCITY + j] = 0.5 * (v + ahead) if bristles else mean
        middle = (on_motor + 0.5 * coupling * (v + ahead)) * slowed
        b[AHEAD + j] = ahead
        b[MOTOR_AHEAD + j] = 0.0 if rubs > 0.0 and rubbed == pushed else 2.0 * middle - w
        dry = q - (load + resist) * ahead + rubbed
        b[FRICTION + j] = dry + b[HELD + j] + half * (v + ahead) + viscous * middle


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def _move(b: Floats, lanes: int, h: float) -> None:
    """Second half of the drift; speeds and bristles reach the end of the sub-step.

    While they slide, masses that touch have their common velocity bent as that of one mass is (`step.sagging`); how
    friction grows is told by its mean over the sub-step before.
    """
    half = 0.5 * h
    for j in range(lanes):
        velocity, ahead, ahead_2 = b[VELOCITY + j], b[AHEAD + j], b[MOTOR_AHEAD + j]
        steady = b[SPEED + j] * ahead > 0.0 and b[BEFORE + j] * b[FRICTION + j] > 0.0
        apart = b[HALF_GAP + j] > 0.0 and abs(b[MOTOR_POSITION + j] - b[POSITION + j]) <= b[HALF_GAP + j]
        inertia = (b[MASS + j] + b[MOTOR_MASS + j]) / h
        sag = sagging(b[RAMP + j], b[FRICTION + j] - b[BEFORE + j], inertia) if steady and not apart else 0.0
        b[POSITION + j] += h * (velocity - sag)
        b[MOTOR_POSITION + j] += half * (b[MOTOR_SPEED + j] + ahead_2) - h * sag
        b[BRISTLE + j] += b[FOLLOWS + j] * velocity - b[DECAYS + j] * b[BRISTLE + j]
        b[SPEED + j] = ahead
        b[MOTOR_SPEED + j] = ahead_2


@njit(cache=True, nogil=True, fastmath=FASTMATH, error_model="numpy")
def advance_sample(b: Floats, laws: Ints, structure: int, t: float, h: float, substeps: int) -> None:
    """Advance a block of `LANES` machines by one sample; the caller may change states and `EXTRA` between samples.

    Args:
        b: the block: rows as named in `laws.py`, then the effects' states and parameters. (rows * LANES,)
        laws: phase, address, first parameter, first state (offsets into `b`) of each law. (l, 4)
        structure: sum of `TWO_MASSES`, `WITH_BRISTLES`, `SWITCHED` (the force jumps within samples), `WITH_GAPS`,
            `YIELDING` (bristles with a power of their own), `BENT_CURVE` (another exponent than 1 in eq. (1)), and
            `LANES` or `HALF`.
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
    lanes, gaps, yields = structure & (LANES | HALF), (structure & WITH_GAPS) != 0, (structure & YIELDING) != 0
    bent = (structure & BENT_CURVE) != 0  # told as a constant below: else the plain curve's loops take a third longer
    step = h / substeps
    inverse = 1.0 / step
    for i in range(substeps):
        middle = t + (i + 0.5) * step
        _lay_out(block, lanes, (i + 0.5) / substeps, 1.0 / substeps, 0.5 * step)
        if two or bristles:
            _lay_out_inside(block, lanes, 0.5 * step, two)
        if structure & SWITCHED:
            _switch(block, lanes, i / substeps, (i + 1) / substeps)
        if many:
            _dispatch(block, laws, TO_DRIVE, middle, step)
            _carry(block, lanes, two)
            _dispatch(block, laws, TO_STEP, middle, step)
        if not (two or bristles):
            if staged:
                _dispatch(block, laws, TO_STAGE, middle, step)
            if bent:
                _begin_rigid(block, lanes, inverse, True)
            else:
                _begin_rigid(block, lanes, inverse, False)
            if staged:
                _dispatch(block, laws, TO_STAGE, middle, step)
            if bent:
                _end_rigid(block, lanes, step, inverse, True)
            else:
                _end_rigid(block, lanes, step, inverse, False)
        else:
            for _stage in range(2):
                if staged:
                    _estimate(block, lanes)
                    _dispatch(block, laws, TO_STAGE, middle, step)
                if bent:
                    _resist(block, lanes, True)
                else:
                    _resist(block, lanes, False)
                if bristles:
                    _bristles(block, lanes, step, yields)
                if two:
                    _solve_two(block, lanes, step, inverse, bristles, gaps)
                else:
                    _solve_one(block, lanes, inverse)
            _move(block, lanes, step)
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
            load(b, structure & (LANES | HALF), drive, k)
            advance_sample(b, laws, structure, t[k], t[k + 1] - t[k], substeps)
    if t.shape[0] > 1:
        for j in range(LANES):
            out[0, 2, j] = out[1, 2, j]
