"""Friction laws and forces of one sub-step, compiled; p a `parameters.RECORD`, x a `machine.STATE` they may advance."""

import numpy as np
from numba import njit

TURN = 2 * np.pi
ELEMENTS = 6  # of the Maxwell-slip law


@njit
def stribeck_level(p, v):
    """Dry friction at speed v without anything hidden. [N]"""
    return p.coulomb + (p.static - p.coulomb) * np.exp(-((abs(v) / p.stribeck) ** p.stribeck_exponent))


@njit
def beyond(q, level):
    """What of q is beyond +-level: the impulse that friction leaves, 0 where it holds."""
    if q > level:
        return q - level
    if q < -level:
        return q + level
    return 0.0


@njit
def sign(v):
    """-1, 0 or 1."""
    return 1.0 if v > 0 else (-1.0 if v < 0 else 0.0)


@njit
def going(x, v):
    """Direction of the motion, at rest that of the pull: 1 or -1."""
    return sign(v) if v != 0 else x.pull_direction


@njit
def dry_level(p, x, t, h, level, force, y, v):
    """Dry friction [N] with all that is hidden in it, from `level` without; ages contact and distance in x by h [s]."""
    direction = going(x, v)
    if p.dry_asymmetry != 0:
        level *= 1 + direction * p.dry_asymmetry
    if p.level_slope != 0:
        factor = 1 + p.level_slope * (y - p.level_middle)
        if factor < 0:
            factor = 0.0
        level *= factor
    if p.bump != 0:
        width = p.bump_left if y < p.bump_centre else p.bump_right
        level += p.bump * np.exp(-0.5 * ((y - p.bump_centre) / width) ** 2)
    if p.load_friction != 0:
        level += p.load_friction * abs(force)
    if p.step != 0 and t > p.step_time:
        level += p.step * min(1.0, (t - p.step_time) / p.step_ramp)
    if p.dwell != 0:
        level += dwell_rise(p, x, h, v)
    if p.brake != 0 and t > p.brake_start and t < p.brake_end:
        level += p.brake * min(1.0, min((t - p.brake_start) / 0.2, (p.brake_end - t) / 0.2))
    if p.scrape != 0 and direction * p.scrape_side > 0:
        level += p.scrape / (1 + ((y - p.scrape_centre) / p.scrape_width) ** 4)
    if p.debris != 0:
        moving = sign(v)
        if moving != 0 and moving != x.last_direction:
            x.last_direction = moving
            x.distance = 0.0
        x.distance += abs(v) * h
        level += p.debris * (1 - np.exp(-((x.distance / p.debris_length) ** 2)))
    return max(level, 0.0)


@njit
def dwell_rise(p, x, h, v):
    """What a rest adds to the dry level, rubbed away by sliding. [N]"""
    if v == 0.0:
        x.rest += h
        x.slip = 0.0
    else:
        x.slip += abs(v) * h
        if x.slip > 3 * p.dwell_slip:
            x.rest = 0.0
    age = x.rest / p.dwell_time
    aged = 1 - np.exp(-age) if p.dwell_logarithm == 0 else np.log(1 + age)
    return p.dwell * aged * np.exp(-((x.slip / p.dwell_slip) ** 2))


@njit
def viscous_coefficient(p, x, t, h, level, v):
    """Force per speed [N·s/m] without drag; the heating law warms x by what friction loses."""
    viscous = p.viscous
    if p.viscous_asymmetry != 0:
        viscous = p.viscous * (1 + going(x, v) * p.viscous_asymmetry)
    if p.drop != 0:
        if p.heating == 0:
            viscous = viscous * (1 + p.drop * np.exp(-t / p.drop_time))
        else:
            lost = abs(level * v) + viscous * v * v - p.heat_power * x.heat
            x.heat += h * lost / (p.heat_power * p.drop_time)
            viscous = viscous * (1 + p.drop * np.exp(-2.0 * x.heat))
    return viscous


@njit
def even_force(p, x, t, h, force, y, v):
    """Forces against the motion upwards [N] but the weight; swings the pendulum in x by h [s]."""
    against = p.offset
    if p.ripple != 0:
        angle = TURN * y / p.ripple_period + p.ripple_phase
        against += p.ripple * (np.cos(angle) + p.ripple_second * np.cos(2 * angle + 1.0))
    if p.spring != 0:
        against += p.spring * (y - p.spring_rest)
    if p.stop_stiffness != 0:
        depth = (y - p.stop) * p.stop_side
        if depth > 0:
            push = p.stop_stiffness * depth * (1 + p.stop_damping * v * p.stop_side)
            if push > 0:
                against += push * p.stop_side
    if p.cable != 0:
        paid_out = (y - p.cable_start) * p.cable_side
        if paid_out > 0:
            against += p.cable * paid_out * paid_out * p.cable_side
    if p.magnet != 0:
        u = (y - p.magnet_centre) / p.magnet_width
        against += p.magnet * u / (1 + u * u) ** 2 * 3.08
    if p.vibration != 0:
        against += p.vibration * np.cos(TURN * p.vibration_frequency * t + p.vibration_phase)
    if p.pendulum_mass != 0:
        against -= pendulum_force(p, x, h, y, v)
    return against


@njit
def pendulum_force(p, x, h, y, v):
    """Force of a hanging load that swings on the axis. [N]"""
    w = p.pendulum_frequency
    force = p.pendulum_mass * (w**2 * (x.pendulum_y - y) + 2 * p.pendulum_damping * w * (x.pendulum_v - v))
    x.pendulum_v += -h * force / p.pendulum_mass
    x.pendulum_y += h * x.pendulum_v
    return force


@njit
def bristle_force(p, x, elements, h, level, v):
    """Dry friction of bristles (LuGre, implicit in z) or of Maxwell-slip elements. [N]"""
    if p.bristle_law == 1:
        bent = (x.bristle + h * v) / (1 + h * abs(v) * p.bristle_stiffness / max(level, 1e-9))
        rate = (bent - x.bristle) / h
        x.bristle = bent
        return p.bristle_stiffness * x.bristle + p.bristle_damping * rate
    force = 0.0
    rate = 0.0
    for q in range(ELEMENTS):
        limit = level / 6.0
        stiffness = p.bristle_stiffness * (1.9 - 0.36 * q) / 6.0
        pulled = elements[q] + stiffness * v * h
        if pulled > limit:
            pulled = limit
        if pulled < -limit:
            pulled = -limit
        rate += (pulled - elements[q]) / h / p.bristle_stiffness
        elements[q] = pulled
        force += pulled
    return force + p.bristle_damping * rate


@njit
def belt_force(p, x):
    """Force of belt, or of the contact on either side of a gap, on the load; a contact pushes and cannot pull. [N]"""
    stretch = x.y1 - x.y2
    rate = x.v1 - x.v2
    if p.two_mass == 1:
        return p.belt_stiffness * stretch + p.belt_damping * rate
    half = 0.5 * p.gap
    if stretch > half:
        return max(0.0, p.belt_stiffness * (stretch - half) + p.belt_damping * rate)
    if stretch < -half:
        return min(0.0, p.belt_stiffness * (stretch + half) + p.belt_damping * rate)
    return 0.0
