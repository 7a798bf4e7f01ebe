"""How a fitter wears an effect: scaled unknowns, bounds, weak priors and starting points for these recordings.

An effect (plant) knows its equation; a guise knows where to look for it in one set of recordings. Amplitudes are linear
and start small, time constants, widths and stiffnesses are logarithmic, a phase and its amplitude are a cosine and a
sine. A plug-in effect gets its guise from its plausible ranges.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from plant.axis import Axis
from plant.effects.effect import Effect

Floats = NDArray[np.float64]


PLACE = 30.0  # spread of the prior of an unknown that says where an effect is
MOST_PERIODS = 36.5  # of a ripple in one turn
OFF_PERIOD = 0.1  # of a period: by so much a turn may miss a whole number of them
CLOCK = 0.25  # of the recording's own period: a shift between torque and position that means nothing


@dataclass(frozen=True, slots=True)
class Setting:
    """What starting points depend on.

    Attributes:
        axis: the machine.
        force, speed, travel, mass: typical sizes in the recordings. [N], [m/s], [m], [kg]
        lowest, highest: ends of the recorded travel. [m]
        peak: largest drive force. [N]
        duration: of the longest recording. [s]
        sample_time: [s]
        rests: longest rest. [s]
        spots: positions at which the odd residual force peaks, most telling first. [m]
        periods: wave lengths at which the residual force repeats, most telling first. [m]
        free_offset: True where a constant force is free in the baseline.
        native_time: period before averaging; 0 where it is the sample time. [s]
    """

    axis: Axis
    force: float
    speed: float
    travel: float
    mass: float
    lowest: float
    highest: float
    peak: float
    duration: float
    sample_time: float
    rests: float
    spots: tuple[float, ...]
    periods: tuple[float, ...]
    free_offset: bool
    native_time: float = 0.0

    @property
    def metre(self) -> float:
        """1 m on a linear axis; as many rad on a rotary one as make its travel 0.4 m. [position unit]."""
        return self.travel / 0.4 if self.axis.is_rotary else 1.0

    @property
    def spring(self) -> float:
        """1 N/m on a linear axis; on a rotary one what is as stiff to its forces. [N·m/rad]."""
        return self.force / 100.0 / self.metre if self.axis.is_rotary else 1.0

    @property
    def middle(self) -> float:
        """Middle of the recorded travel. [m]."""
        return 0.5 * (self.lowest + self.highest)


@dataclass(frozen=True, slots=True)
class Unknown:
    """One scaled unknown z of a parameter: unit exp(z) where `log`, else origin + unit z; bounds are physical."""

    parameter: str
    unit: float
    low: float
    high: float
    log: bool = False
    origin: float = 0.0
    spread: float = 3.0

    def value(self, z: Floats) -> Floats:
        """Physical value of scaled z."""
        return np.asarray(self.unit * np.exp(z) if self.log else self.origin + self.unit * z, dtype=np.float64)

    def scaled(self, value: float) -> float:
        """Scaled z of a physical value."""
        return math.log(value / self.unit) if self.log else (value - self.origin) / self.unit


@dataclass(frozen=True, slots=True, eq=False)
class Guise:
    """One way an effect may be present.

    Attributes:
        effect: the plant's effect.
        unknowns: scaled unknowns; where `wave` is set the last two are cosine and sine amplitudes.
        starts: physical starting values, a row each, in the order of `unknowns`. (s, q)
        fixed: parameters held at a value.
        wave: names of amplitude and phase of a periodic effect.
        stiff: True where fast states need the recordings' own rate.
        turn: a period must go into it a whole number of times; None where it may be anything. [m]
        least: of the first parameter: smaller is how well the recording's clock is known. [its unit]
    """

    effect: Effect
    unknowns: tuple[Unknown, ...]
    starts: Floats
    fixed: tuple[tuple[str, float], ...] = ()
    wave: tuple[str, str] | None = None
    stiff: bool = False
    turn: float | None = None
    least: float = 0.0

    @property
    def name(self) -> str:
        """The effect's name."""
        return self.effect.name

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return len(self.unknowns)

    def bounds(self) -> tuple[Floats, Floats]:
        """Lowest and highest scaled unknowns. (q,) each"""
        low = [u.scaled(u.low) for u in self.unknowns]
        high = [u.scaled(u.high) for u in self.unknowns]
        return np.minimum(low, high), np.maximum(low, high)

    def scaled_starts(self) -> Floats:
        """Starting points as scaled unknowns. (s, q)"""
        return np.array([[u.scaled(v) for u, v in zip(self.unknowns, row, strict=True)] for row in self.starts])

    def values(self, z: Floats) -> Floats:
        """Physical values of candidates z (m, q), in the order of the effect's parameters. (k, m)"""
        given: dict[str, Floats] = {name: np.full(len(z), value) for name, value in self.fixed}
        for index, unknown in enumerate(self.unknowns):
            given[unknown.parameter] = unknown.value(z[:, index])
        if self.wave is not None:
            cosine, sine = (self.unknowns[i].value(z[:, i]) for i in (-2, -1))
            given[self.wave[0]] = np.hypot(cosine, sine)
            given[self.wave[1]] = np.arctan2(-sine, cosine)
        for parameter in self.effect.parameters:  # nuisances that nobody fits stay at their default
            if parameter.name not in given and isinstance(parameter.default, float):
                given[parameter.name] = np.full(len(z), parameter.default)
        return np.stack([given[parameter.name] for parameter in self.effect.parameters])

    def place(self) -> int | None:
        """Index of the unknown that says where the effect is: a position, a moment, a period; or None."""
        return next((index for index, unknown in enumerate(self.unknowns) if unknown.spread >= PLACE), None)

    def oddity(self, z: Floats) -> str | None:
        """Why unknowns z (q,) of a good fit cannot be this effect after all, or None."""
        first = float(self.unknowns[0].value(z[:1])[0])
        if abs(first) < self.least:
            return f"its size of {first:.2g} is below {self.least:.2g}: no recording's clock is that good"
        if self.turn is None:
            return None
        times = self.turn / first
        if not 0.5 < times < MOST_PERIODS or abs(times - round(times)) > OFF_PERIOD:
            return f"its period of {first:.3g} goes into a turn {times:.2f} times"
        return None

    def amplitude(self) -> int | None:
        """Index of the linear amplitude that is absent at zero; None where absence is a limit."""
        for index, unknown in enumerate(self.unknowns):
            if not unknown.log and unknown.origin == 0.0 and unknown.low <= 0.0 <= unknown.high:
                spec = {p.name: p for p in self.effect.parameters}.get(unknown.parameter)
                if spec is not None and spec.absent == 0.0:
                    return index
        return None


def grid(*axes: Sequence[float]) -> Floats:
    """All combinations of starting values, a row each."""
    return np.array(list(itertools.product(*axes)), dtype=np.float64)


def guises(effects: dict[str, Effect], setting: Setting) -> list[Guise]:
    """Every way in which `effects` may be present in recordings of this setting."""
    found: list[Guise] = []
    for name, effect in effects.items():
        make = TAILORED.get(name)
        found += make(effect, setting) if make is not None else [plug_in(effect)]
    return found


def plug_in(effect: Effect) -> Guise:
    """A guise from the plausible ranges alone: amplitudes small, everything else at three places of its range."""
    unknowns, axes = [], []
    fixed = []
    for p in effect.parameters:
        low, high = p.plausible
        if p.absent == 0.0:
            unknowns.append(Unknown(p.name, 0.1 * max(abs(low), abs(high)), low, high))
            axes.append([0.05 * (high if high > 0 else low)])
        elif not p.reported and p.default is not None and not callable(p.default):
            fixed.append((p.name, float(p.default)))
        elif low > 0:
            unknowns.append(Unknown(p.name, math.sqrt(low * high), low, high, log=True))
            axes.append(list(np.geomspace(low, high, 5)[1:4]))
        else:
            unknowns.append(Unknown(p.name, 0.25 * (high - low), low, high, origin=0.5 * (low + high)))
            axes.append(list(np.linspace(low, high, 5)[1:4]))
    return Guise(effect, tuple(unknowns), grid(*axes), tuple(fixed))


def _offset(e: Effect, s: Setting) -> list[Guise]:
    if s.free_offset:  # the baseline holds it already
        return []
    return [Guise(e, (Unknown("force", 0.1 * s.force, -2 * s.force, 2 * s.force),), grid([0.02 * s.force]))]


def _ratio(parameter: str, unit: float, limit: float, start: float) -> Callable[[Effect, Setting], list[Guise]]:
    """One dimensionless amplitude between ± limit."""

    def make(e: Effect, s: Setting) -> list[Guise]:  # noqa: ARG001
        return [Guise(e, (Unknown(parameter, unit, -limit, limit),), grid([start]))]

    return make


def _position_friction(e: Effect, s: Setting) -> list[Guise]:
    steepest = 1.0 / (0.5 * s.travel)
    return [Guise(e, (Unknown("relative_slope", 0.3 * steepest, -steepest, steepest),), grid([0.05 * steepest]))]


def _defect(e: Effect, s: Setting) -> list[Guise]:
    metre = s.metre
    widest = min(0.2 * metre, 0.25 * s.travel)
    unknowns = (
        Unknown("amplitude", 0.1 * s.force, -2 * s.force, 2 * s.force),
        Unknown("centre", 0.02 * s.travel, s.lowest, s.highest, origin=s.middle, spread=50.0),
        Unknown("width", 0.02 * metre, 0.002 * metre, 0.2 * metre, log=True, spread=1.5),
    )
    widths = [w * metre for w in (0.006, 0.02, 0.06) if w * metre <= widest] or [0.006 * metre]
    rows = [
        (0.05 * s.force, centre, width)
        for width in widths
        for centre in np.arange(s.lowest + width, s.highest, min(1.5 * width, 0.1 * s.travel))
    ]
    rows += [(0.05 * s.force, spot, width) for spot in s.spots for width in widths]
    return [Guise(e, unknowns, np.array(rows))]


def _bristles(e: Effect, s: Setting) -> list[Guise]:
    soft, unit, hard = max(1e3 * s.spring, s.force / (0.25 * s.travel)), 1e5 * s.spring, 1e7 * s.spring
    damping = max(0.6 * math.sqrt(unit * s.mass), 1e-9)
    unknowns = (
        Unknown("bristle_stiffness", unit, soft, hard, log=True),
        Unknown("bristle_damping", damping, 1e-3 * damping, 1e2 * damping, log=True, spread=1.5),
    )
    ways = [share * unit for share in (0.2, 0.6, 2.0, 6.0, 30.0)]
    rows = [(k, 0.6 * math.sqrt(k * s.mass)) for k in ways if soft < k < hard]
    return [Guise(e, unknowns, np.array(rows), stiff=True)] if rows else []


def _backlash(e: Effect, s: Setting) -> list[Guise]:
    if not _two_masses(s):
        return []
    return [Guise(e, (Unknown("gap", 3e-4, 1e-5, 1e-2, log=True),), grid([3e-5, 1e-4, 4e-4, 1.5e-3]), stiff=True)]


def _compliance(e: Effect, s: Setting) -> list[Guise]:
    if not _two_masses(s):
        return []
    unknowns = (
        Unknown("stiffness", 3e4, 1e3, 1e6, log=True),
        Unknown("damping", 30.0, 0.3, 1e4, log=True, spread=2.0),
    )
    return [Guise(e, unknowns, np.array([(1e4, 15.0), (4e4, 30.0), (1.6e5, 60.0), (6.4e5, 120.0)]), stiff=True)]


def _two_masses(s: Setting) -> bool:
    """True where the axis file splits the inertia into motor and load."""
    mechanics = s.axis.mechanics
    return mechanics.inertia_known and mechanics.M > 0 and mechanics.J > 0 and not s.axis.is_rotary


def _waves(
    e: Effect,
    amplitude: str,
    unit: float,
    limit: float,
    periods: list[float],
    fixed: tuple[tuple[str, float], ...],
    turn: float | None,
    room: tuple[float, float] = (0.5, 2.0),
) -> Guise:
    """A periodic effect: logarithmic period, cosine and sine amplitude; two quadratures start it."""
    unknowns = (
        Unknown("period", 1.0, room[0] * min(periods), room[1] * max(periods), log=True, spread=50.0),
        Unknown(amplitude, unit, -limit, limit),
        Unknown("phase", unit, -limit, limit),
    )
    rows = [(period, *pair) for period in periods for pair in ((0.3 * unit, 0.0), (0.0, 0.3 * unit))]
    return Guise(e, unknowns, np.array(rows), fixed, wave=(amplitude, "phase"), turn=turn)


def _ripple(e: Effect, s: Setting) -> list[Guise]:
    mechanics = s.axis.mechanics
    turn = 2.0 * math.pi * mechanics.Rm
    periods = [p for p in (turn, turn / 2, turn / 3, turn / 6, *s.periods) if 1e-3 * s.travel < p < s.travel]
    if not periods:
        return []
    known = None if mechanics.Rm == 1.0 and not s.axis.is_rotary else turn  # an axis file may leave the radius out
    return [
        _waves(e, "amplitude", 0.1 * s.force, s.force, periods, (("relative_amplitude", 0.0),), known),
        _waves(e, "relative_amplitude", 0.1, 0.5, periods, (("amplitude", 0.0),), known),
    ]


def _eccentricity(e: Effect, s: Setting) -> list[Guise]:
    turn = 2.0 * math.pi * s.axis.mechanics.Rc
    periods = [p for p in (turn,) if p < 4.0 * s.travel] or []
    return [_waves(e, "relative_eccentricity", 0.1, 0.3, periods, (), turn, (0.8, 1.25))] if periods else []


def _thermal(e: Effect, s: Setting) -> list[Guise]:
    unknowns = (
        Unknown("relative_drop", 0.3, -0.9, 5.0),
        Unknown("time_constant", s.duration, min(1.0, 0.1 * s.duration), 3600.0, log=True, spread=2.0),
    )
    return [Guise(e, unknowns, grid([0.1], [0.15 * s.duration, 0.5 * s.duration, 2.0 * s.duration]))]


def _drag(e: Effect, s: Setting) -> list[Guise]:
    unit = s.force / s.speed**2
    return [Guise(e, (Unknown("coefficient", 0.3 * unit, -3 * unit, 3 * unit),), grid([0.05 * unit]))]


def _spring(e: Effect, s: Setting) -> list[Guise]:
    unit = 0.3 * s.force / s.travel
    limit = 30.0 * unit
    return [
        Guise(
            e,
            (
                Unknown("stiffness", unit, -limit, limit),
                Unknown("rest_position", s.travel, s.middle - 20 * s.travel, s.middle + 20 * s.travel, origin=s.middle),
            ),
            grid([0.1 * unit], [s.middle]),
        )
    ]


def _lag(parameter: str) -> Callable[[Effect, Setting], list[Guise]]:
    """A time between 0 and 0.2 s."""

    def make(e: Effect, s: Setting) -> list[Guise]:
        rows = [v for v in (0.5 * s.sample_time, 2 * s.sample_time, 0.03, 0.08) if v < 0.15]
        least = CLOCK * (s.native_time or s.sample_time)
        return [Guise(e, (Unknown(parameter, 0.02, 0.0, 0.2),), grid(rows), least=least)]

    return make


def _saturation(e: Effect, s: Setting) -> list[Guise]:
    gain = abs(s.axis.mechanics.gain)
    peak = s.peak / gain
    unknowns = (Unknown("limit", peak, 0.2 * peak, 1.02 * peak, log=True),)
    return [Guise(e, unknowns, grid([0.99 * peak, 0.97 * peak, 0.9 * peak, 0.8 * peak, 0.65 * peak, 0.5 * peak]))]


def _dwell(e: Effect, s: Setting) -> list[Guise]:
    if s.rests < 0.1:
        return []
    unknowns = (
        Unknown("stiction_rise", 0.1 * s.force, 0.0, 2 * s.force),
        Unknown("time_constant", 1.0, 0.01, 100.0, log=True, spread=1.5),
    )
    return [Guise(e, unknowns, grid([0.05 * s.force], [0.1, 0.5, 3.0]))]


def _end_stop(e: Effect, s: Setting) -> list[Guise]:
    found = []
    for end, side in ((s.highest, 1.0), (s.lowest, -1.0)):
        inner = sorted((s.middle, end + side * 0.02 * s.travel))
        unknowns = (
            Unknown("position", 0.02 * s.travel, inner[0], inner[1], origin=end, spread=30.0),
            Unknown("stiffness", 1e4 * s.spring, 1e2 * s.spring, 1e6 * s.spring, log=True),
        )
        depths = [share * s.travel for share in (0.01, 0.03, 0.08, 0.16)]
        rows = [(end - side * depth, push * s.force / depth) for depth in depths for push in (0.03, 0.2, 1.0)]
        found.append(Guise(e, unknowns, np.clip(np.array(rows), (-np.inf, 1e2 * s.spring), (np.inf, 1e6 * s.spring))))
    return found


def _step(e: Effect, s: Setting) -> list[Guise]:
    unknowns = (
        Unknown("step", 0.1 * s.force, -2 * s.force, 2 * s.force),
        Unknown("time", 0.03 * s.duration, 0.0, s.duration, spread=100.0),
    )
    times = np.linspace(0.0, s.duration, 26)[1:-1]
    return [Guise(e, unknowns, grid([0.05 * s.force], list(times)))]


def _inertia(e: Effect, s: Setting) -> list[Guise]:
    if not s.axis.mechanics.inertia_known:
        return []
    unknown = Unknown("mass_error", 0.2 * s.mass, -0.8 * s.mass, 4.0 * s.mass)
    shares = [1.0, 0.0] if s.axis.mechanics.weight > 0 else [0.0]
    names = {p.name for p in e.parameters}
    if "weight_share" not in names:
        return [Guise(e, (unknown,), grid([0.03 * s.mass]))]
    return [Guise(e, (unknown,), grid([0.03 * s.mass]), (("weight_share", share),)) for share in shares]


TAILORED: dict[str, Callable[[Effect, Setting], list[Guise]]] = {
    "force_offset": _offset,
    "coulomb_asymmetry": _ratio("asymmetry_ratio", 0.1, 0.6, 0.02),
    "viscous_asymmetry": _ratio("asymmetry_ratio", 0.2, 0.9, 0.05),
    "position_dependent_friction": _position_friction,
    "rail_defect": _defect,
    "presliding_hysteresis": _bristles,
    "backlash": _backlash,
    "transmission_compliance": _compliance,
    "torque_ripple": _ripple,
    "pulley_eccentricity": _eccentricity,
    "load_dependent_friction": _ratio("coefficient", 0.1, 0.6, 0.02),
    "thermal_drift": _thermal,
    "quadratic_drag": _drag,
    "position_spring": _spring,
    "inertia_error": _inertia,
    "torque_scale_error": _ratio("relative_error", 0.1, 0.5, 0.03),
    "actuator_lag": _lag("time_constant"),
    "dead_time": _lag("delay"),
    "torque_saturation": _saturation,
    "dwell_time_stiction": _dwell,
    "end_stop": _end_stop,
    "step_change": _step,
}
