"""The drive, compiled: a digital cascade, and what lies between its command and the force at the axis."""

import numpy as np
from numba import njit

from .laws import TURN


@njit
def command(p, x, reading, y_wanted, v_wanted, a_wanted, period):
    """Force the cascade asks for [N] at a `reading` of the motor [m], every `period` [s]; clamped against windup."""
    speed = (reading - x.last_reading) / period
    x.last_reading = reading
    x.filtered_speed += (speed - x.filtered_speed) * (period / (period + p.speed_filter))
    error = y_wanted - reading
    speed_error = v_wanted + p.position_gain * error - x.filtered_speed
    direction = 0.0
    if v_wanted > 0:
        direction = 1.0
    elif v_wanted < 0:
        direction = -1.0
    u = (
        p.mass_forward * a_wanted
        + p.weight_forward
        + p.friction_forward * direction * min(1.0, abs(v_wanted) / p.smooth_speed)
        + p.speed_gain * speed_error
        + x.integral
    )
    if not (direction == 0.0 and abs(error) < p.dead_band) and abs(u) < p.command_limit:
        x.integral += p.integral_gain * speed_error * period
        if x.integral > p.integral_limit:
            x.integral = p.integral_limit
        if x.integral < -p.integral_limit:
            x.integral = -p.integral_limit
    if u > p.command_limit:
        u = p.command_limit
    if u < -p.command_limit:
        u = -p.command_limit
    return u


@njit
def current_loop(p, x, u, h):
    """Force of the current, behind its loop, at the end of a sub-step of h [s]. [N]"""
    if p.current_time > 0:
        x.current += (u - x.current) * (1 - np.exp(-h / p.current_time))
    else:
        x.current = u


@njit
def lag_and_scale(p, x, h):
    """Force behind a wrong torque constant and a first-order lag. [N]"""
    force = x.current * p.torque_scale
    if p.lag > 0:
        x.lagged += (force - x.lagged) * (h / p.lag)
        force = x.lagged
    return force


@njit
def limit_and_lever(p, force, y):
    """Force at the axis [N]: a limit with a round shoulder, and a pulley that runs out of true."""
    if p.limit > 0:
        force = force / (1 + abs(force / p.limit) ** 14) ** (1 / 14.0)
    if p.eccentricity != 0:
        force = force / (1 + p.eccentricity * np.cos(TURN * y / p.eccentricity_period + p.eccentricity_phase))
    return force
