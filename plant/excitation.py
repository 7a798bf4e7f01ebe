"""Torques that excite an axis (§4.5): frozen values that give the motor torque at any time; chance comes from a seed.

All forms swing about `offset`, on a vertical axis the torque that holds the weight (`holding_torque`). Times count from
the start of the run and are not negative. The paper settles on the sine; the others are there to be compared (table 1).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plant.axis import Mechanics
from plant.errors import ParameterError

Floats = NDArray[np.float64]
EDGE = 1e-9  # of a period or hold: a sample stamped k*T_s falls on the edge, not a rounding error before it


class Excitation(Protocol):
    """A torque over time."""

    form: ClassVar[str]

    def torque(self, t: ArrayLike) -> Floats:
        """Motor torque [N·m] at times `t` >= 0 [s], same shape."""
        ...


def holding_torque(mechanics: Mechanics) -> float:
    """Motor torque that carries the weight of a vertical axis; 0 elsewhere. [N·m]"""
    return mechanics.weight / mechanics.gain


def _check(form: str, *checks: tuple[str, float, bool, str, str]) -> None:
    for name, value, allowed, words, unit in checks:
        if not (math.isfinite(value) and allowed):
            raise ParameterError(f"{form}: {name}", value, words, unit)


def _times(t: ArrayLike) -> Floats:
    times = np.asarray(t, dtype=np.float64)
    if times.size and not times.min() >= 0:
        raise ParameterError("time of an excitation", float(times.min()), ">= 0", "s")
    return times


def _half_periods(t: Floats, frequency: float) -> NDArray[np.int64]:
    """Count of half periods that have begun before `t`."""
    return np.floor(2.0 * frequency * t + EDGE).astype(np.int64)


@dataclass(frozen=True, slots=True)
class Sine:
    """The paper's choice: amplitude times sin(2 pi f t + phase).

    Attributes:
        amplitude: [N·m] >= 0
        frequency: [Hz] > 0
        phase: [rad]
        offset: [N·m]
    """

    form: ClassVar[str] = "sine"
    amplitude: float
    frequency: float
    phase: float = 0.0
    offset: float = 0.0

    def __post_init__(self) -> None:
        """Check ranges."""
        _check_wave(self.form, self.amplitude, self.frequency)

    def torque(self, t: ArrayLike) -> Floats:
        """Motor torque [N·m] at times `t` >= 0 [s], same shape."""
        return self.offset + self.amplitude * np.sin(2 * np.pi * self.frequency * _times(t) + self.phase)


def _check_wave(form: str, amplitude: float, frequency: float) -> None:
    _check(
        form,
        ("amplitude", amplitude, amplitude >= 0, ">= 0", "N*m"),
        ("frequency", frequency, frequency > 0, "> 0", "Hz"),
    )


@dataclass(frozen=True, slots=True)
class Square:
    """Plus and minus the amplitude, half a period each, plus first. Units as in `Sine`."""

    form: ClassVar[str] = "square"
    amplitude: float
    frequency: float
    offset: float = 0.0

    def __post_init__(self) -> None:
        """Check ranges."""
        _check_wave(self.form, self.amplitude, self.frequency)

    def torque(self, t: ArrayLike) -> Floats:
        """Motor torque [N·m] at times `t` >= 0 [s], same shape."""
        return self.offset + self.amplitude * np.where(_half_periods(_times(t), self.frequency) % 2, -1.0, 1.0)


@dataclass(frozen=True, slots=True)
class SawTooth:
    """Rises straight from minus to plus the amplitude within each period, then falls back. Units as in `Sine`."""

    form: ClassVar[str] = "saw_tooth"
    amplitude: float
    frequency: float
    offset: float = 0.0

    def __post_init__(self) -> None:
        """Check ranges."""
        _check_wave(self.form, self.amplitude, self.frequency)

    def torque(self, t: ArrayLike) -> Floats:
        """Motor torque [N·m] at times `t` >= 0 [s], same shape."""
        turns = self.frequency * _times(t)
        return self.offset + self.amplitude * (2.0 * (turns - np.floor(turns + EDGE)) - 1.0)


@dataclass(frozen=True, slots=True)
class TwoSquares:
    """Superposition of two squares at different frequency.

    Attributes:
        amplitudes: of the two. [N·m] >= 0
        frequencies: of the two. [Hz] > 0
        offset: [N·m]
    """

    form: ClassVar[str] = "two_squares"
    amplitudes: tuple[float, float]
    frequencies: tuple[float, float]
    offset: float = 0.0

    def __post_init__(self) -> None:
        """Check ranges."""
        for amplitude, frequency in zip(self.amplitudes, self.frequencies, strict=True):
            _check_wave(self.form, amplitude, frequency)

    def torque(self, t: ArrayLike) -> Floats:
        """Motor torque [N·m] at times `t` >= 0 [s], same shape."""
        first, second = (Square(a, f) for a, f in zip(self.amplitudes, self.frequencies, strict=True))
        return self.offset + first.torque(t) + second.torque(t)


@dataclass(frozen=True, slots=True)
class Multisine:
    """Sum of sines of one amplitude with phases drawn from the seed.

    Attributes:
        amplitude: of each line. [N·m] >= 0
        frequencies: of the lines. [Hz] > 0
        seed: of the phases.
        offset: [N·m]
    """

    form: ClassVar[str] = "multisine"
    amplitude: float
    frequencies: tuple[float, ...]
    seed: int = 0
    offset: float = 0.0

    def __post_init__(self) -> None:
        """Check ranges."""
        for frequency in self.frequencies:
            _check_wave(self.form, self.amplitude, frequency)

    def torque(self, t: ArrayLike) -> Floats:
        """Motor torque [N·m] at times `t` >= 0 [s], same shape."""
        times = _times(t)
        phases = np.random.default_rng(self.seed).uniform(0.0, 2 * np.pi, len(self.frequencies))
        total = np.zeros_like(times)
        for frequency, phase in zip(self.frequencies, phases, strict=True):
            total += np.sin(2 * np.pi * frequency * times + phase)
        return self.offset + self.amplitude * total


@dataclass(frozen=True, slots=True)
class Random:
    """Gaussian values, each held for `hold_time`; the longer run begins with the shorter one of the same seed.

    Attributes:
        amplitude: standard deviation. [N·m] >= 0
        hold_time: [s] > 0; the paper gives none, its recordings have T_s = 0.01 s.
        seed: of the values.
        offset: [N·m]
    """

    form: ClassVar[str] = "random"
    amplitude: float
    hold_time: float = 0.01
    seed: int = 0
    offset: float = 0.0

    def __post_init__(self) -> None:
        """Check ranges."""
        _check(
            self.form,
            ("amplitude", self.amplitude, self.amplitude >= 0, ">= 0", "N*m"),
            ("hold_time", self.hold_time, self.hold_time > 0, "> 0", "s"),
        )

    def torque(self, t: ArrayLike) -> Floats:
        """Motor torque [N·m] at times `t` >= 0 [s], same shape."""
        held = np.floor(_times(t) / self.hold_time + EDGE).astype(np.int64)
        values = np.random.default_rng(self.seed).standard_normal(int(held.max(initial=0)) + 1)
        return self.offset + self.amplitude * values[held]


@dataclass(frozen=True, slots=True)
class PiecewiseConstant:
    """Uniform values between plus and minus the amplitude, each held for a random time.

    Attributes:
        amplitude: largest value. [N·m] >= 0
        shortest: shortest hold. [s] > 0
        longest: longest hold. [s] >= shortest
        seed: of values and holds.
        offset: [N·m]
    """

    form: ClassVar[str] = "piecewise_constant"
    amplitude: float
    shortest: float = 0.2
    longest: float = 2.0
    seed: int = 0
    offset: float = 0.0

    def __post_init__(self) -> None:
        """Check ranges."""
        _check(
            self.form,
            ("amplitude", self.amplitude, self.amplitude >= 0, ">= 0", "N*m"),
            ("shortest", self.shortest, self.shortest > 0, "> 0", "s"),
            ("longest", self.longest, self.longest >= self.shortest, f">= shortest = {self.shortest:g}", "s"),
        )

    def torque(self, t: ArrayLike) -> Floats:
        """Motor torque [N·m] at times `t` >= 0 [s], same shape."""
        times = _times(t)
        pieces = int(times.max(initial=0.0) / self.shortest) + 2
        draws = np.random.default_rng(self.seed).uniform(size=(pieces, 2))
        ends = np.cumsum(self.shortest + (self.longest - self.shortest) * draws[:, 0])
        values: Floats = 2.0 * draws[np.searchsorted(ends, times, side="right"), 1] - 1.0
        return self.offset + self.amplitude * values


FORMS: dict[str, type] = {
    kind.form: kind for kind in (Sine, Square, SawTooth, TwoSquares, Multisine, Random, PiecewiseConstant)
}
