"""How a fitter wears an effect: scaled unknowns, bounds, weak priors and starting points for these recordings.

An effect (plant) knows its equation; a guise knows where to look for it in one set of recordings. Amplitudes are linear
and start small, time constants, widths and stiffnesses are logarithmic, a phase and its amplitude are a cosine and a
sine. Which effects may be present how: `ways.py`.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from plant.axis import Axis
from plant.effects.effect import Effect

Floats = NDArray[np.float64]
Way = tuple[str, tuple[tuple[str, float], ...]]


STRONG = 100.0  # N: forces of the machines that the catalogue's stiffnesses are for
PLACE = 30.0  # spread of the prior of an unknown that says where an effect is
MOST_PERIODS = 36.5  # of a ripple in one turn
OFF_WHOLE = 0.003  # relative: how well the radius that makes a turn is known
OFF_PERIOD = 0.1  # of a period: by so much a turn may miss a whole number of them
SWINGS = 0.5  # damping ratio of a spring that still swings
NO_FINDING = "less is no finding"  # end of the reason that a size is too small to be told
OWN_CURVE = "its curve is another"  # beginning of the reason that a likely effect is not what it is called
CLOCK = 0.25  # of the recording's own period: a shift between torque and position that means nothing
STIFF = 2e-5  # m: bristles that bend no further than this before they slide cannot be told from none
PLACED_SPREAD = 50.0  # of an unknown that says where or when something is
TRAVEL = 0.4  # m: of a rotary axis, all of it counts as so much; an ordinary one


def metre(axis: Axis, travel: float) -> float:
    """1 m on a linear axis; as many rad on a rotary one as make its `travel` [rad] `TRAVEL`. [position unit]."""
    return travel / TRAVEL if axis.is_rotary else 1.0


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
        reverses: whether the force that the transmission carries changes its sign, but for a few samples.
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
    reverses: bool = True

    @property
    def metre(self) -> float:
        """See `metre`. [position unit]."""
        return metre(self.axis, self.travel)

    @property
    def spring(self) -> float:
        """1 N/m on a linear axis; on a rotary or a weak one what is as stiff to its forces. [N/m or N·m/rad]."""
        share = self.force / STRONG
        return share / self.metre if self.axis.is_rotary else min(share, 1.0)

    @property
    def moment(self) -> Unknown:
        """When something happens for good, as an unknown. [s]"""
        half = 0.5 * self.duration
        return Unknown("time", 0.02 * self.duration, 0.0, self.duration, origin=half, spread=PLACED_SPREAD)

    @property
    def moments(self) -> list[float]:
        """Where one is looked for. [s]"""
        return [float(moment) for moment in self.duration * np.linspace(0.15, 0.85, 6)]

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
        rugged: True where the likelihood has many peaks, which a slope does not lead across.
        turn: a period must go into it a whole number of times; None where it may be anything. [m]
        swings: mass on the spring of stiffness and damping that the unknowns are; None where they are none. [kg]
        least: of the first parameter: smaller is how well clocks, data sheets and surfaces are known. [its unit]
        depends: coordinate of physics that is in no catalogue; None for an effect that may be named.
        freed: the same effect, its own curve free to bend; None where the catalogue's is the only one.
        shapes: parameters by which a freed curve bends.
        bends: scaled values of the first of them to begin at.
        endless: those of them whose bound is as good as a law of its own, and no sign of another effect.
        allows: says of parameter values why a curve so bent is no such effect, or None.
    """

    effect: Effect
    unknowns: tuple[Unknown, ...]
    starts: Floats
    fixed: tuple[tuple[str, float], ...] = ()
    wave: tuple[str, str] | None = None
    stiff: bool = False
    rugged: bool = False
    turn: float | None = None
    swings: float | None = None
    least: float = 0.0
    depends: str | None = None
    freed: Guise | None = None
    shapes: tuple[str, ...] = ()
    bends: tuple[float, ...] = (0.0,)
    endless: frozenset[str] = frozenset()
    allows: Callable[[dict[str, float]], str | None] | None = None

    @property
    def name(self) -> str:
        """The effect's name."""
        return self.effect.name

    @property
    def way(self) -> Way:
        """Which of the ways to look for the effect this is."""
        return self.name, self.fixed

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

    def value(self, z: Floats, parameter: str) -> float:
        """Physical value of an unknown `parameter` of z (q,)."""
        unknown = self.unknown(parameter)
        return float(unknown.value(z[self.unknowns.index(unknown)]))

    def unknown(self, parameter: str) -> Unknown:
        """The unknown of this `parameter`."""
        return next(unknown for unknown in self.unknowns if unknown.parameter == parameter)

    def tells(self, parameter: str) -> bool:
        """Whether results hold a parameter; a nuisance may end anywhere."""
        return next(p.reported for p in self.effect.parameters if p.name == parameter)

    def optional(self, parameter: str) -> bool:
        """Whether an effect is itself without this parameter, whose logarithm only ends at a bound: a damping."""
        return next(p.default == 0.0 and p.plausible[0] == 0.0 for p in self.effect.parameters if p.name == parameter)

    def place(self) -> int | None:
        """Index of the unknown that says where the effect is: a position, a moment, a period; or None."""
        return next((index for index, unknown in enumerate(self.unknowns) if unknown.spread >= PLACE), None)

    def bound_to(self, times: int) -> Guise:
        """The same wave, `times` of which make a turn. Raises TypeError where no turn is known."""
        if self.turn is None:
            raise TypeError(f"{self.name} has no turn")
        period = dataclasses.replace(self.unknowns[0], unit=self.turn / times, spread=OFF_WHOLE)
        return dataclasses.replace(self, unknowns=(period, *self.unknowns[1:]))

    def oddity(self, z: Floats, share: float = 1.0) -> str | None:
        """Why unknowns z (q,) of a good fit, if at least a `share` of `least`, cannot be this effect, or None."""
        first, least = float(self.unknowns[0].value(z[:1])[0]), share * self.least
        if abs(first) < least:
            return f"its size of {first:.2g} is below {least:.2g}: {NO_FINDING}"
        if first < 0.0 and self.effect.parameters[0].plausible[0] == 0.0 == self.effect.parameters[0].absent:
            return f"its size of {first:.2g} is negative, which is no {self.name.replace('_', ' ')}"
        if self.allows is not None:
            names = [parameter.name for parameter in self.effect.parameters]
            bent = self.allows(dict(zip(names, map(float, self.values(z[None])[:, 0]), strict=True)))
            if bent is not None:
                return f"{OWN_CURVE}: {bent}"
        if self.swings is not None:
            damping = self.damping_ratio(z, self.swings)
            if damping > SWINGS:
                return f"it does not swing (damping ratio {damping:.2g}): no transmission is so damped"
        if self.turn is None:
            return None
        times = self.turn / first
        if not 0.5 < times < MOST_PERIODS or abs(times - round(times)) > OFF_PERIOD:
            return f"its period of {first:.3g} goes into a turn {times:.2f} times"
        return None

    def damping_ratio(self, z: Floats, mass: float) -> float:
        """Damping ratio of `mass` [kg] on the spring of stiffness and damping that unknowns z (q,) begin with. [1]"""
        stiffness, damping = (float(self.unknowns[i].value(z[i : i + 1])[0]) for i in range(2))
        return damping / (2.0 * math.sqrt(stiffness * mass))

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
