"""Machines at random and what they recorded, from the reference simulator: it shares no code with the fitter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from plant.axis import Axis, Drive, Mechanics, TorqueHold
from plant.friction import StribeckFriction
from plant.recording import Recording
from tests.reference.control import Loop
from tests.reference.excitation import Motion, Torque, journey, multisine, sine, stamps
from tests.reference.machine import run
from tests.reference.parameters import ReferencePlant

GAIN = 100.0  # N per N·m
RATED = 800.0  # N
FRICTION = ("coulomb_force", "static_force", "stribeck_velocity", "viscous_coefficient")


@dataclass(frozen=True)
class Setting:
    """What is recorded, and with which errors.

    Attributes:
        excitation: "sine", "multi" (three sines) or "loop" (PD loop, trapezoids with dwells).
        noise: white position noise. [m]
        coloured: correlation time of position noise of the same size instead of white. [s] 0 = white
        dirt: rms of a force nobody modelled (Ornstein-Uhlenbeck), over F_c. [1]
        dirt_time: its correlation time. [s]
        dirt_on: "force" (added force) or "level" (the friction level itself fluctuates).
        linear: torque straight between samples instead of held.
        mass_known: False: the axis file's mass is wrong by up to a factor of two.
        samples, period: of the recording. [1], [s]
        offset: largest constant force. [N]
    """

    excitation: str = "multi"
    noise: float = 1e-4
    coloured: float = 0.0
    dirt: float = 0.005
    dirt_time: float = 0.1
    dirt_on: str = "force"
    linear: bool = False
    mass_known: bool = True
    samples: int = 2000
    period: float = 0.01
    offset: float = 3.0


@dataclass(frozen=True)
class Case:
    """One recording, the axis file's view of the machine, the truth by parameter name, and the true velocity [m/s]."""

    axis: Axis
    recording: Recording
    truth: dict[str, float]
    velocity: np.ndarray

    @property
    def law(self) -> StribeckFriction:
        """True friction."""
        return StribeckFriction(*(self.truth[name] for name in FRICTION))


def coloured_noise(n: int, period: float, time: float, rng: Generator) -> np.ndarray:
    """Ornstein-Uhlenbeck series of unit variance and correlation `time` [s]; white where that is 0. (n,)"""
    white = rng.standard_normal(n)
    if time == 0.0:
        return white
    phi = np.exp(-period / time)
    white[1:] *= np.sqrt(1.0 - phi**2)
    for k in range(1, n):
        white[k] += phi * white[k - 1]
    return white


def draw_plant(rng: Generator, offset: float) -> ReferencePlant:
    """A machine within the ranges of the method study (15-40 kg, F_c 40-110 N, ...)."""
    total = rng.uniform(15.0, 40.0)
    coulomb = rng.uniform(40.0, 110.0)
    return ReferencePlant(
        M=0.8 * total,
        J=0.2 * total * 0.045**2,
        force_per_torque=GAIN,
        coulomb_force=coulomb,
        static_force=coulomb * rng.uniform(1.1, 1.6),
        stribeck_velocity=rng.uniform(0.02, 0.15),
        viscous_coefficient=rng.uniform(60.0, 240.0),
        effects={"force_offset": {"force": rng.uniform(-offset, offset)}},
    )


def excite(plant: ReferencePlant, setting: Setting, t: np.ndarray, rng: Generator) -> Torque | Motion:
    """The excitation of `setting` in a size that moves this machine by some decimetres."""
    static, weight = plant.static_force, plant.weight + plant.effects["force_offset"]["force"]
    hold = "linear" if setting.linear else "hold"
    if setting.excitation == "sine":
        force = sine(t, rng.uniform(1.6, 2.2) * static, rng.uniform(0.1, 0.5))
    elif setting.excitation == "multi":
        phases = rng.uniform(0.0, 2 * np.pi, 3)
        force = multisine(t, (1.2 * static, 0.7 * static, 0.5 * static), (0.13, 0.47, 1.1), phases, 0.2)
    else:
        goals = rng.uniform(0.0, 0.6, 9).tolist()
        speeds = rng.permutation([0.06, 0.12, 0.2, 0.35, 0.5]).tolist()
        dwells = rng.uniform(0.3, 1.0, 7).tolist()
        m = plant.moving_mass
        loop = Loop(stiffness=600.0 * m, damping=30.0 * m, bias=weight, period=setting.period, smoothing=0.01)
        return Motion(t, *journey(t, goals, speeds, [1.5], dwells), loop)
    return Torque(t, (force + weight) / GAIN, hold)


def draw_case(seed: int, setting: Setting) -> Case:
    """Machine, excitation and errors of `seed`."""
    rng = np.random.default_rng(seed)
    plant = draw_plant(rng, setting.offset)
    t = stamps(setting.samples * setting.period, setting.period)[: setting.samples]
    noise = setting.noise * coloured_noise(len(t), setting.period, setting.coloured, rng)
    dirt = setting.dirt * coloured_noise(len(t), setting.period, setting.dirt_time, rng)
    excitation = excite(plant, setting, t, rng)
    outer = {"outer_force": dirt * plant.coulomb_force} if setting.dirt_on == "force" else {"level_factor": dirt}
    happened = run(plant, excitation, loop_noise=noise, step=5e-4, **outer)
    wrong = 1.0 if setting.mass_known else float(np.exp(rng.uniform(-0.6, 0.6)))
    mechanics = Mechanics(
        M=plant.M * wrong, J=plant.J * wrong, Rc=plant.Rc, force_per_torque=GAIN, travel=(-5.0, 5.0),
        inertia_known=setting.mass_known,
    )  # fmt: skip
    recording = Recording(
        t, happened["force_command"], happened["position"] + noise, sample_time=setting.period,
        hold=TorqueHold.LINEAR if setting.linear else TorqueHold.HOLD,
        loop="closed" if setting.excitation == "loop" else "open",
    )  # fmt: skip
    truth = {name: getattr(plant, name) for name in FRICTION}
    truth["constant_force"] = plant.effects["force_offset"]["force"]
    if not setting.mass_known:
        truth["moving_mass"] = plant.moving_mass
    return Case(Axis("study", mechanics, Drive(RATED)), recording, truth, happened["velocity"])
