"""What can be hidden of the catalogue, each of a free size: fields of the record, true parameters, whose curve."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from .motion import log_uniform, uniform
from .plants import GRAVITY, Plant

Span = tuple[float, float]  # of the commanded positions [m]


@dataclass(frozen=True)
class Sized:
    """Something hidden, of one size.

    Attributes:
        fields: of the record that the compiled machine reads.
        parameters: true values under the names and in the units of the diagnosis' contract; rotary: N·m, rad.
        details: what else there is to know about it.
        shape: the name of the curve where it is not the catalogue's formula, else "".
    """

    fields: dict[str, float]
    parameters: dict[str, float]
    details: dict[str, float] = field(default_factory=dict)
    shape: str = ""


@dataclass(frozen=True)
class Hidden:
    """Something hidden whose size is free: the size to try first, the largest, and what a size means."""

    first: float
    most: float
    of: Callable[[float], Sized]


def draw_effect(rng, name: str, plant: Plant, span: Span, variant: int) -> Hidden:
    """Draw what is hidden but its size; `torque_ripple` sets the gear of `plant` to its period."""
    return EFFECTS[name](rng, float(rng.choice([-1, 1])), plant, span, variant)


def _force_offset(rng, sign, plant, span, variant):
    def of(s):
        return Sized({"offset": sign * s * plant.coulomb}, {"force": sign * s * plant.coulomb})

    return Hidden(0.2, 2.0, of)


def _coulomb_asymmetry(rng, sign, plant, span, variant):
    return Hidden(0.2, 0.4, lambda s: Sized({"dry_asymmetry": sign * s}, {"asymmetry_ratio": sign * s}))


def _viscous_asymmetry(rng, sign, plant, span, variant):
    return Hidden(0.3, 0.6, lambda s: Sized({"viscous_asymmetry": sign * s}, {"asymmetry_ratio": sign * s}))


def _position_dependent_friction(rng, sign, plant, span, variant):
    middle = 0.5 * (span[0] + span[1])

    def of(s):
        slope = sign * s / (plant.stroke / 2)
        return Sized({"level_slope": slope, "level_middle": middle}, {"relative_slope": slope}, {"middle": middle})

    return Hidden(0.3, 0.9, of)


def _rail_defect(rng, sign, plant, span, variant):
    centre = uniform(rng, span[0] + 0.25 * plant.stroke, span[1] - 0.3 * plant.stroke)
    width = plant.stroke * log_uniform(rng, 0.012, 0.05)
    skew = uniform(rng, 0.7, 1.4)

    def of(s):
        high, left, right = s * plant.coulomb, width * skew, width / skew
        fields = {"bump": high, "bump_centre": centre, "bump_left": left, "bump_right": right}
        mean = width * (skew + 1 / skew) / 2
        parameters = {"amplitude": high, "centre": centre, "width": mean}
        return Sized(fields, parameters, {"width_left": left, "width_right": right}, "skewed_gauss")

    return Hidden(0.5, 2.0, of)


def _presliding_hysteresis(rng, sign, plant, span, variant):
    def of(s):
        travel = max(s, 0.6) * 1e-3 * plant.stroke
        stiffness = plant.static / travel
        damping = (0.15 if variant else 0.5) * np.sqrt(stiffness * plant.mass)
        fields = {"bristle_law": 2 if variant else 1, "bristle_stiffness": stiffness, "bristle_damping": damping}
        parameters = {"bristle_stiffness": stiffness, "bristle_damping": float(damping)}
        return Sized(fields, parameters, {"presliding_travel": travel}, "maxwell_slip" if variant else "")

    return Hidden(2.0, 12.0, of)


def _two_masses(rng, plant):
    """Both masses [kg], the reduced one [kg], resonance of the belt [Hz], damping ratio [1], fields of the record."""
    motor = plant.mass * plant.motor_share
    load = plant.mass - motor
    resonance, damping_ratio = uniform(rng, 6, 14), uniform(rng, 0.04, 0.1)
    fields = {"motor_mass": motor, "load_mass": load, "motor_friction_share": 0.08,
              "motor_side": 1 if plant.motor_side else 0}  # fmt: skip
    return motor * load / plant.mass, resonance, damping_ratio, fields


def _backlash(rng, sign, plant, span, variant):
    reduced, _, _, masses = _two_masses(rng, plant)
    contact = reduced * (2 * np.pi * 70) ** 2

    def of(s):
        gap = max(s, 0.8) * 2e-3 * plant.stroke
        fields = {"two_mass": 2, "belt_stiffness": contact, "belt_damping": 2 * 0.5 * np.sqrt(contact * reduced)}
        return Sized(masses | fields | {"gap": gap}, {"gap": gap}, {"contact_stiffness": contact}, "soft_contact")

    return Hidden(1.0, 6.0, of)


def _transmission_compliance(rng, sign, plant, span, variant):
    reduced, resonance, damping_ratio, masses = _two_masses(rng, plant)

    def of(s):
        stiffness = reduced * (2 * np.pi * resonance) ** 2 / s
        damping = float(2 * damping_ratio * np.sqrt(stiffness * reduced))
        fields = {"two_mass": 1, "belt_stiffness": stiffness, "belt_damping": damping}
        known = {"free_resonance_hz": float(resonance / np.sqrt(s))}
        return Sized(masses | fields, {"stiffness": stiffness, "damping": damping}, known)

    return Hidden(1.0, 4.0, of)


def _torque_ripple(rng, sign, plant, span, variant):
    period = max(plant.stroke * uniform(rng, 0.03, 0.09), plant.v_max / 18)
    teeth = int(rng.choice([1, 2, 3, 4, 6]))
    phase, second = uniform(rng, 0, 6.28), uniform(rng, 0.08, 0.2)
    plant.motor_radius = period * teeth / (2 * np.pi)  # the gear that makes it `teeth` periods per motor turn
    if not plant.rotary:
        plant.force_per_torque = 1 / plant.motor_radius

    def of(s):
        high = s * plant.coulomb
        fields = {"ripple": high, "ripple_period": period, "ripple_phase": phase, "ripple_second": second}
        known = {"teeth": teeth, "phase": phase, "second_harmonic": second}
        return Sized(fields, {"period": period, "amplitude": high}, known, "second_harmonic")

    return Hidden(0.25, 0.8, of)


def _pulley_eccentricity(rng, sign, plant, span, variant):
    period, phase = 2 * np.pi * plant.pulley, uniform(rng, 0, 6.28)

    def of(s):
        fields = {"eccentricity": s, "eccentricity_period": period, "eccentricity_phase": phase}
        return Sized(fields, {"relative_eccentricity": s, "period": period}, {"phase": phase})

    return Hidden(0.12, 0.3, of)


def _load_dependent_friction(rng, sign, plant, span, variant):
    return Hidden(0.15, 0.4, lambda s: Sized({"load_friction": s}, {"coefficient": s}))


def _thermal_drift(rng, sign, plant, span, variant):
    time = plant.duration * uniform(rng, 0.12, 0.3)

    def of(s):
        power = 0.7 * plant.coulomb * plant.v_max * 0.4
        fields = {"drop": s, "drop_time": time, "heating": variant, "heat_power": power}
        return Sized(fields, {"relative_drop": s, "time_constant": time}, {}, "dissipation" if variant else "")

    return Hidden(0.6, 3.0, of)


def _quadratic_drag(rng, sign, plant, span, variant):
    def of(s):
        coefficient = s * plant.coulomb / plant.v_max**2
        return Sized({"drag": coefficient}, {"coefficient": coefficient})

    return Hidden(0.6, 4.0, of)


def _position_spring(rng, sign, plant, span, variant):
    rest = uniform(rng, span[0], span[1])

    def of(s):
        stiffness = sign * s * 2 * plant.coulomb / plant.stroke
        return Sized({"spring": stiffness, "spring_rest": rest}, {"stiffness": stiffness, "rest_position": rest})

    return Hidden(0.3, 2.0, of)


def _inertia_error(rng, sign, plant, span, variant):
    """More mass, or less; on a vertical axis it weighs."""

    def of(s):
        error = s * plant.mass if sign > 0 else -s * plant.mass * 0.6
        fields = {"motor_mass": plant.mass + error}
        if plant.axis == "vertical":
            fields["weight"] = plant.weight + GRAVITY * error
        return Sized(fields, {"mass_error": error}, {"payload": plant.axis == "vertical"})

    return Hidden(0.15, 0.6, of)


def _torque_scale_error(rng, sign, plant, span, variant):
    return Hidden(0.12, 0.3, lambda s: Sized({"torque_scale": 1 + sign * s}, {"relative_error": sign * s}))


def _actuator_lag(rng, sign, plant, span, variant):
    return Hidden(1.0, 2.0, lambda s: Sized({"lag": s * 0.015}, {"time_constant": s * 0.015}))


def _dead_time(rng, sign, plant, span, variant):
    """The force comes late, or the position is reported late."""
    chain, shape = ("reading_delay", "late_position") if variant == 1 else ("delay", "")
    return Hidden(1.0, 2.0, lambda s: Sized({chain: s * 0.012}, {"delay": s * 0.012}, {}, shape))


def _torque_saturation(rng, sign, plant, span, variant):
    def of(s):
        limit = plant.peak_force * (1 - 0.45 * s / (1 + s))
        fields = {"limit": limit, "integral_limit": 1.5 * plant.peak_force}
        return Sized(fields, {"limit": limit / plant.force_per_torque}, {"limit_force": limit}, "soft_shoulder")

    return Hidden(0.5, 3.0, of)


def _dwell_time_stiction(rng, sign, plant, span, variant):
    """A rest raises the whole dry level, not only where it breaks away; sliding rubs it off as a Gaussian."""
    time, logarithm = log_uniform(rng, 0.3, 1.5), int(rng.random() < 0.4)
    slip = 2e-3 * plant.stroke if plant.rotary else min(1.0e-3 * max(1, plant.stroke / 1.0), 2e-3)

    def of(s):
        rise = s * plant.coulomb
        fields = {"dwell": rise, "dwell_time": time, "dwell_logarithm": logarithm, "dwell_slip": slip}
        shape = "logarithm" if logarithm else "gaussian_slip"
        return Sized(fields, {"stiction_rise": rise, "time_constant": time}, {"slip": slip}, shape)

    return Hidden(0.8, 3.0, of)


def _end_stop(rng, sign, plant, span, variant):
    depth = uniform(rng, 0.02, 0.05) * plant.stroke
    place = span[1] - depth if sign > 0 else span[0] + depth
    damping = 0.3 / plant.v_max  # s/m, Hunt and Crossley

    def of(s):
        stiffness = s * 2 * plant.coulomb / depth
        fields = {"stop": place, "stop_stiffness": stiffness, "stop_side": sign, "stop_damping": damping}
        known = {"side": sign, "stop_damping": damping}
        return Sized(fields, {"position": place, "stiffness": stiffness}, known, "hunt_crossley")

    return Hidden(0.7, 4.0, of)


def _step_change(rng, sign, plant, span, variant):
    """Up, or at times down; a ramp of 0.2 s of the whole dry level."""
    time, down = plant.duration * uniform(rng, 0.22, 0.42), rng.random() < 0.3

    def of(s):
        step = (-1 if down else 1) * min(s, 0.7 if down else 9) * plant.coulomb
        return Sized({"step": step, "step_time": time, "step_ramp": 0.2}, {"step": step, "time": time}, {}, "ramp")

    return Hidden(0.25, 1.5, of)


EFFECTS = {
    "force_offset": _force_offset,
    "coulomb_asymmetry": _coulomb_asymmetry,
    "viscous_asymmetry": _viscous_asymmetry,
    "position_dependent_friction": _position_dependent_friction,
    "rail_defect": _rail_defect,
    "presliding_hysteresis": _presliding_hysteresis,
    "backlash": _backlash,
    "transmission_compliance": _transmission_compliance,
    "torque_ripple": _torque_ripple,
    "pulley_eccentricity": _pulley_eccentricity,
    "load_dependent_friction": _load_dependent_friction,
    "thermal_drift": _thermal_drift,
    "quadratic_drag": _quadratic_drag,
    "position_spring": _position_spring,
    "inertia_error": _inertia_error,
    "torque_scale_error": _torque_scale_error,
    "actuator_lag": _actuator_lag,
    "dead_time": _dead_time,
    "torque_saturation": _torque_saturation,
    "dwell_time_stiction": _dwell_time_stiction,
    "end_stop": _end_stop,
    "step_change": _step_change,
}
