"""The paper's simulations (§4) with both readings of §4.3: numbers in, numbers out; plots are made in `figures.py`."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from plant.axis import Axis
from plant.excitation import Excitation, Random, Sine, Square, holding_torque
from plant.friction import StribeckFriction
from plant.presets import READINGS, SAMPLE_TIME, Reading, paper_axis, paper_friction
from plant.simulation import Trajectory, simulate, simulate_population

Floats = NDArray[np.float64]

TARGET = 0.2  # m: "displacements about ±0.2 m" (§4.5)
WINDOW = 1500  # samples, §4.3
LENGTH = 2000  # samples: 20 s, one period of the slowest input of table 1
NOISE = 1e-3  # m: variance 1e-6 m² (§4.6)
RANDOM_SEEDS = 8
SUBSTEPS = 10  # 1.3 µm over 20 s in the case of §4.3
AMPLITUDES = np.geomspace(0.3, 12.0, 40)  # N m, searched for the displacement of §4.5
PAPER_OPTIMUM = (93.0, 69.0, 0.12, 172.0)  # F_c, F_s, v_s, F_v found in §4.4
PAPER_RECORDED = (91.0, 69.0, 0.1, 150.0)  # of the test bed, §5
PARAMETERS = ("F_c", "F_s", "v_s", "F_v")
OTHER_MASSES = (1.0, 5.0, 25.0, 50.0, 100.0)  # kg
STEP = 1e-3  # relative, of the sensitivities

# table 1: form, frequency [Hz], the paper's criterion and quality
TABLE_1: tuple[tuple[str, float, float, str], ...] = (
    ("sin", 0.1, 9e-5, "++"),
    ("sin", 0.2, 4e-5, "++"),
    ("sin", 0.5, 8e-6, "++"),
    ("square", 0.05, 7e-5, "--"),
    ("square", 0.1, 3e-4, "--"),
    ("square", 0.2, 2e-3, "--"),
    ("random", float("nan"), 2.3, "--"),
)


@dataclass(frozen=True)
class Case:
    """One reading of §4.3: the machine and its friction."""

    reading: Reading
    axis: Axis
    friction: StribeckFriction

    def run(self, excitation: Excitation, samples: int = LENGTH) -> Trajectory:
        """What the machine does from rest at 1 m."""
        torque = excitation.torque(SAMPLE_TIME * np.arange(samples))
        return simulate(self.axis, self.friction, torque, sample_time=SAMPLE_TIME, position0=1.0, substeps=SUBSTEPS)

    def sine(self, amplitude: float = 2.1, frequency: float = 0.2) -> Sine:
        """A sine about the torque that holds the weight; by default the one of §4.3."""
        return Sine(amplitude, frequency, offset=holding_torque(self.axis.mechanics))


@dataclass(frozen=True)
class TableRow:
    """One input of table 1 with the amplitude that comes nearest to ±0.2 m.

    Attributes:
        form: of the input.
        frequency: [Hz]
        amplitude: of the torque. [N m]
        displacement: half of what the mass travels to and fro. [m]
        below: displacement just below that amplitude; far from `displacement` where the mass breaks loose at once. [m]
        drift: change of the mean position from the first to the last half of 40 s. [m]
        viscous_ratio: max F_v |v| over F_c, which §4.5 wants near 1. [1]
        sticking: share of the time at rest. [1]
        box_criterion: median criterion of candidates drawn from the paper's search box, ±50 % of each parameter. [1]
        errors: relative standard error of F_c, F_s, v_s, F_v from 15 s with 1 mm of noise. [1] (4,)
    """

    form: str
    frequency: float
    amplitude: float
    displacement: float
    below: float
    drift: float
    viscous_ratio: float
    sticking: float
    box_criterion: float
    errors: Floats


def case(reading: Reading) -> Case:
    """The machine of one reading."""
    return Case(reading, paper_axis(reading), paper_friction(reading))


def cases() -> list[Case]:
    """Both readings."""
    return [case(reading) for reading in READINGS]


def half_travel(path: Trajectory) -> float:
    """Half of the distance between highest and lowest position of the last 20 s. [m]"""
    return float(np.ptp(path.position[-LENGTH:])) / 2


def criterion(measured: Floats, estimated: Floats) -> float:
    """Eq. (4) with positions counted from the first sample, as Fig. 9 begins at 0. [1]"""
    return float(np.sum((measured - estimated) ** 2) / np.sum((measured - measured[0]) ** 2))


def free_run(machine: Case, excitation: Excitation, candidates: Floats, samples: int = WINDOW) -> Floats:
    """Positions of `candidates` (m, 4) under `excitation`: (m, samples) [m]."""
    torque = excitation.torque(SAMPLE_TIME * np.arange(samples))
    return simulate_population(
        machine.axis, torque, candidates, sample_time=SAMPLE_TIME, position0=1.0, substeps=SUBSTEPS
    )


def at_paper_values(machine: Case, values: tuple[float, float, float, float]) -> Floats:
    """The paper's F_c, F_s, v_s, F_v as candidate (1, 4): for the bump its "F_s" is added to F_c."""
    coulomb, static, stribeck, viscous = values
    if machine.reading == "paper-bump":
        static += coulomb
    return np.array([[coulomb, static, stribeck, viscous]])


def standard_errors(machine: Case, excitation: Excitation, noise: float = NOISE) -> Floats:
    """Relative standard errors of the four parameters (Gauss-Newton, Ljung 1999 ch. 9); inf where nothing moves."""
    law = machine.friction.as_array
    steps = np.concatenate([np.diag(law * STEP), -np.diag(law * STEP)])
    positions = free_run(machine, excitation, law + steps)
    sensitivity = (positions[:4] - positions[4:]).T / (2 * STEP)
    scale = np.sqrt(np.sum(sensitivity**2, axis=0))
    if not scale.all():
        return np.full(4, np.inf)
    covariance = np.linalg.pinv((sensitivity / scale).T @ (sensitivity / scale), rcond=1e-12)
    return noise * np.sqrt(np.diag(covariance)) / scale


def box_criterion(machine: Case, excitation: Excitation, draws: int = 200, seed: int = 0) -> float:
    """Median criterion over the box that §4.4 searches: ±50 % of each parameter. [1]"""
    law = machine.friction.as_array
    candidates = law * np.random.default_rng(seed).uniform(0.5, 1.5, (draws, 4))
    positions = free_run(machine, excitation, np.concatenate([law[np.newaxis], candidates]))
    return float(np.median([criterion(positions[0], position) for position in positions[1:]]))


def excitation_of(machine: Case, form: str, frequency: float, amplitude: float, seed: int = 0) -> Excitation:
    """An input of table 1. [N m]"""
    offset = holding_torque(machine.axis.mechanics)
    match form:
        case "sin":
            return Sine(amplitude, frequency, offset=offset)
        case "square":
            return Square(amplitude, frequency, offset)
        case _:
            return Random(amplitude, SAMPLE_TIME, seed, offset)


def nearest_amplitude(displacement: Callable[[float], float]) -> tuple[float, float]:
    """Smallest amplitude [N m] that moves the mass ±0.2 m or more, and the displacement [m] just below it."""
    tried = [displacement(float(amplitude)) for amplitude in AMPLITUDES]
    k = next(k for k, travel in enumerate(tried) if travel >= TARGET)
    low, high, below = float(AMPLITUDES[k - 1]), float(AMPLITUDES[k]), tried[k - 1]
    for _ in range(20):
        middle = 0.5 * (low + high)
        travel = displacement(middle)
        if travel < TARGET:
            low, below = middle, travel
        else:
            high = middle
    return high, below


def table_row(machine: Case, form: str, frequency: float) -> TableRow:
    """Simulate one input of table 1 at the amplitude of §4.5."""
    seeds = range(RANDOM_SEEDS if form == "random" else 1)

    def paths(amplitude: float) -> list[Trajectory]:
        inputs = [excitation_of(machine, form, frequency, amplitude, seed) for seed in seeds]
        return [machine.run(excitation, 2 * LENGTH) for excitation in inputs]

    amplitude, below = nearest_amplitude(lambda a: float(np.median([half_travel(path) for path in paths(a)])))
    runs = paths(amplitude)
    law = machine.friction
    inputs = [excitation_of(machine, form, frequency, amplitude, seed) for seed in seeds]
    return TableRow(
        form,
        frequency,
        amplitude,
        float(np.median([half_travel(path) for path in runs])),
        below,
        float(np.median([abs(path.position[LENGTH:].mean() - path.position[:LENGTH].mean()) for path in runs])),
        float(np.median([law.viscous_coefficient * np.abs(path.velocity).max() for path in runs])) / law.coulomb_force,
        float(np.mean([(path.velocity == 0).mean() for path in runs])),
        float(np.median([box_criterion(machine, excitation) for excitation in inputs])),
        np.median([standard_errors(machine, excitation) for excitation in inputs], axis=0),
    )


def table_1(machine: Case) -> list[TableRow]:
    """All inputs of table 1."""
    return [table_row(machine, form, frequency) for form, frequency, _, _ in TABLE_1]


def noisy_criterion(machine: Case, seed: int) -> float:
    """Criterion (4) of the true parameters against the noisy output of §4.6. [1]"""
    clean = machine.run(machine.sine(), WINDOW).position
    noisy = clean + NOISE * np.random.default_rng(seed).standard_normal(WINDOW)
    return criterion(noisy, clean)


@dataclass(frozen=True)
class Optimum:
    """The paper's optimum of §4.4 put into our machine.

    Attributes:
        criterion: eq. (4) of the printed values. [1]
        worst: largest output error. [m]
        rounded_criterion: the smallest that values which round to the printed ones reach. [1]
        rounded_worst: largest output error there. [m]
    """

    criterion: float
    worst: float
    rounded_criterion: float
    rounded_worst: float


def paper_optimum(machine: Case, draws: int = 2000, seed: int = 0) -> Optimum:
    """How well the paper's optimum reproduces Fig. 9, as printed and within its rounding."""
    measured = machine.run(machine.sine(), WINDOW).position
    printed = at_paper_values(machine, PAPER_OPTIMUM)
    box = np.random.default_rng(seed).uniform(-1.0, 1.0, (draws, 4)) * (0.5, 0.5, 0.005, 0.5)
    positions = free_run(machine, machine.sine(), np.concatenate([printed, printed + box]))
    criteria = np.array([criterion(measured, position) for position in positions])
    worst = np.abs(positions - measured).max(axis=1)
    best = int(np.argmin(criteria))
    return Optimum(float(criteria[0]), float(worst[0]), float(criteria[best]), float(worst[best]))


def optimum_at_other_masses(machine: Case) -> tuple[float, float]:
    """Lowest and highest criterion of the paper's optimum when M + J/R_c² is 1 ... 100 kg, the gain set for ±0.2 m."""
    found = []
    for mass in OTHER_MASSES:
        other = _with_mass(machine, mass)
        measured = other.run(other.sine(), WINDOW).position
        found.append(criterion(measured, free_run(other, other.sine(), at_paper_values(other, PAPER_OPTIMUM))[0]))
    return min(found), max(found)


def _with_mass(machine: Case, mass: float) -> Case:
    """The machine with M + J/R_c² = `mass` [kg], M four fifths of it, and the gain that moves it ±0.2 m."""
    mechanics = machine.axis.mechanics
    low, high = 20.0, 200.0
    for _ in range(25):
        gain = 0.5 * (low + high)
        lighter = dataclasses.replace(mechanics, M=0.8 * mass, J=0.2 * mass * mechanics.Rc**2, Rm=1.0 / gain)
        other = dataclasses.replace(machine, axis=dataclasses.replace(machine.axis, mechanics=lighter))
        if half_travel(other.run(other.sine())) < TARGET:
            low = gain
        else:
            high = gain
    return other


def distortion(machine: Case) -> float:
    """Power of the position's overtones over that of its fundamental, in the last two periods of Fig. 9's sine. [1]"""
    position = machine.run(machine.sine(), 2 * LENGTH).position[-1000:]
    power = np.abs(np.fft.rfft(position - position.mean())) ** 2
    return float(power[4::2].sum() / power[2])


def repeats(machine: Case) -> float:
    """Largest difference between the last two periods of Fig. 9's sine. [m]"""
    position = machine.run(machine.sine(), 2 * LENGTH).position
    return float(np.abs(position[-500:] - position[-1000:-500]).max())
