"""What no catalogue name describes: friction that does not repeat, outer forces, bursts; as series over stamps.

Physics outside the catalogue that lives in the equations (cable, root drag, frictional lag, detent ...) is switched on
by `ReferencePlant.foreign`; `OUTSIDE` lists all of it with the coordinate it depends on, which a diagnosis should find.
"""

import numpy as np
from scipy.signal import lfilter

# name -> coordinates (docs/json.md) a sound diagnosis may give, the first being the physical one
OUTSIDE = {
    "outer_sine": ("frequency", "time"),
    "outer_pulse": ("time",),
    "sticking_bursts": ("time",),
    "cable_hysteresis": ("distance_since_reversal", "time_since_reversal", "position", "direction"),
    "root_drag": ("velocity",),
    "shear_thinning": ("velocity",),
    "frictional_lag": ("velocity", "acceleration", "time_since_reversal"),
    "detent": ("position",),
    "level_ripple": ("position", "motor_angle", "pulley_angle"),
    "one_way_friction": ("direction", "velocity"),
    "encoder_error": ("position", "motor_angle", "pulley_angle"),
    "sensor_slip": ("time",),
}
IN_THE_EQUATIONS = (
    "cable_hysteresis", "root_drag", "shear_thinning", "frictional_lag", "detent", "level_ripple", "one_way_friction",
)  # fmt: skip


def wandering(t, rms, correlation, rng):
    """Ornstein-Uhlenbeck series: exactly AR(1) on equidistant stamps; `rms` in its unit, `correlation` [s]."""
    keep = np.exp(-(t[1] - t[0]) / correlation)
    shocks = rng.standard_normal(len(t)) * np.sqrt(1 - keep**2)
    shocks[0] = rng.standard_normal()
    return rms * lfilter([1.0], [1.0, -keep], shocks)


def torque_noise(t, rms, rng):
    """White noise of the drive's torque that the recording does not know of. [N]"""
    return rms * rng.standard_normal(len(t))


def outer_sine(t, amplitude, frequency, phase):
    """A neighbour shakes the axis. [N]"""
    return amplitude * np.sin(2 * np.pi * frequency * t + phase)


def outer_pulse(t, amplitude, start, length):
    """Somebody leans on the axis for a while, softly. [N]"""
    u = np.clip((t - start) / length, 0.0, 1.0)
    return amplitude * np.sin(np.pi * u) ** 2


def bursts(t, height, rate, length, rng, window=None):
    """Extra dry friction in bursts at random: `rate` [1/s], `length` [s], inside `window` (start, end) if given. [N]"""
    level = np.zeros_like(t)
    start, end = window if window is not None else (t[0], t[-1])
    for centre in rng.uniform(start, end, rng.poisson(rate * (end - start))):
        u = np.abs(t - centre) / (0.5 * length * rng.uniform(0.5, 1.5))
        level = np.maximum(level, np.where(u < 1.0, height * rng.uniform(0.6, 1.4), 0.0))
    return level
