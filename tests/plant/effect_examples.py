"""One example of every effect, of a size that matters on the paper's machine, and the set that says 'absent'."""

import math

EXAMPLES = {
    "force_offset": {"force": 3.0},
    "coulomb_asymmetry": {"asymmetry_ratio": 0.1},
    "viscous_asymmetry": {"asymmetry_ratio": 0.2},
    "position_dependent_friction": {"relative_slope": 0.5},
    "rail_defect": {"amplitude": 40.0, "centre": 0.2, "width": 0.02},
    "presliding_hysteresis": {"bristle_stiffness": 1e5, "bristle_damping": 300.0},
    "backlash": {"gap": 1e-3},
    "transmission_compliance": {"stiffness": 1e5, "damping": 100.0},
    "torque_ripple": {"amplitude": 10.0, "period": 0.05},
    "pulley_eccentricity": {"relative_eccentricity": 0.05},
    "load_dependent_friction": {"coefficient": 0.1},
    "thermal_drift": {"relative_drop": 0.5, "time_constant": 10.0},
    "quadratic_drag": {"coefficient": 100.0},
    "position_spring": {"stiffness": 50.0, "rest_position": 0.2},
    "inertia_error": {"mass_error": 2.0},
    "torque_scale_error": {"relative_error": 0.05},
    "actuator_lag": {"time_constant": 0.03},
    "dead_time": {"delay": 0.013},
    "torque_saturation": {"limit": 4.5},
    "dwell_time_stiction": {"stiction_rise": 20.0, "time_constant": 1.0},
    "end_stop": {"position": 0.35, "stiffness": 2e4},
    "step_change": {"step": 10.0, "time": 7.003},
}
ABSENT = {
    "presliding_hysteresis": {"bristle_stiffness": math.inf},
    "transmission_compliance": {"stiffness": math.inf},
    "torque_saturation": {"limit": math.inf},
    "torque_ripple": {"amplitude": 0.0, "relative_amplitude": 0.0},
    "end_stop": {"stiffness": 0.0},
}


def absent(name):
    """The example with its size at the value where the effect is not there."""
    first = next(iter(EXAMPLES[name]))
    return {**EXAMPLES[name], **ABSENT.get(name, {first: 0.0})}
