"""Machines at random: linear and rotary axes from grams to half a ton, their friction, drive and recording."""

from dataclasses import dataclass

import numpy as np

from .machine import HELD, MEAN
from .motion import log_uniform, uniform

TWO_MASS = {"backlash", "transmission_compliance"}
WANTS_HELD = {"actuator_lag", "dead_time", "torque_saturation"}
WANTS_FAST = TWO_MASS | {"presliding_hysteresis", "pendulum", "dwell_time_stiction"}
BANDWIDTHS = {"actuator_lag": 2.6, "dead_time": 4.0, "pendulum": 10.0, **dict.fromkeys(TWO_MASS, 6.0)}  # Hz at most
GRAVITY = 9.81  # m/s²


@dataclass
class Plant:
    """A machine and how it is recorded; SI, rotary axes N·m, rad, kg·m².

    Attributes:
        axis: vertical, horizontal, rotary.
        mass: all that moves. [kg]
        motor_share: of `mass` that turns with the motor. [1]
        pulley: R_c. [m]
        motor_radius: R_m; the ripple draws its own. [m]
        force_per_torque: at the axis. [1/m]
        v_max, a_max: of what is commanded. [m/s], [m/s²]
        low, high: ends of the stroke. [m]
        coulomb, static, stribeck, stribeck_exponent, viscous: friction. [N], [N], [m/s], [1], [N·s/m]
        reported: what the drive reports, `machine.HELD`, `MEAN` or `POINT`.
        sample_period, drive_period: [s]
        duration: of a recording. [s]
        motor_side: the position is read at the motor (two masses).
        stroke: of what is commanded in fact, known once motions are drawn. [m]
        peak_force: of the machine without anything hidden, known once it ran. [N]
    """

    axis: str
    mass: float
    motor_share: float
    pulley: float
    motor_radius: float
    force_per_torque: float
    v_max: float
    a_max: float
    low: float
    high: float
    coulomb: float
    static: float
    stribeck: float
    stribeck_exponent: float
    viscous: float
    reported: int
    sample_period: float
    drive_period: float
    substeps: int
    duration: float
    motor_side: bool = False
    stroke: float = 0.0
    peak_force: float = 0.0

    @property
    def rotary(self) -> bool:
        """Turns."""
        return self.axis == "rotary"

    @property
    def M(self) -> float:
        """Mass of the load. [kg]"""
        return 0.0 if self.rotary else self.mass * (1 - self.motor_share)

    @property
    def J(self) -> float:
        """Inertia at the motor. [kg·m²]"""
        return self.mass * self.motor_share * self.pulley**2

    @property
    def weight(self) -> float:
        """M g on a vertical axis. [N]"""
        return self.M * GRAVITY if self.axis == "vertical" else 0.0

    @property
    def per_sample(self) -> int:
        """Periods of the drive in a sample."""
        return round(self.sample_period / self.drive_period)


def draw_plant(rng, effects: set[str], variant: int) -> Plant:
    """A machine on which `effects` can show."""
    axis = _draw_axis(rng, effects, variant)
    speeding = uniform(rng, 0.12, 0.4)  # s to full speed
    if axis == "rotary":
        mass = log_uniform(rng, 0.002, 4)
        v_max = log_uniform(rng, 3, 20)
        stroke = uniform(rng, 3, 9) * max(1.0, v_max / 8)
        pulley, share, force_per_torque = 1.0, 1.0, 1.0
        gear = float(rng.choice([1, 3, 5, 10]))
        low = -uniform(rng, 0.3, 0.7) * stroke
    else:
        mass = log_uniform(rng, 1.5, 450)
        v_max = log_uniform(rng, 0.2, 1.3)
        stroke = uniform(rng, 0.9, 2.2) * max(0.35, v_max)
        share = uniform(rng, 0.15, 0.45)
        pulley = uniform(rng, 0.02, 0.06)
        gear = float(rng.choice([1, 1, 2, 3, 5]))
        if "pulley_eccentricity" in effects:
            pulley = stroke / uniform(rng, 30, 50)
        force_per_torque = gear / pulley
        low = uniform(rng, 0, 0.3) if rng.random() < 0.7 else -stroke / 2
    a_max = v_max / speeding
    coulomb = mass * a_max * uniform(rng, 0.25, 0.9)
    static = coulomb * uniform(rng, 1.03, 1.45)
    stribeck = v_max * log_uniform(rng, 0.015, 0.1)
    exponent = float(rng.choice([1.0, 1.0, 0.8, 1.3]))
    viscous = coulomb / v_max * uniform(rng, 0.25, 0.9)
    if effects & {"viscous_asymmetry", "thermal_drift"}:
        viscous = coulomb / v_max * uniform(rng, 0.7, 1.2)
    reported, sample_period, drive_period = _draw_recording(rng, effects)
    step = 25e-6 if effects & TWO_MASS else 50e-6
    return Plant(
        axis, mass, share, pulley, pulley / gear, force_per_torque, v_max,
        min(a_max, 6.0) if axis == "vertical" else a_max, low, low + stroke, coulomb, static, stribeck, exponent,
        viscous, reported, sample_period, drive_period, int(np.ceil(drive_period / step - 1e-9)),
        float(rng.choice([40, 60, 60, 90, 110])) if sample_period > 0.0015 else float(rng.choice([30, 40, 60])),
        stroke=stroke,
    )  # fmt: skip


def _draw_axis(rng, effects, variant):
    if effects & {"force_offset", "coulomb_asymmetry", "torque_scale_error"}:
        return "vertical"
    if effects & TWO_MASS:
        return "horizontal" if "backlash" in effects or rng.random() < 0.6 else "vertical"
    if "pendulum" in effects:
        return "horizontal"
    if effects == {"inertia_error"} and variant == 0:
        return "vertical"
    if effects & {"presliding_hysteresis", "torque_ripple"} and len(effects) == 1 and variant == 0:
        return str(rng.choice(["horizontal", "vertical"]))
    return str(rng.choice(["horizontal", "horizontal", "vertical", "rotary", "rotary"]))


def _draw_recording(rng, effects):
    """What is reported, the period of the recording and that of the drive. [s]"""
    reported = drawn = int(rng.choice([0, 0, 0, 0, 0, 1, 1, 2, 2]))
    if reported == HELD:
        sample = drive = float(rng.choice([0.01, 0.005, 0.004, 0.002, 0.001]))
    elif reported == MEAN:
        sample, drive = float(rng.choice([0.01, 0.005, 0.002])), 0.001
    else:
        sample, drive = float(rng.choice([0.002, 0.001])), 0.00025
    if effects & WANTS_HELD:
        reported = HELD
        sample = drive = float(rng.choice([0.004, 0.002, 0.001]))
    if effects & WANTS_FAST and sample > 0.005:
        sample = 0.004 if drawn == HELD else 0.005
        drive = 0.004 if drawn == HELD else 0.001
    return reported, sample, drive


def base_values(rng, plant: Plant, effects: set[str]) -> dict[str, float]:
    """Fields of the record without anything hidden: friction, and a cascade whose bandwidth suits its period."""
    current_time = 0 if plant.reported == HELD else uniform(rng, 0.0003, 0.0006)
    bandwidth = min(30.0, 0.045 / plant.drive_period) * uniform(rng, 0.6, 1.1)  # Hz of the speed loop
    bandwidth = min([bandwidth, *(most for name, most in BANDWIDTHS.items() if name in effects)])
    gain = plant.mass * 2 * np.pi * bandwidth
    return {
        "coulomb": plant.coulomb, "static": plant.static, "stribeck": plant.stribeck,
        "stribeck_exponent": plant.stribeck_exponent, "viscous": plant.viscous, "weight": plant.weight,
        "motor_mass": plant.mass, "torque_scale": 1.0, "bump_left": 1, "bump_right": 1, "current_time": current_time,
        "speed_gain": gain, "integral_gain": gain * 2 * np.pi * bandwidth / 6,
        "position_gain": 2 * np.pi * bandwidth / 5, "speed_filter": min(0.003, 0.25 / (2 * np.pi * bandwidth)),
        "mass_forward": plant.mass * uniform(rng, 0.7, 1.0), "weight_forward": plant.weight,
        "friction_forward": plant.coulomb * rng.choice([0, 0.7]),
        "integral_limit": 6 * plant.coulomb + plant.mass * plant.a_max, "command_limit": 1e9,
        "smooth_speed": 0.03 * plant.v_max, "dead_band": 2e-4 * plant.stroke,
    }  # fmt: skip
