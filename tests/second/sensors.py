"""What is written down: resolution and noise of position and torque, and the axis file and tables of a user."""

from dataclasses import dataclass

import numpy as np

from .machine import HELD, Moved
from .measures import OWN_MASS, OWN_OFFSET, noise_force
from .motion import log_uniform, uniform
from .plants import GRAVITY, TWO_MASS, Plant

WORDS = ("held over the sample", "mean of the sample", "linear between samples")  # by what is reported


@dataclass(frozen=True)
class Sensors:
    """Resolution of position [m] and torque [N·m], noise of the torque [N·m], and rated torque [N·m]."""

    position_step: float
    torque_step: float
    torque_noise: float
    rated: float

    @property
    def position_noise(self) -> float:
        """Standard deviation of a reading: rounding, and 0.4 steps of noise. [m]"""
        return self.position_step * np.hypot(0.29, 0.4)

    def as_force(self, plant: Plant) -> float:
        """What all of it amounts to in force. [N]"""
        torque = np.hypot(self.torque_noise, self.torque_step * 0.29) * plant.force_per_torque
        return noise_force(plant, self.position_noise, torque)


def draw_position_step(rng, plant: Plant) -> float:
    """Resolution of an encoder. [m] or [rad]"""
    if plant.rotary:
        return 2 * np.pi / 2 ** int(rng.choice([17, 18, 19, 20]))
    return float(rng.choice([1e-6, 2e-6, 5e-6, 1e-5]))


def draw_sensors(rng, plant: Plant, position_step: float, peak: float, hides: bool) -> tuple[Sensors, float]:
    """Sensors for a peak force [N], finer until the noise leaves something to see; and that noise as a force. [N]"""
    rated = float(f"{peak / plant.force_per_torque * uniform(rng, 1.05, 1.5):.2g}")
    torque_step = float(f"{rated / rng.choice([1000, 2000, 4096, 8192]):.1g}")
    torque_noise = 0.0 if plant.reported == HELD else uniform(rng, 0.001, 0.004) * rated
    sensors = Sensors(position_step, torque_step, torque_noise, rated)
    noise = sensors.as_force(plant)
    while noise > plant.coulomb * (0.02 if hides else 0.05):
        sensors = Sensors(sensors.position_step / 2, sensors.torque_step / 2, sensors.torque_noise / 2, rated)
        noise /= 2
    return sensors, noise


@dataclass(frozen=True)
class Style:
    """How a user writes it down.

    Attributes:
        force: force instead of torque.
        ampere: a current in ampere, `scale` [N·m/A] in the axis file.
        millimetre: position in millimetres.
        inertia_factor: how wrong the inertia in the axis file is; not 1 where the file says that it is not known.
    """

    force: bool
    ampere: bool
    millimetre: bool
    scale: float
    inertia_known: bool
    inertia_factor: float


def draw_style(rng, plant: Plant, effects: set[str]) -> Style:
    """Draw how it is written down."""
    style = rng.random()
    knows = bool(effects & (OWN_MASS | OWN_OFFSET | TWO_MASS)) or plant.axis != "horizontal" or rng.random() >= 0.3
    factor = 1.0 if knows else uniform(rng, 0.7, 1.4)
    scale = float(f"{log_uniform(rng, 0.05, 0.8):.3g}")
    return Style(not plant.rotary and style < 0.25, style > 0.85, 0.65 < style <= 0.85, scale, knows, factor)


@dataclass(frozen=True)
class Table:
    """One file of a recording: header, values, a format per column."""

    header: str
    values: np.ndarray
    formats: tuple[str, str, str]


def draw_table(rng, plant: Plant, sensors: Sensors, style: Style, moved: Moved) -> Table:
    """Time, force as the drive tells it, position as the encoder reads it; with noise and resolution."""
    step, n = sensors.position_step, len(moved.position)
    position = np.round((moved.position + step * 0.4 * rng.standard_normal(n)) / step) * step
    torque = moved.command / plant.force_per_torque
    torque = np.round((torque + sensors.torque_noise * rng.standard_normal(n)) / sensors.torque_step)
    torque *= sensors.torque_step
    digits = int(np.ceil(-np.log10(step))) + 2
    force_digits = int(max(0, np.ceil(-np.log10(sensors.torque_step)))) + 2
    time, what, where = "t", "torque", "position"
    if style.force:
        what, torque, force_digits = "force", torque * plant.force_per_torque, max(2, force_digits - 1)
    elif style.ampere:
        time, what, where = "time_s", "current_A", "pos"
        torque, force_digits = torque / style.scale, force_digits + 2
    if style.millimetre:
        where, position, digits = "actual_pos", position * 1e3, max(1, digits - 3)
    values = np.c_[np.arange(n) * plant.sample_period, torque, position]
    return Table(f"{time},{what},{where}", values, ("%.5f", f"%.{force_digits}f", f"%.{digits}f"))


def draw_axis_file(rng, plant: Plant, sensors: Sensors, style: Style, moved: list[Moved]) -> list[str]:
    """Lines of axis.toml below its name, one recording per run."""
    low, high = min(one.position.min() for one in moved), max(one.position.max() for one in moved)
    margin = 0.03 * (high - low)
    known, factor = style.inertia_known, style.inertia_factor
    lines = ["[mechanics]", f'axis = "{plant.axis}"']
    if plant.rotary:
        lines += ["M = 0.0", f"J = {_six(plant.J)}", "Rc = 1.0", f"Rm = {_eight(plant.motor_radius)}",
                  "force_per_torque = 1.0"]  # fmt: skip
    else:
        lines += [f"M = {_six(plant.M * factor)}", f"J = {_six(plant.J * factor)}", f"Rc = {_six(plant.pulley)}"]
        lines += [f"Rm = {_eight(plant.motor_radius)}", f"force_per_torque = {_eight(plant.force_per_torque)}"]
    lines += [f"g = {GRAVITY}"] if plant.axis == "vertical" else []
    lines += [f"travel = [{low - margin:.4g}, {high + margin:.4g}]"]
    lines += [] if known else ["inertia_known = false"]
    word, gain = ("force", plant.force_per_torque) if style.force else ("torque", 1.0)
    lines += ["[drive]", f"rated_{word} = {_six(sensors.rated * gain)}",
              f"{word}_resolution = {_six(max(sensors.torque_step, sensors.torque_noise) * gain)}"]  # fmt: skip
    lines += ["[sensor]", f"position_resolution = {_six(sensors.position_step)}",
              f'side = "{"motor" if plant.motor_side else "load"}"']  # fmt: skip
    if plant.sample_period < 0.0035 and rng.random() < 0.5:
        lines += ["[analysis]", "sample_time = 0.01"]
    for number in range(len(moved)):
        lines += ["[[recording]]", f'file = "{file_name(number)}"', *_columns(style)]
        lines += [f"sample_time = {_six(plant.sample_period)}", 'loop = "closed"',
                  f'torque = "{WORDS[plant.reported]}"']  # fmt: skip
    return lines


def file_name(number: int) -> str:
    """File of a recording, counted from 0."""
    return f"rec{number + 1}.csv"


def _columns(style):
    """What the columns are called, where not as the axis file would have it."""
    lines = []
    if style.ampere:
        lines += ['columns = { t = "time_s", torque = "current_A", position = "pos" }',
                  f"scale = {{ torque = {style.scale} }}"]  # fmt: skip
    if style.millimetre:
        what = 'force = "force"' if style.force else 'torque = "torque"'
        lines += [f'columns = {{ t = "t", {what}, position = "actual_pos" }}', "scale = { position = 0.001 }"]
    return lines


def _six(value):
    return repr(float(f"{value:.6g}"))


def _eight(value):
    return repr(float(f"{value:.8g}"))
