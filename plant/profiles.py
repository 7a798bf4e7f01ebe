"""Reference motions of a closed loop: frozen values that give position, velocity and acceleration at any time.

Point-to-point moves are made of pieces of constant jerk; a trapezoid is the limit of infinite jerk (Biagiotti and
Melchiorri 2008, ch. 3). Units are those of a linear axis; on a rotary axis read rad for m.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plant.errors import ParameterError

Floats = NDArray[np.float64]


class Motion(NamedTuple):
    """Where a reference is: position [m], velocity [m/s], acceleration [m/s²], each (n,)."""

    position: Floats
    velocity: Floats
    acceleration: Floats


class Reference(Protocol):
    """A motion over time; it begins at rest or the loop will have to catch up."""

    form: ClassVar[str]

    def motion(self, t: ArrayLike) -> Motion:
        """Reference at times `t` >= 0 [s] (n,)."""
        ...


class Piece(NamedTuple):
    """Constant jerk for a while: duration [s], acceleration at its begin [m/s²], jerk [m/s³]."""

    duration: float
    acceleration: float
    jerk: float


def _above(form: str, name: str, value: float, unit: str) -> None:
    if not value > 0:
        raise ParameterError(f"{form}: {name}", value, "> 0", unit)


def move(distance: float, speed: float, acceleration: float, jerk: float = math.inf) -> list[Piece]:
    """Pieces of a rest-to-rest move, as quick as the three limits allow.

    Args:
        distance: with its sign. [m]
        speed: limit. [m/s] > 0
        acceleration: limit. [m/s²] > 0
        jerk: limit; infinite gives a trapezoid. [m/s³] > 0
    """
    length, sign = abs(distance), math.copysign(1.0, distance)
    if length == 0:
        return []
    top = min(speed, _fastest(length, acceleration, jerk))
    rise = acceleration / jerk  # time to full acceleration
    if top < acceleration * rise:  # the speed is reached before full acceleration
        rise = math.sqrt(top / jerk)
        flat = 0.0
    else:
        flat = top / acceleration - rise
    peak = jerk * rise if rise else acceleration
    cruise = max(length / top - (2 * rise + flat), 0.0)
    j = jerk if rise else 0.0
    up = [Piece(rise, 0.0, j), Piece(flat, peak, 0.0), Piece(rise, peak, -j)]
    down = [Piece(rise, 0.0, -j), Piece(flat, -peak, 0.0), Piece(rise, -peak, j)]
    whole = [*up, Piece(cruise, 0.0, 0.0), *down]
    return [Piece(p.duration, sign * p.acceleration, sign * p.jerk) for p in whole if p.duration > 0]


def _fastest(length: float, acceleration: float, jerk: float) -> float:
    """Speed at which a move of `length` has no cruise left. [m/s]"""
    lag = acceleration * acceleration / jerk
    full = 0.5 * (math.sqrt(lag * lag + 4.0 * acceleration * length) - lag)
    return full if full >= lag else (0.25 * length * length * jerk) ** (1.0 / 3.0)


def follow(pieces: list[Piece], start: float, t: Floats, *, repeat: bool) -> Motion:
    """Evaluate `pieces` from rest at `start` [m]; afterwards stand still, or begin anew where `repeat`."""
    durations = np.array([p.duration for p in pieces])
    a, j = np.array([p.acceleration for p in pieces]), np.array([p.jerk for p in pieces])
    begins = np.concatenate([[0.0], np.cumsum(durations)])
    v = np.concatenate([[0.0], np.cumsum(durations * (a + durations * j / 2))])
    y = start + np.concatenate([[0.0], np.cumsum(durations * (v[:-1] + durations * (a / 2 + durations * j / 6)))])
    if repeat:
        t = np.mod(t, begins[-1])
    piece = np.clip(np.searchsorted(begins, t, side="right") - 1, 0, len(pieces) - 1)
    s = t - begins[piece]
    done = t >= begins[-1]
    s_a, s_j = a[piece], j[piece]
    position = y[piece] + s * (v[piece] + s * (s_a / 2 + s * s_j / 6))
    velocity = v[piece] + s * (s_a + s * s_j / 2)
    return Motion(np.where(done, y[-1], position), np.where(done, 0.0, velocity), np.where(done, 0.0, s_a + s * s_j))


@dataclass(frozen=True, slots=True)
class SineMotion:
    """Position centre - amplitude cos(2 pi f t): begins at rest at the lower end.

    Attributes:
        centre: [m]
        amplitude: [m] > 0
        frequency: [Hz] > 0
    """

    form: ClassVar[str] = "sine"
    centre: float
    amplitude: float
    frequency: float

    def __post_init__(self) -> None:
        """Check ranges."""
        _above(self.form, "amplitude", self.amplitude, "m")
        _above(self.form, "frequency", self.frequency, "Hz")

    def motion(self, t: ArrayLike) -> Motion:
        """Reference at times `t` >= 0 [s] (n,)."""
        rate = 2 * np.pi * self.frequency
        angle = rate * np.asarray(t, dtype=np.float64)
        y = self.centre - self.amplitude * np.cos(angle)
        return Motion(y, self.amplitude * rate * np.sin(angle), self.amplitude * rate**2 * np.cos(angle))


@dataclass(frozen=True, slots=True)
class PointToPoint:
    """One move, then rest: trapezoid of the velocity, or an S-curve where a jerk is given.

    Attributes:
        start: [m]
        end: [m]
        speed: limit. [m/s] > 0
        acceleration: limit. [m/s²] > 0
        jerk: limit; None gives a trapezoid. [m/s³] > 0
    """

    form: ClassVar[str] = "point_to_point"
    start: float
    end: float
    speed: float
    acceleration: float
    jerk: float | None = None

    def __post_init__(self) -> None:
        """Check ranges."""
        _check_limits(self.form, self.speed, self.acceleration, self.jerk)
        if self.start == self.end:
            raise ParameterError(f"{self.form}: end", self.end, f"other than start = {self.start:g}", "m")

    def motion(self, t: ArrayLike) -> Motion:
        """Reference at times `t` >= 0 [s] (n,)."""
        pieces = move(self.end - self.start, self.speed, self.acceleration, _limit(self.jerk))
        return follow(pieces, self.start, np.asarray(t, dtype=np.float64), repeat=False)


@dataclass(frozen=True, slots=True)
class ProductionCycle:
    """Stations visited one after the other with a dwell at each, again and again.

    Attributes:
        stations: positions; from the last it goes back to the first. [m] at least two
        dwells: rest at each station on arrival; the first station's comes at the end of the cycle. [s] >= 0
        speed: limit. [m/s] > 0
        acceleration: limit. [m/s²] > 0
        jerk: limit; None gives trapezoids. [m/s³] > 0
    """

    form: ClassVar[str] = "production_cycle"
    stations: tuple[float, ...]
    dwells: tuple[float, ...]
    speed: float
    acceleration: float
    jerk: float | None = None

    def __post_init__(self) -> None:
        """Check ranges."""
        _check_limits(self.form, self.speed, self.acceleration, self.jerk)
        if len(set(self.stations)) < 2:
            raise ParameterError(f"{self.form}: stations", list(self.stations), "at least two different positions", "m")
        if len(self.dwells) != len(self.stations) or min(self.dwells) < 0:
            raise ParameterError(f"{self.form}: dwells", list(self.dwells), "one >= 0 for each station", "s")

    def motion(self, t: ArrayLike) -> Motion:
        """Reference at times `t` >= 0 [s] (n,)."""
        pieces: list[Piece] = []
        following = (*self.stations[1:], self.stations[0])
        for begin, end, dwell in zip(self.stations, following, (*self.dwells[1:], self.dwells[0]), strict=True):
            pieces += move(end - begin, self.speed, self.acceleration, _limit(self.jerk))
            pieces += [Piece(dwell, 0.0, 0.0)] if dwell else []
        return follow(pieces, self.stations[0], np.asarray(t, dtype=np.float64), repeat=True)


def _limit(jerk: float | None) -> float:
    return math.inf if jerk is None else jerk


def _check_limits(form: str, speed: float, acceleration: float, jerk: float | None) -> None:
    _above(form, "speed", speed, "m/s")
    _above(form, "acceleration", acceleration, "m/s^2")
    _above(form, "jerk", _limit(jerk), "m/s^3")


REFERENCES: dict[str, type] = {kind.form: kind for kind in (SineMotion, PointToPoint, ProductionCycle)}
