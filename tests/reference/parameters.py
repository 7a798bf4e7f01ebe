"""The machine as plain numbers: constants of eq. (5), friction of eq. (1), effects by name, and the compiled record."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

# What the compiled physics reads: one float each, 0 (or inf where noted) = absent.
# fmt: off
FIELDS = [
    "load_mass", "motor_mass", "weight", "coulomb", "static", "stribeck", "viscous", "offset", "dry_asymmetry",
    "viscous_asymmetry", "level_slope", "level_middle", "level_shape", "bump", "bump_centre", "bump_width",
    "bump_shape", "bristle", "bristle_damping", "gap", "belt", "belt_damping", "ripple", "ripple_relative",
    "ripple_wave", "ripple_phase", "ripple_second", "eccentricity", "eccentricity_wave", "eccentricity_phase",
    "load_friction", "load_friction_knee", "drop", "drop_time", "drop_shape", "drag", "drag_power", "spring",
    "spring_rest", "spring_cubic", "scale", "lag", "lag_order", "delay", "limit", "limit_knee", "dwell",
    "dwell_time", "dwell_shape", "dwell_slip", "dwell_level", "rest_speed", "stop", "stop_stiffness", "stop_side",
    "stop_power", "step", "step_time", "step_ramp", "step_both", "root_drag", "memory", "cable", "cable_travel",
    "shear", "shear_speed", "dent", "dent_centre", "dent_width", "level_ripple", "level_ripple_wave", "one_way",
    "exponent",
]
# fmt: on
RECORD = np.dtype([(name, np.float64) for name in FIELDS])
CONTACT_FREQUENCY = 4000.0  # rad/s of a hard contact (backlash without compliance), critically damped


@dataclass(frozen=True)
class ReferencePlant:
    """A machine: constants, friction, and what else is in it.

    Attributes:
        M, J, Rc, Rm, force_per_torque, g, orientation: as in the axis file; J/Rc^2 is the motor side. Rotary: J only.
        coulomb_force, static_force, stribeck_velocity, viscous_coefficient: eq. (1) with |v|.
        stribeck_exponent: of |v|/v_s in it; 1 in the paper, 2 is Gaussian.
        effects: name of effects.md -> its parameters under the names there (see `EFFECTS`).
        foreign: name -> parameters of physics outside the catalogue (see `FOREIGN`).
        shapes: other functional forms of catalogue effects (see `SHAPES`); empty = effects.md to the letter.
    """

    M: float = 20.0
    J: float = 0.010125
    Rc: float = 0.045
    Rm: float = 0.0143
    force_per_torque: float | None = None
    g: float = 9.81
    orientation: str = "vertical"
    coulomb_force: float = 90.0
    static_force: float = 60.0
    stribeck_velocity: float = 0.1
    viscous_coefficient: float = 180.0
    stribeck_exponent: float = 1.0
    effects: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    foreign: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    shapes: Mapping[str, str] = field(default_factory=dict)

    @property
    def moving_mass(self) -> float:
        """m_e without the hidden inertia error. [kg or kg·m²]"""
        return self.J if self.orientation == "rotary" else self.M + self.J / self.Rc**2

    @property
    def gain(self) -> float:
        """Force at the belt per torque."""
        if self.orientation == "rotary":
            return 1.0 if self.force_per_torque is None else self.force_per_torque
        return 1.0 / self.Rm if self.force_per_torque is None else self.force_per_torque

    @property
    def weight(self) -> float:
        """M g on a vertical axis. [N]"""
        return self.M * self.g if self.orientation == "vertical" else 0.0

    @property
    def unit_force(self) -> float:
        """A natural scale for forces of this machine: its dry friction."""
        return max(self.coulomb_force, self.static_force, 1e-12)

    def record(self) -> np.ndarray:
        """One-element array of `RECORD` for the compiled physics."""
        p = np.zeros(1, RECORD)
        values = _constants(self)
        for name, given in self.effects.items():
            defaults, translate = EFFECTS[name]
            values.update(translate(_complete(name, defaults, given), self))
        for name, given in self.foreign.items():
            defaults, translate = FOREIGN[name]
            values.update(translate(_complete(name, defaults, given), self))
        for name, shape in self.shapes.items():
            values.update(SHAPES[name][shape])
        _close_two_mass(values, self)
        for name, value in values.items():
            p[name] = value
        return p


def _complete(name: str, defaults: Mapping[str, float], given: Mapping[str, float]) -> dict[str, float]:
    if unknown := set(given) - set(defaults):
        raise KeyError(f"{name} has no parameter {sorted(unknown)}; it has {sorted(defaults)}")
    full = {**defaults, **given}
    if missing := [key for key, value in full.items() if isinstance(value, float) and math.isnan(value)]:
        raise KeyError(f"{name} needs {missing}")
    return full


def _constants(plant: ReferencePlant) -> dict[str, float]:
    rotary = plant.orientation == "rotary"
    return {
        "load_mass": 0.0 if rotary else plant.M, "motor_mass": plant.J if rotary else plant.J / plant.Rc**2,
        "weight": plant.weight, "coulomb": plant.coulomb_force, "static": plant.static_force,
        "stribeck": plant.stribeck_velocity, "viscous": plant.viscous_coefficient,
        "limit": math.inf, "bump_width": 1.0, "drop_time": 1.0, "dwell_time": 1.0, "dwell_slip": 1e-3,
        "rest_speed": 1e-3 * plant.stribeck_velocity, "stop_side": 1.0, "stop_power": 1.0, "drag_power": 2.0,
        "lag_order": 1.0, "ripple_wave": 1.0, "eccentricity_wave": 1.0, "cable_travel": 1.0, "shear_speed": 1.0,
        "dent_width": 1.0, "exponent": plant.stribeck_exponent,
    }  # fmt: skip


def _close_two_mass(values: dict[str, float], plant: ReferencePlant) -> None:
    """Give a gap without compliance its hard contact: as stiff as `CONTACT_FREQUENCY`, critically damped."""
    if not (values.get("gap") or values.get("belt")):
        return
    m, n = values["load_mass"], values["motor_mass"]
    if not (m > 0 and n > 0):
        raise ValueError("two masses need inertia on both sides: M > 0 and J > 0")
    if not values.get("belt"):
        reduced = m * n / (m + n)
        values["belt"] = reduced * CONTACT_FREQUENCY**2
        values["belt_damping"] = 2.0 * reduced * CONTACT_FREQUENCY


_NAN = math.nan
_TURN = 2.0 * math.pi

# name -> (parameters with defaults, NaN = must be given; translation into record fields)
EFFECTS = {
    "force_offset": ({"force": _NAN}, lambda e, _: {"offset": e["force"]}),
    "coulomb_asymmetry": ({"asymmetry_ratio": _NAN}, lambda e, _: {"dry_asymmetry": e["asymmetry_ratio"]}),
    "viscous_asymmetry": ({"asymmetry_ratio": _NAN}, lambda e, _: {"viscous_asymmetry": e["asymmetry_ratio"]}),
    "position_dependent_friction": (
        {"relative_slope": _NAN, "middle": 0.0},
        lambda e, _: {"level_slope": e["relative_slope"], "level_middle": e["middle"]},
    ),
    "rail_defect": (
        {"amplitude": _NAN, "centre": _NAN, "width": _NAN},
        lambda e, _: {"bump": e["amplitude"], "bump_centre": e["centre"], "bump_width": e["width"]},
    ),
    "presliding_hysteresis": (
        {"bristle_stiffness": _NAN, "bristle_damping": 0.0},
        lambda e, _: {"bristle": e["bristle_stiffness"], "bristle_damping": e["bristle_damping"]},
    ),
    "backlash": ({"gap": _NAN}, lambda e, _: {"gap": e["gap"]}),
    "transmission_compliance": (
        {"stiffness": _NAN, "damping": 0.0},
        lambda e, _: {"belt": e["stiffness"], "belt_damping": e["damping"]},
    ),
    "torque_ripple": (
        {"period": _NAN, "amplitude": 0.0, "relative_amplitude": 0.0, "phase": 0.0},
        lambda e, _: {
            "ripple": e["amplitude"],
            "ripple_relative": e["relative_amplitude"],
            "ripple_wave": _TURN / e["period"],
            "ripple_phase": e["phase"],
        },
    ),
    "pulley_eccentricity": (
        {"relative_eccentricity": _NAN, "period": 0.0, "phase": 0.0},
        lambda e, plant: {
            "eccentricity": e["relative_eccentricity"],
            "eccentricity_phase": e["phase"],
            "eccentricity_wave": _TURN / e["period"] if e["period"] else 1.0 / plant.Rc,
        },
    ),
    "load_dependent_friction": ({"coefficient": _NAN}, lambda e, _: {"load_friction": e["coefficient"]}),
    "thermal_drift": (
        {"relative_drop": _NAN, "time_constant": _NAN},
        lambda e, _: {"drop": e["relative_drop"], "drop_time": e["time_constant"]},
    ),
    "quadratic_drag": ({"coefficient": _NAN}, lambda e, _: {"drag": e["coefficient"]}),
    "position_spring": (
        {"stiffness": _NAN, "rest_position": 0.0},
        lambda e, _: {"spring": e["stiffness"], "spring_rest": e["rest_position"]},
    ),
    "inertia_error": (
        {"mass_error": _NAN, "payload": 1.0},  # payload 1: weighs on a vertical axis; 0: inertia only
        lambda e, plant: {
            "load_mass": e["mass_error"] + (0.0 if plant.orientation == "rotary" else plant.M),
            "weight": plant.weight
            + (e["payload"] * e["mass_error"] * plant.g if plant.orientation == "vertical" else 0.0),
        },
    ),
    "torque_scale_error": ({"relative_error": _NAN}, lambda e, _: {"scale": e["relative_error"]}),
    "actuator_lag": ({"time_constant": _NAN}, lambda e, _: {"lag": e["time_constant"]}),
    "dead_time": ({"delay": _NAN}, lambda e, _: {"delay": e["delay"]}),
    "torque_saturation": ({"limit": _NAN}, lambda e, plant: {"limit": e["limit"] * abs(plant.gain)}),  # limit in N·m
    "dwell_time_stiction": (
        {"stiction_rise": _NAN, "time_constant": _NAN, "slip": 1e-3},
        lambda e, _: {"dwell": e["stiction_rise"], "dwell_time": e["time_constant"], "dwell_slip": e["slip"]},
    ),
    "end_stop": (
        {"position": _NAN, "stiffness": _NAN, "side": 1.0},  # side +1: upper end, -1: lower end
        lambda e, _: {"stop": e["position"], "stop_stiffness": e["stiffness"], "stop_side": e["side"]},
    ),
    "step_change": (
        {"step": _NAN, "time": _NAN, "both": 0.0},  # both 1: the whole dry level steps, 0: F_c alone (effects.md)
        lambda e, _: {"step": e["step"], "step_time": e["time"], "step_both": e["both"]},
    ),
}

# Physics no catalogue name describes; external forces and bursts are time series, see foreign.py.
FOREIGN = {
    "root_drag": ({"coefficient": _NAN}, lambda e, _: {"root_drag": e["coefficient"]}),  # c sqrt|v| s
    "frictional_lag": ({"time_constant": _NAN}, lambda e, _: {"memory": e["time_constant"]}),  # level sees |v| late
    "cable_hysteresis": (
        {"force": _NAN, "travel": _NAN},
        lambda e, _: {"cable": e["force"], "cable_travel": e["travel"]},
    ),
    "shear_thinning": (
        {"coefficient": _NAN, "speed": _NAN},
        lambda e, _: {"shear": e["coefficient"], "shear_speed": e["speed"]},
    ),
    "detent": (  # even, local in position: a magnet, a bent rail; potential A exp(-u^2/2)
        {"force": _NAN, "centre": _NAN, "width": _NAN},
        lambda e, _: {"dent": e["force"], "dent_centre": e["centre"], "dent_width": e["width"]},
    ),
    "level_ripple": (  # odd, periodic in position: recirculating balls; factor 1 + a cos(2 pi y / period)
        {"relative_amplitude": _NAN, "period": _NAN},
        lambda e, _: {"level_ripple": e["relative_amplitude"], "level_ripple_wave": _TURN / e["period"]},
    ),
    "one_way_friction": (  # more dry friction upwards only while sliding fast: a scraper that lifts off
        {"force": _NAN},
        lambda e, _: {"one_way": e["force"]},
    ),
}

# Same physics, another author's curve. First word is the effect it belongs to.
SHAPES = {
    "rail_defect": {"gauss": {}, "raised_cosine": {"bump_shape": 1.0}, "plateau": {"bump_shape": 2.0}},
    "position_dependent_friction": {"line": {}, "arc": {"level_shape": 1.0}},
    "torque_ripple": {"cosine": {}, "second_harmonic": {"ripple_second": 0.2}},
    "load_dependent_friction": {"line": {}, "rounded": {"load_friction_knee": 0.05}},
    "thermal_drift": {"exponential": {}, "hyperbolic": {"drop_shape": 1.0}, "two_rates": {"drop_shape": 2.0}},
    "quadratic_drag": {"square": {}, "power_1.8": {"drag_power": 1.8}},
    "position_spring": {"line": {}, "hardening": {"spring_cubic": 0.3}},
    "actuator_lag": {"first_order": {}, "second_order": {"lag_order": 2.0}},
    "torque_saturation": {"hard": {}, "rounded": {"limit_knee": 0.03}},
    "dwell_time_stiction": {"exponential": {}, "logarithm": {"dwell_shape": 1.0}, "by_slip": {"dwell_level": 1.0}},
    "end_stop": {"line": {}, "hertz": {"stop_power": 1.5}},
    "step_change": {"sudden": {}, "ramp": {"step_ramp": 0.4}, "both_levels": {"step_both": 1.0}},
}
