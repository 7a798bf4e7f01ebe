"""A machine axis as a commissioning engineer knows it: the constants of eq. (5) and what the sensors can resolve."""

from __future__ import annotations

import enum
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

from plant.errors import AxisFileError, ParameterError

STANDARD_GRAVITY = 9.81  # m/s^2
SMALLEST_RADIUS, LARGEST_RADIUS = 1e-6, 1e6  # m, of a pulley: beyond them its square means nothing
LIGHTEST, HEAVIEST = 1e-12, 1e21  # kg, or kg m^2 on a rotary axis
AXIS_NAME = r"[A-Za-z0-9][A-Za-z0-9_.-]{0,39}"


class Orientation(enum.StrEnum):
    """How the axis lies: gravity acts on a vertical one; a rotary one works in N*m and rad."""

    VERTICAL = "vertical"
    HORIZONTAL = "horizontal"
    ROTARY = "rotary"


class TorqueHold(enum.StrEnum):
    """What a torque sample means between its stamp and the next: alone worth 2 mm of position over 20 s."""

    HOLD = "hold"
    LINEAR = "linear"
    MEAN = "mean"
    UNKNOWN = "unknown"

    @classmethod
    def from_words(cls, words: str) -> TorqueHold:
        """Read the axis file's words; free text means unknown."""
        return {
            "held over the sample": cls.HOLD,
            "linear between samples": cls.LINEAR,
            "mean of the sample": cls.MEAN,
        }.get(words.strip().lower(), cls.UNKNOWN)


@dataclass(frozen=True, slots=True)
class Mechanics:
    """Constants of eq. (5).

    Attributes:
        orientation: vertical (default), horizontal or rotary.
        M: mass in translation; 0 on a rotary axis. [kg] >= 0
        J: total inertia on the driving pulley's axis; counts as motor side. [kg·m²] >= 0
        Rc: driving pulley radius. [m] > 0
        Re: second pulley's radius; documents the machine, eq. (5) does not use it. [m]
        Rm: motor pulley radius, rho = Rc/Rm. [m] > 0
        force_per_torque: takes precedence over 1/Rm. [N per N·m] != 0
        g: gravity. [m/s²]
        travel: lowest and highest position. [m or rad]
        inertia_known: False when the inertia is a rough start, good to a factor of two, and is estimated too.
    """

    orientation: Orientation = Orientation.VERTICAL
    M: float = 0.0
    J: float = 0.0
    Rc: float = 1.0
    Re: float | None = None
    Rm: float = 1.0
    force_per_torque: float | None = None
    g: float = STANDARD_GRAVITY
    travel: tuple[float, float] | None = None
    inertia_known: bool = True

    def __post_init__(self) -> None:
        """Check ranges; an axis without inertia cannot be marched."""
        for name, unit in (("M", "kg"), ("J", "kg*m^2"), ("g", "m/s^2")):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0):
                raise ParameterError(name, value, ">= 0", unit)
        for name in ("Rc", "Rm"):
            value = getattr(self, name)
            if not SMALLEST_RADIUS <= value <= LARGEST_RADIUS:
                raise ParameterError(name, value, f"{SMALLEST_RADIUS:g} to {LARGEST_RADIUS:g}", "m")
        if self.force_per_torque is not None and not (math.isfinite(self.force_per_torque) and self.force_per_torque):
            raise ParameterError("force_per_torque", self.force_per_torque, "finite and not 0", "N per N*m")
        if self.orientation is Orientation.ROTARY and self.M:
            raise ParameterError("M", self.M, "0 on a rotary axis (J carries the inertia)", "kg")
        if not LIGHTEST <= self.moving_mass <= HEAVIEST:
            raise ParameterError("moving mass M + J/Rc^2", self.moving_mass, f"{LIGHTEST:g} to {HEAVIEST:g}", "kg")
        if self.travel is not None and not self.travel[0] < self.travel[1]:
            raise ParameterError("travel", list(self.travel), "[lowest, highest]", "m")

    @property
    def moving_mass(self) -> float:
        """m_e = M + J/Rc^2 = J_e/Rc^2 of eq. (5) [kg]; J itself [kg·m²] on a rotary axis."""
        return self.J if self.orientation is Orientation.ROTARY else self.M + self.J / self.Rc**2

    @property
    def gain(self) -> float:
        """Force at the belt per motor torque, rho/Rc = 1/Rm of eq. (5). [N per N·m]"""
        return 1.0 / self.Rm if self.force_per_torque is None else self.force_per_torque

    @property
    def weight(self) -> float:
        """M g where gravity acts along the axis, else 0. [N]"""
        return self.M * self.g if self.orientation is Orientation.VERTICAL else 0.0


@dataclass(frozen=True, slots=True)
class Drive:
    """What the drive can give and resolve, converted to force at the belt.

    Attributes:
        rated_force: [N; N·m on a rotary axis] > 0, None when unknown.
        force_resolution: smallest step of the reported force. [N] >= 0
    """

    rated_force: float | None = None
    force_resolution: float = 0.0


@dataclass(frozen=True, slots=True)
class Sensor:
    """The position sensor: its step [m or rad], and whether it sits at the load or at the motor."""

    position_resolution: float = 0.0
    side: str = "load"


@dataclass(frozen=True, slots=True)
class Stream:
    """The live stream: nominal sample time [s] and what a torque sample means."""

    sample_time: float | None = None
    hold: TorqueHold = TorqueHold.HOLD


@dataclass(frozen=True, slots=True)
class RecordingEntry:
    """One [[recording]] of the axis file: where it is and how its columns become SI.

    Attributes:
        file: path, resolved against the axis file's folder.
        columns: our name (t, torque, force, position, velocity, temperature, load) -> the file's column.
        scale: our name -> factor, file unit to SI.
        select: file column -> value; only rows that match all are read.
        sample_time: nominal. [s]
        loop: "open" or "closed".
        hold: what a torque sample means.
        note: free text; `commissioning` and `today` mark a before/after pair.
        dbc: says what the frames of a CAN log mean; `columns` then names `Message.Signal`.
        bridge: bridge file that does, instead.
    """

    file: Path
    columns: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    scale: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    select: Mapping[str, str | float] = field(default_factory=lambda: MappingProxyType({}))
    sample_time: float | None = None
    loop: str = "open"
    hold: TorqueHold = TorqueHold.HOLD
    note: str = ""
    dbc: Path | None = None
    bridge: Path | None = None


@dataclass(frozen=True, slots=True)
class Axis:
    """One axis: name, mechanics, drive, sensor, stream, and the recordings its file lists.

    Attributes:
        name: matches `AXIS_NAME`; `alive` is reserved.
        analysis_sample_time: faster data are averaged down to this before identification. [s]
    """

    name: str
    mechanics: Mechanics
    drive: Drive = Drive()
    sensor: Sensor = Sensor()
    stream: Stream = Stream()
    analysis_sample_time: float | None = None
    recordings: tuple[RecordingEntry, ...] = ()

    def __post_init__(self) -> None:
        """Check the name: it becomes a key of the stream."""
        if not re.fullmatch(AXIS_NAME, self.name) or self.name == "alive":
            raise AxisFileError(
                f"axis name {self.name!r} is not allowed: use 1-40 letters, digits, '_', '.', '-', "
                "starting with a letter or digit, and not 'alive'"
            )

    @property
    def is_rotary(self) -> bool:
        """True where positions are rad and forces are N·m."""
        return self.mechanics.orientation is Orientation.ROTARY

    @property
    def force_unit(self) -> str:
        """N, or N*m on a rotary axis."""
        return "N*m" if self.is_rotary else "N"

    @property
    def position_unit(self) -> str:
        """m, or rad on a rotary axis."""
        return "rad" if self.is_rotary else "m"

    @property
    def inertia_unit(self) -> str:
        """kg, or kg*m^2 on a rotary axis."""
        return "kg*m^2" if self.is_rotary else "kg"
