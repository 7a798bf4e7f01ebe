"""Machines, effects and motions at random: every parameter drawn anew, sizes relative to what the machine does."""

import math
from dataclasses import dataclass, replace

import numpy as np

from .control import CASCADE, PD, RELAY, Loop
from .excitation import Motion, Torque, journey, multisine, saw, sine, square, staircase, stamps, two_squares, wave
from .machine import run
from .parameters import SHAPES, ReferencePlant

OPEN_KINDS = ("sine", "multisine", "square", "two_squares", "saw", "staircase")
CLOSED_KINDS = ("loop_trapezoid", "loop_scurve", "loop_sine", "loop_cycle", "loop_relay")
SLOW_LOOP = {"actuator_lag": "time_constant", "dead_time": "delay"}
TWO_MASS = ("backlash", "transmission_compliance")
SLOWEST = 1e-3  # m/s


@dataclass(frozen=True)
class Facts:
    """What a machine does in a nominal run, to size effects by: travel [m], speed [m/s], force [N], duration [s]."""

    low: float
    high: float
    speed: float
    peak: float
    swing: float
    duration: float

    @classmethod
    def of(cls, truth):
        """Facts of a run by `machine.run`."""
        y, force = truth["position"], truth["force_command"]
        fast = float(np.quantile(np.abs(truth["velocity"]), 0.95))
        fast = max(fast, SLOWEST)  # of a machine that stands still
        return cls(float(y.min()), float(y.max()), fast, float(np.abs(force).max()), float(np.ptp(force)) / 2,
                   float(truth["t"][-1]))  # fmt: skip

    @property
    def half(self):
        """Half the travel. [m]"""
        return max(0.5 * (self.high - self.low), 1e-6)

    @property
    def middle(self):
        """Middle of the travel. [m]"""
        return 0.5 * (self.high + self.low)


def draw_plant(rng, orientation: str = "vertical") -> ReferencePlant:
    """A machine with every constant drawn anew; a rotary one is a linear one seen through a lever."""
    mass = rng.uniform(15, 40)
    motor_share, Rc = rng.uniform(0.12, 0.4), rng.uniform(0.02, 0.08)
    coulomb = rng.uniform(40, 110)
    known_gain = rng.random() < 0.5
    plant = ReferencePlant(
        M=mass * (1 - motor_share), J=mass * motor_share * Rc**2, Rc=Rc,
        Rm=rng.uniform(0.008, 0.025), force_per_torque=rng.uniform(40, 140) if known_gain else None,
        orientation=orientation, coulomb_force=coulomb, static_force=coulomb * rng.uniform(0.9, 1.6),
        stribeck_velocity=math.exp(rng.uniform(math.log(0.02), math.log(0.15))),
        viscous_coefficient=rng.uniform(60, 240),
    )  # fmt: skip
    if orientation != "rotary":
        return plant
    lever, share = math.exp(rng.uniform(math.log(0.02), math.log(0.3))), math.exp(rng.uniform(math.log(0.01), 0.0))
    torque = lever * share
    return replace(
        plant, M=0.0, J=mass * lever**2 * share, Rc=1.0, Rm=1.0, force_per_torque=1.0,
        coulomb_force=coulomb * torque, static_force=plant.static_force * torque,
        stribeck_velocity=plant.stribeck_velocity / lever,
        viscous_coefficient=plant.viscous_coefficient * lever * torque,
    )  # fmt: skip


def length_unit(plant) -> float:
    """1 m on a linear machine; as many rad on a rotary one as its lever makes of a metre."""
    if plant.orientation != "rotary":
        return 1.0
    return plant.stribeck_velocity / 0.06  # Stribeck speed of a typical linear machine is 0.06 m/s


def draw_effect(rng, name, plant, facts, size=1.0) -> dict:
    """Parameters of one effect; size 1 = 8-15 % of the dry friction (or what the docstring of the line says)."""
    sign = rng.choice([-1.0, 1.0])
    f, u, metre = plant.coulomb_force * size, rng.uniform(0.8, 1.25), length_unit(plant)
    share, mass, duration = rng.uniform(0.08, 0.15) * size, plant.moving_mass, facts.duration
    inside = facts.middle + rng.uniform(-0.7, 0.7) * facts.half
    load = mass if plant.orientation == "rotary" else plant.M
    soft = 2 * math.pi * rng.uniform(5, 12) / math.sqrt(size)
    gear = 2 * math.pi * plant.Rm / rng.choice([1, 2, 6])
    relative = rng.random() < 0.25
    draw = {
        "force_offset": lambda: {"force": sign * share * plant.coulomb_force},
        "coulomb_asymmetry": lambda: {"asymmetry_ratio": sign * share},
        "viscous_asymmetry": lambda: {"asymmetry_ratio": sign * 0.2 * size * u},
        "position_dependent_friction": lambda: {
            "relative_slope": sign * 1.2 * share / facts.half, "middle": facts.middle
        },
        "rail_defect": lambda: {
            "amplitude": (1.0 if rng.random() < 0.8 else -0.5) * rng.uniform(0.15, 0.4) * f,
            "centre": inside, "width": rng.uniform(0.02, 0.12) * facts.half,
        },
        "presliding_hysteresis": lambda: _bristles(rng, plant, plant.static_force / (1e-3 * size * u * metre)),
        "backlash": lambda: {"gap": 2e-3 * size * u * metre},
        "transmission_compliance": lambda: {
            "stiffness": load * soft**2, "damping": 2 * rng.uniform(0.02, 0.1) * load * soft
        },
        "torque_ripple": lambda: {
            "period": gear, "phase": rng.uniform(0, 2 * math.pi),
            **({"relative_amplitude": 0.08 * size * u} if relative else {"amplitude": share * plant.coulomb_force}),
        },
        "pulley_eccentricity": lambda: {"relative_eccentricity": 0.08 * size * u, "phase": rng.uniform(0, 2 * math.pi)},
        "load_dependent_friction": lambda: {"coefficient": 0.12 * size * u},
        "thermal_drift": lambda: {
            "relative_drop": rng.uniform(0.3, 0.6) * size, "time_constant": rng.uniform(0.25, 1.0) * duration
        },
        "quadratic_drag": lambda: {"coefficient": rng.uniform(0.2, 0.4) * f / facts.speed**2},
        "position_spring": lambda: {
            "stiffness": sign * 1.3 * share * plant.coulomb_force / facts.half, "rest_position": inside
        },
        "inertia_error": lambda: {
            "mass_error": sign * 0.15 * size * u * mass, "payload": float(plant.orientation == "vertical" and sign > 0)
        },
        "torque_scale_error": lambda: {"relative_error": sign * 0.1 * size * u},
        "actuator_lag": lambda: {"time_constant": 0.03 * size * u},
        "dead_time": lambda: {"delay": 0.03 * size * u},
        "torque_saturation": lambda: {
            "limit": (1 - 0.12 * size * u * facts.swing / facts.peak) * facts.peak / plant.gain
        },
        "dwell_time_stiction": lambda: {
            "stiction_rise": rng.uniform(0.3, 0.6) * f, "time_constant": rng.uniform(0.2, 2)
        },
        "end_stop": lambda: _stop(rng, plant, facts, f),
        "step_change": lambda: {
            "step": sign * 1.2 * share * plant.coulomb_force, "time": rng.uniform(0.2, 0.8) * duration
        },
    }  # fmt: skip
    return {key: float(value) for key, value in draw[name]().items()}


def _bristles(rng, plant, stiffness):
    return {
        "bristle_stiffness": stiffness,
        "bristle_damping": 2 * rng.uniform(0.2, 0.8) * math.sqrt(stiffness * plant.moving_mass),
    }


def _stop(rng, plant, facts, f):
    side = rng.choice([-1.0, 1.0])
    depth = rng.uniform(0.05, 0.15) * facts.half
    edge = facts.high - depth if side > 0 else facts.low + depth
    return {"position": edge, "stiffness": rng.uniform(1.0, 4.0) * f / depth, "side": side}


def draw_shapes(rng, effects) -> dict[str, str]:
    """Another author's curve for each effect that has one."""
    return {name: str(rng.choice(list(SHAPES[name])[1:])) for name in effects if name in SHAPES}


def draw_outside(rng, name, plant, facts, size=1.0) -> dict:
    """Parameters of physics outside the catalogue that lives in the equations."""
    f, u = plant.coulomb_force * size, rng.uniform(0.8, 1.25)
    inside = facts.middle + rng.uniform(-0.6, 0.6) * facts.half
    draw = {
        "cable_hysteresis": {"force": 0.15 * f * u, "travel": 0.15 * facts.half * u},
        "root_drag": {"coefficient": 0.3 * f * u / math.sqrt(facts.speed)},
        "shear_thinning": {"coefficient": 1.5 * f * u / facts.speed, "speed": 0.2 * facts.speed},
        "frictional_lag": {"time_constant": 0.03 * size * u},
        "detent": {"force": 0.3 * f * u, "centre": inside, "width": rng.uniform(0.03, 0.12) * facts.half},
        "level_ripple": {"relative_amplitude": 0.15 * size * u, "period": rng.uniform(0.07, 0.4) * facts.half},
        "one_way_friction": {"force": 0.2 * f * u},
    }
    return {key: float(value) for key, value in draw[name].items()}


def draw_excitation(rng, kind, plant, duration, period, *, travel=None, cautious=0.0):
    """An excitation of `kind` that moves the plain machine over about `travel` [m] (open loop: amplitude searched).

    `cautious`: delay or lag hidden in the drive [s], which a commissioning engineer would have tuned the loop for.
    """
    travel = rng.uniform(0.2, 0.5) * length_unit(plant) if travel is None else travel
    if kind in CLOSED_KINDS:
        return _draw_motion(rng, kind, plant, stamps(duration, min(period, 1e-3)), travel, cautious)
    t = stamps(duration, period)
    shape = _draw_wave(rng, kind, t)
    if kind == "staircase":
        travel *= 2.0  # it wanders; its strokes are shorter than its travel
    low, high = 0.0, 12 * plant.unit_force
    for _ in range(14):
        amplitude = 0.5 * (low + high)
        y = run(plant, _about_weight(plant, t, amplitude * shape), step=1e-3)["position"]
        low, high = (amplitude, high) if np.ptp(y - np.linspace(y[0], y[-1], len(y))) < travel else (low, amplitude)
    return _about_weight(plant, t, 0.5 * (low + high) * shape)


def _about_weight(plant, t, force):
    return Torque(t, (plant.weight + force) / plant.gain)


def _draw_wave(rng, kind, t):
    f = rng.uniform(0.15, 0.5)
    if kind == "multisine":
        frequencies = f * np.array([1.0, rng.uniform(2.4, 3.6), rng.uniform(5.5, 8.5)]) * 0.7
        phases = rng.uniform(0, 2 * math.pi, 3)
        return multisine(t, (1.0, 0.7, 0.5), frequencies, phases, rng.uniform(0.1, 0.4))
    if kind == "staircase":
        return staircase(t, 1.0, rng)
    if kind == "two_squares":
        return two_squares(t, (0.6, 0.4), (f, f * rng.uniform(1.6, 2.6)))
    return {"sine": sine, "square": square, "saw": saw}[kind](t, 1.0, f)


def _draw_motion(rng, kind, plant, t, travel, cautious):
    mass, metre = plant.moving_mass, length_unit(plant)
    omega = 2 * math.pi * rng.uniform(2.0, 5.0)
    if cautious:
        omega = min(omega, 0.25 / cautious)
    common = {"bias": plant.weight, "period": float(t[1] - t[0]), "limit": 12 * plant.unit_force + 2 * plant.weight,
              "smoothing": rng.uniform(1e-3, 4e-3), "mass": mass * rng.choice([0.0, 1.0])}  # fmt: skip
    if kind == "loop_relay":
        push = 1.3 * plant.unit_force + 0.4 * plant.viscous_coefficient * metre
        loop = Loop(RELAY, stiffness=push, bias=plant.weight, period=common["period"])
        return Motion(t, np.zeros_like(t), np.full_like(t, 0.3 * travel), np.zeros_like(t), loop)
    if rng.random() < 0.5:
        loop = Loop(PD, stiffness=mass * omega**2, damping=2 * rng.uniform(0.7, 1.0) * mass * omega, **common)
    else:
        speed = mass * 2 * omega
        loop = Loop(CASCADE, stiffness=omega / 2, damping=speed, integral=speed * omega / 4, **common)
    if kind == "loop_sine":
        return Motion(t, *wave(t, travel / 2, rng.uniform(0.1, 0.4)), loop)
    speeds = metre * np.array([0.06, 0.12, 0.2, 0.35, 0.5]) * rng.uniform(0.7, 1.3)
    accelerations = [metre * rng.uniform(0.8, 2.5)]
    if kind == "loop_cycle":
        goals, dwells = travel * np.array([0.5, 0.2, -0.5, -0.1]), rng.uniform(0.3, 1.5, 4)
        return Motion(t, *journey(t, goals, speeds[[3, 1, 4, 2]], accelerations, dwells, smooth=True), loop)
    goals = travel * np.array([0.5, -0.5])
    order, dwells = rng.permutation(speeds), rng.uniform(0.3, 2.0, 5)
    return Motion(t, *journey(t, goals, order, accelerations, dwells, smooth=kind == "loop_scurve"), loop)
