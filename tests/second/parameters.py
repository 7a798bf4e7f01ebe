"""Everything the compiled machine reads, as one record of floats in SI units (rotary: N·m, rad, kg·m²); 0 = absent."""

from collections.abc import Mapping

import numpy as np

# fmt: off
FIELDS = (
    # masses, transmission: two_mass 1 = a belt, 2 = a gap with a contact on both sides
    "two_mass", "motor_mass", "load_mass", "belt_stiffness", "belt_damping", "gap", "motor_friction_share",
    "motor_side", "weight",
    # friction: coulomb + (static - coulomb) exp(-(|v|/stribeck)^stribeck_exponent) + viscous v
    "coulomb", "static", "stribeck", "stribeck_exponent", "viscous", "dry_asymmetry", "viscous_asymmetry",
    "level_slope", "level_middle", "bump", "bump_centre", "bump_left", "bump_right", "load_friction", "drag",
    "drop", "drop_time", "heating", "heat_power", "step", "step_time", "step_ramp",
    "dwell", "dwell_time", "dwell_logarithm", "dwell_slip",
    "bristle_law", "bristle_stiffness", "bristle_damping",  # bristle_law 1 = LuGre, 2 = six Maxwell-slip elements
    # forces that do not ask for the direction
    "offset", "spring", "spring_rest", "ripple", "ripple_period", "ripple_phase", "ripple_second",
    "stop", "stop_stiffness", "stop_damping", "stop_side",
    # drive chain behind the command
    "torque_scale", "lag", "delay", "limit", "eccentricity", "eccentricity_period", "eccentricity_phase",
    "current_time", "reading_delay",
    # outside the catalogue
    "pendulum_mass", "pendulum_frequency", "pendulum_damping", "cable", "cable_start", "cable_side", "cubic_drag",
    "brake", "brake_start", "brake_end", "magnet", "magnet_centre", "magnet_width",
    "scrape", "scrape_centre", "scrape_width", "scrape_side", "vibration", "vibration_frequency", "vibration_phase",
    "debris", "debris_length",
    # digital cascade of the drive
    "position_gain", "speed_gain", "integral_gain", "mass_forward", "weight_forward", "friction_forward",
    "smooth_speed", "integral_limit", "command_limit", "dead_band", "speed_filter",
)
# fmt: on
RECORD = np.dtype([(name, np.float64) for name in FIELDS])


def record(values: Mapping[str, float]) -> np.ndarray:
    """One-element array of `RECORD`; what is not named is 0."""
    p = np.zeros(1, RECORD)
    for name, value in values.items():
        p[name] = value
    return p
