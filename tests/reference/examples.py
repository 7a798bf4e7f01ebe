"""The paper's machine (§4.3, both readings) and one example of every effect, of a size that matters."""

from .excitation import Torque, sine, stamps
from .parameters import ReferencePlant

EXAMPLES = {
    "force_offset": {"force": 6.0},
    "coulomb_asymmetry": {"asymmetry_ratio": 0.05},
    "viscous_asymmetry": {"asymmetry_ratio": 0.1},
    "position_dependent_friction": {"relative_slope": 0.5, "middle": 0.2},
    "rail_defect": {"amplitude": 40.0, "centre": 0.15, "width": 0.01},
    "presliding_hysteresis": {"bristle_stiffness": 1e5, "bristle_damping": 300.0},
    "backlash": {"gap": 1e-3},
    "transmission_compliance": {"stiffness": 1e5, "damping": 100.0},
    "torque_ripple": {"amplitude": 10.0, "period": 0.0898, "phase": 0.5},
    "pulley_eccentricity": {"relative_eccentricity": 0.05, "phase": 1.0},
    "load_dependent_friction": {"coefficient": 0.08},
    "thermal_drift": {"relative_drop": 0.5, "time_constant": 20.0},
    "quadratic_drag": {"coefficient": 100.0},
    "position_spring": {"stiffness": 100.0, "rest_position": 0.1},
    "inertia_error": {"mass_error": 2.0, "payload": 0.0},
    "torque_scale_error": {"relative_error": 0.02},
    "actuator_lag": {"time_constant": 0.03},
    "dead_time": {"delay": 0.033},
    "torque_saturation": {"limit": 4.2},
    "dwell_time_stiction": {"stiction_rise": 25.0, "time_constant": 0.5},
    "end_stop": {"position": 0.35, "stiffness": 2e4},
    "step_change": {"step": 15.0, "time": 8.005},
}
PAIRS = (
    ("rail_defect", "coulomb_asymmetry"),
    ("viscous_asymmetry", "actuator_lag"),
    ("transmission_compliance", "backlash"),
    ("transmission_compliance", "torque_ripple"),
    ("presliding_hysteresis", "rail_defect"),
    ("presliding_hysteresis", "dead_time"),
    ("thermal_drift", "quadratic_drag"),
    ("position_spring", "pulley_eccentricity"),
    ("step_change", "load_dependent_friction"),
    ("dwell_time_stiction", "force_offset"),
)


def paper_machine(reading: str = "literal", effects=None, **other) -> ReferencePlant:
    """25 kg on a vertical guide; F_s 60 N (literal) or 150 N (bump), and the gain that moves it +-0.2 m."""
    gain, static = {"literal": (74.0, 60.0), "bump": (86.0, 150.0)}[reading]
    constants = {"M": 20.0, "J": 5.0 * 0.045**2, "force_per_torque": gain, "static_force": static}
    return ReferencePlant(**{**constants, **other}, effects=effects or {})


def paper_torque(plant: ReferencePlant, hold: str = "hold", duration: float = 20.0, period: float = 0.01) -> Torque:
    """2.1 N·m at 0.2 Hz on top of what holds the weight."""
    t = stamps(duration, period)
    return Torque(t, plant.weight / plant.gain + sine(t, 2.1, 0.2), hold)


def example(name: str) -> dict:
    """Effects dictionary for one name, or several joined by '+'."""
    return {one: EXAMPLES[one] for one in name.split("+")} if name != "baseline" else {}
