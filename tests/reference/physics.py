"""The equations, compiled: drive chain, forces on the load, dry friction level, rates of every state.

States x: 0 y load position, 1 v load speed, 2 motor position, 3 motor speed, 4 bristle, 5, 6 drive force behind the
lag, 7 remembered sliding speed (frictional lag), 8 cable state, 9 extra stiction after a rest, 10 work done by the
drive, 11 work lost to friction. Mode s: +1 slides up, -1 slides down, 0 rests (bristle friction knows no modes).
Inputs w, linear in time from t0: (t0, command, slope, outer force, slope, extra dry level, slope, factor, slope).
"""

import math

import numpy as np
from numba import njit

Y, V, YM, VM, BRISTLE, LAG1, LAG2, MEMORY, CABLE, DWELL, DRIVE_WORK, LOSS = range(12)
STATES, INPUTS = 12, 9
FAST = {"error_model": "numpy"}  # cached as part of integrator.march alone


@njit(**FAST)
def clip_force(p, force):
    """Current limit of the drive: hard, or with a rounded shoulder."""
    if p.limit_knee > 0.0 and p.limit < 1e300:
        sharp = 0.5 / p.limit_knee
        return force / (1.0 + abs(force / p.limit) ** sharp) ** (1.0 / sharp)
    return min(max(force, -p.limit), p.limit)


@njit(**FAST)
def drive_force(p, t, x, w):
    """(force of the motor at the belt after limit, lag, torque constant, pulley radius; ripple to subtract from it)."""
    if p.lag > 0.0:  # noqa: SIM108 (reads better than nested ternaries)
        force = x[LAG2] if p.lag_order > 1.5 else x[LAG1]
    else:
        force = clip_force(p, w[1] + w[2] * (t - w[0]))
    force *= 1.0 + p.scale
    angle = x[YM]
    if p.ripple_relative != 0.0 or p.ripple != 0.0:
        turn = p.ripple_wave * angle + p.ripple_phase
        wave = math.cos(turn)
        if p.ripple_second > 0.0:
            wave += p.ripple_second * math.cos(2.0 * turn + 1.0)
        ripple = (p.ripple + p.ripple_relative * force) * wave
    else:
        ripple = 0.0
    if p.eccentricity != 0.0:
        force /= 1.0 + p.eccentricity * math.cos(p.eccentricity_wave * angle + p.eccentricity_phase)
    return force, ripple


@njit(**FAST)
def belt_force(p, x):
    """Force of belt or contact on the load; a contact pushes and cannot pull."""
    stretch, rate = x[YM] - x[Y], x[VM] - x[V]
    if p.gap <= 0.0:
        return p.belt * stretch + p.belt_damping * rate
    half = 0.5 * p.gap
    if stretch > half:
        return max(0.0, p.belt * (stretch - half) + p.belt_damping * rate)
    if stretch < -half:
        return min(0.0, p.belt * (stretch + half) + p.belt_damping * rate)
    return 0.0


@njit(**FAST)
def bump_at(p, y):
    """Height of the damaged place of the rail, added to the dry level; all shapes are equally wide at half height."""
    u = (y - p.bump_centre) / p.bump_width
    if p.bump_shape == 1.0:
        return p.bump * 0.5 * (1.0 + math.cos(math.pi * u / 2.3548)) if abs(u) < 2.3548 else 0.0
    if p.bump_shape == 2.0:
        return p.bump / (1.0 + (u / 1.1774) ** 8)
    return p.bump * math.exp(-0.5 * u * u) if abs(u) < 12.0 else 0.0


@njit(**FAST)
def dry_level(p, t, x, s, speed, carried, w):
    """Dry friction in direction s at `speed` >= 0 [N], never negative; at speed 0 it is what holds."""
    step = 0.0
    if p.step != 0.0:  # set to 0 before its instant by the march
        step = p.step if p.step_ramp <= 0.0 else p.step * min(1.0, (t - p.step_time) / p.step_ramp)
    coulomb = p.coulomb + step
    coulomb += p.dwell_level * x[DWELL]  # worn off by slip alone, whatever the speed
    static = p.static + p.step_both * step + x[DWELL]
    past = speed / p.stribeck
    level = coulomb + (static - coulomb) * math.exp(-(past if p.exponent == 1.0 else max(past, 0.0) ** p.exponent))
    if p.level_slope != 0.0:
        u = p.level_slope * (x[Y] - p.level_middle)
        level *= max(0.0, 1.0 + (0.5 * math.tanh(2.0 * u) if p.level_shape > 0.0 else u))
    level *= 1.0 + p.dry_asymmetry * s
    if p.level_ripple != 0.0:
        level *= 1.0 + p.level_ripple * math.cos(p.level_ripple_wave * x[Y])
    if s > 0.0:
        level += p.one_way * (1.0 - math.exp(-speed / p.stribeck))
    if p.load_friction != 0.0:
        knee = p.load_friction_knee * p.coulomb
        level += p.load_friction * (math.sqrt(carried * carried + knee * knee) - knee)
    if p.bump != 0.0:
        level += bump_at(p, x[Y])
    dt = t - w[0]
    level = level * (1.0 + w[7] + w[8] * dt) + w[5] + w[6] * dt
    return max(level, 0.0)


@njit(**FAST)
def viscous_force(p, t, v, s):
    """Friction that grows with speed and is 0 at rest: smooth parts of the law."""
    coefficient = p.viscous
    if p.drop != 0.0:
        u = t / p.drop_time
        if p.drop_shape == 1.0:
            fall = 1.0 / (1.0 + u)
        elif p.drop_shape == 2.0:
            fall = 0.5 * math.exp(-2.0 * u) + 0.5 * math.exp(-0.6 * u)
        else:
            fall = math.exp(-u)
        coefficient *= 1.0 + p.drop * fall
    force = coefficient * (1.0 + p.viscous_asymmetry * s) * v
    if p.drag != 0.0:
        force += p.drag * v * abs(v) if p.drag_power == 2.0 else p.drag * s * abs(v) ** p.drag_power
    if p.root_drag != 0.0:
        force += p.root_drag * s * math.sqrt(abs(v))
    if p.shear != 0.0:
        force += p.shear * v / (1.0 + abs(v) / p.shear_speed)
    return force


@njit(**FAST)
def resisting_force(p, t, x, w):
    """Forces on the load that do not ask for the direction: weight, offset, springs, end stop, cable, outer force."""
    force = p.weight + p.offset - (w[3] + w[4] * (t - w[0]))
    if p.spring != 0.0:
        u = x[Y] - p.spring_rest
        force += p.spring * u * (1.0 + p.spring_cubic * u * u)
    if p.stop_stiffness > 0.0:
        u = p.stop_side * (x[Y] - p.stop)
        if u > 0.0:
            depth = u if p.stop_power == 1.0 else u * math.sqrt(u / 1e-3)
            force += p.stop_side * p.stop_stiffness * depth
    if p.dent != 0.0:
        u = (x[Y] - p.dent_centre) / p.dent_width
        force += p.dent * u * math.exp(0.5 - 0.5 * u * u)
    return force + p.cable * x[CABLE]


@njit(**FAST)
def pull_on_load(p, t, x, w):
    """(what would move a resting load, force the transmission carries, its push on the load).

    One mass: the drive itself pulls, and effects.md calls the drive force what the transmission carries: ripple, which
    effects.md puts on the friction side, is not in it. Two masses: the belt carries what it carries.
    """
    if p.belt > 0.0:
        carried, ripple = belt_force(p, x), 0.0
    else:
        carried, ripple = drive_force(p, t, x, w)
    return carried - ripple - resisting_force(p, t, x, w), carried, carried - ripple


@njit(**FAST)
def hold_margins(p, t, x, w):
    """How much the load is short of breaking away upwards and downwards [N]; negative = it breaks away."""
    pull, carried, _ = pull_on_load(p, t, x, w)
    up = dry_level(p, t, x, 1.0, x[MEMORY], carried, w)
    down = dry_level(p, t, x, -1.0, x[MEMORY], carried, w)
    return up - pull, down + pull


@njit(**FAST)
def rates(p, t, x, s, w, dx):
    """Fill dx with the rates of all states in mode s; sliding laws are continued smoothly a little beyond v = 0."""
    v = x[V]
    bristle = p.bristle > 0.0
    if bristle:
        s = 1.0 if v > 0.0 else (-1.0 if v < 0.0 else 0.0)
    pull, carried, drive = pull_on_load(p, t, x, w)
    smooth = viscous_force(p, t, v, s)
    speed = x[MEMORY] if p.memory > 0.0 else s * v
    two = p.belt > 0.0
    mass = p.load_mass if two else p.load_mass + p.motor_mass
    friction, acceleration = 0.0, 0.0
    dx[BRISTLE] = 0.0
    if bristle:
        level = max(dry_level(p, t, x, s, speed, carried, w), 1e-9)
        dx[BRISTLE] = v - p.bristle * abs(v) * x[BRISTLE] / level
        friction = p.bristle * x[BRISTLE] + p.bristle_damping * dx[BRISTLE] + smooth
        acceleration = (pull - friction) / mass
    elif s != 0.0:
        friction = s * dry_level(p, t, x, s, speed, carried, w) + smooth
        acceleration = (pull - friction) / mass
    dx[Y], dx[V] = v, acceleration
    if two:
        drive, ripple = drive_force(p, t, x, w)
        drive -= ripple
        dx[YM], dx[VM] = x[VM], (drive - carried) / p.motor_mass
    else:
        dx[YM], dx[VM] = v, acceleration
    dx[LAG1] = dx[LAG2] = 0.0
    if p.lag > 0.0:
        stage = p.lag / p.lag_order
        dx[LAG1] = (clip_force(p, w[1] + w[2] * (t - w[0])) - x[LAG1]) / stage
        dx[LAG2] = (x[LAG1] - x[LAG2]) / stage
    dx[MEMORY] = (abs(v) - x[MEMORY]) / p.memory if p.memory > 0.0 else 0.0
    dx[CABLE] = (v - abs(v) * x[CABLE]) / p.cable_travel if p.cable != 0.0 else 0.0
    dx[DWELL] = dwell_rate(p, v, s, x[DWELL]) if p.dwell != 0.0 else 0.0
    dx[DRIVE_WORK] = drive * x[VM] if two else drive * v
    dx[LOSS] = (
        friction * v + (carried - p.belt * (x[YM] - x[Y])) * (x[VM] - v) if two and p.gap <= 0.0 else friction * v
    )


@njit(**FAST)
def dwell_rate(p, v, s, extra):
    """Stiction grows while the load rests and is rubbed away over `dwell_slip` of sliding."""
    resting = s == 0.0 or (p.bristle > 0.0 and abs(v) < p.rest_speed)
    if not resting:
        return -abs(v) * extra / p.dwell_slip
    if p.dwell_shape > 0.0:  # k ln(1 + t/t0), k and t0 such that it passes the exponential's value at t = tau
        k, t0 = 0.3 * p.dwell, p.dwell_time / (math.exp(0.632 / 0.3) - 1.0)
        return k / t0 * math.exp(-extra / k)
    return (p.dwell - extra) / p.dwell_time


@njit(**FAST)
def rest_state(p, w, y, v, settled):
    """State at the start: at y with speed v; settled 1: the belt carries the command, 2: and the bristles the load."""
    x = np.zeros(STATES)
    x[Y] = x[YM] = y
    x[V] = x[VM] = v
    x[MEMORY] = abs(v)
    x[LAG1] = x[LAG2] = clip_force(p, w[1])
    if settled >= 1 and p.belt > 0.0:
        drive = clip_force(p, w[1])
        x[YM] += drive / p.belt + 0.5 * p.gap * np.sign(drive)
    if settled >= 2 and p.bristle > 0.0:
        pull, carried, _ = pull_on_load(p, w[0], x, w)
        most = dry_level(p, w[0], x, np.sign(pull), 0.0, carried, w)
        x[BRISTLE] = min(max(pull, -most), most) / p.bristle
    return x
