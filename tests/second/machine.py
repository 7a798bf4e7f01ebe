"""The march: a digital drive at its own period, the machine in sub-steps, what a drive would report once a sample."""

from typing import NamedTuple

import numpy as np
from numba import njit

from .drive import command, current_loop, lag_and_scale, limit_and_lever
from .laws import (
    ELEMENTS,
    belt_force,
    beyond,
    bristle_force,
    dry_level,
    even_force,
    sign,
    stribeck_level,
    viscous_coefficient,
)

HELD, MEAN, POINT = 0, 1, 2  # what is reported: the command held over the sample, the mean over it, the value at it
# y1, v1: motor, or all of a stiff axis; y2, v2: load of two masses
STATE = np.dtype(
    [(name, np.float64) for name in (
        "y1", "v1", "y2", "v2", "current", "lagged", "integral", "filtered_speed", "last_reading", "bristle", "heat",
        "rest", "slip", "pendulum_y", "pendulum_v", "last_direction", "distance", "pull_direction",
    )]
)  # fmt: skip


class Moved(NamedTuple):
    """What a run gives, one value a sample; means are over the sample.

    Attributes:
        position: as the sensor's side would read it, without noise. [m]
        velocity: there. [m/s]
        command: what the drive reports, see `HELD`, `MEAN`, `POINT`. [N]
        friction: mean friction of the ordinary law, sign of the motion included. [N]
        rough: mean of what the wandering of the dry level added. [N]
        slowest: least speed in the sample. [m/s]
        current: mean force of the current. [N]
        viscous: mean viscous coefficient. [N·s/m]
    """

    position: np.ndarray
    velocity: np.ndarray
    command: np.ndarray
    friction: np.ndarray
    rough: np.ndarray
    slowest: np.ndarray
    current: np.ndarray
    viscous: np.ndarray


def run(p, motion, rough, reading_noise, period, substeps, per_sample, reported) -> Moved:
    """Drive the machine `p` along `motion` (position, velocity, acceleration at the period of the drive [s]).

    `rough` (relative, of the dry level) and `reading_noise` [m] come at the same instants; a sample is `per_sample`
    periods of the drive.
    """
    return Moved(*march(p, *motion, rough, reading_noise, period, substeps, per_sample, reported))


@njit(cache=True)
def march(parameters, y_wanted, v_wanted, a_wanted, rough, reading_noise, period, substeps, per_sample, reported):
    """See `run`."""
    p = parameters[0]
    count = y_wanted.size
    samples = count // per_sample
    h = period / substeps
    position = np.zeros(samples)
    velocity = np.zeros(samples)
    reports = np.zeros(samples)
    friction = np.zeros(samples)
    roughness = np.zeros(samples)
    slowest = np.zeros(samples)
    current = np.zeros(samples)
    viscous_mean = np.zeros(samples)
    x = np.zeros(1, STATE)[0]
    x.y1 = x.y2 = x.pendulum_y = y_wanted[0]
    x.current = x.lagged = p.weight_forward
    x.slip = 1.0
    elements = np.zeros(ELEMENTS)
    late_force = np.full(round(p.delay / h) + 1, p.weight_forward)
    late_reading = np.full(round(p.reading_delay / h) + 1, x.y1)
    at_force = 0
    at_reading = 0
    inside = substeps * per_sample
    load_side = p.two_mass > 0 and p.motor_side == 0
    for k in range(count):
        r = k // per_sample
        reading = x.y1 + reading_noise[k]
        if k == 0:
            x.last_reading = reading
        u = command(p, x, reading, y_wanted[k], v_wanted[k], a_wanted[k], period)
        if k % per_sample == 0:
            if late_reading.size > 1:
                position[r] = late_reading[at_reading]
            else:
                position[r] = x.y2 if load_side else x.y1
            velocity[r] = x.v2 if load_side else x.v1
            slowest[r] = 1e30
            if reported == HELD:
                reports[r] = u
            elif reported == POINT:
                reports[r] = x.current
        for j in range(substeps):
            t = (k * substeps + j) * h
            current_loop(p, x, u, h)
            if reported == MEAN:
                reports[r] += x.current / inside
            force = lag_and_scale(p, x, h)
            if late_force.size > 1:
                late_force[at_force] = force
                at_force += 1
                if at_force >= late_force.size:
                    at_force = 0
                force = late_force[at_force]
            y = x.y2 if p.two_mass > 0 else x.y1
            v = x.v2 if p.two_mass > 0 else x.v1
            force = limit_and_lever(p, force, y)
            x.pull_direction = 1.0 if force - p.weight - p.offset > 0 else -1.0
            plain = stribeck_level(p, v)
            rubbed = plain * (1 + rough[k])
            level = dry_level(p, x, t, h, rubbed, force, y, v)
            viscous = viscous_coefficient(p, x, t, h, level, v)
            damping = viscous + (p.drag * abs(v) + p.cubic_drag * v * v)
            against = even_force(p, x, t, h, force, y, v)
            if p.two_mass == 0:
                move_one(p, x, elements, h, force, against, level, damping)
                v = x.v1
            else:
                move_two(p, x, h, force, against, level, damping)
                v = x.v2
                if p.motor_side == 1:
                    v = x.v1
                    rubbed += stribeck_level(p, v) - plain
                    plain = stribeck_level(p, v)
            if late_reading.size > 1:
                late_reading[at_reading] = x.y1
                at_reading += 1
                if at_reading >= late_reading.size:
                    at_reading = 0
            direction = sign(v)
            friction[r] += (direction * plain + p.viscous * v) / inside
            roughness[r] += direction * (rubbed - plain) / inside
            current[r] += x.current / inside
            viscous_mean[r] += viscous / inside
            slowest[r] = min(slowest[r], abs(v))
    return position, velocity, reports, friction, roughness, slowest, current, viscous_mean


@njit
def move_one(p, x, elements, h, force, against, level, damping):
    """One mass by h [s]: implicit in viscous friction, dry friction set-valued or of bristles."""
    if p.bristle_law > 0:
        dry = bristle_force(p, x, elements, h, level, x.v1)
        v = (p.motor_mass * x.v1 / h + force - p.weight - against - dry) / (p.motor_mass / h + damping)
    else:
        left = beyond(p.motor_mass * x.v1 / h + force - p.weight - against, level)
        v = left / (p.motor_mass / h + damping)
    x.y1 += h * 0.5 * (x.v1 + v)
    x.v1 = v


@njit
def move_two(p, x, h, force, against, level, damping):
    """Two masses by h [s]: the motor carries a share of the friction, the load the rest."""
    belt, share = belt_force(p, x), p.motor_friction_share
    motor = beyond(p.motor_mass * x.v1 / h + force - belt, share * p.coulomb)
    motor /= p.motor_mass / h + share * p.viscous
    load = beyond(p.load_mass * x.v2 / h + belt - p.weight - against, level - share * p.coulomb)
    load /= p.load_mass / h + damping - share * p.viscous
    x.y1 += h * 0.5 * (x.v1 + motor)
    x.v1 = motor
    x.y2 += h * 0.5 * (x.v2 + load)
    x.v2 = load
