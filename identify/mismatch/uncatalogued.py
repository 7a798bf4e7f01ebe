"""Physics that is in no catalogue, tried so that it is not taken for what is in it: it is located, never named.

Each is an effect like those of the plant, and competes with them. Where one is clearly the likeliest, no name of the
catalogue stands, and the answer is the coordinate that it depends on. Drags that bend over the speed are not among
them: the Stribeck curves of healthy machines, which are not quite eq. (1), look like such drags.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Collection, Sequence

import numpy as np
from numba import njit

from identify.mismatch.guise import Guise, Setting, Unknown, grid
from identify.mismatch.own_curves import QUARTER
from identify.mismatch.uncatalogued_drive import EFFECTS as DRIVES
from identify.mismatch.uncatalogued_drive import driven
from identify.mismatch.uncatalogued_mass import EFFECTS as MASSES
from identify.mismatch.uncatalogued_mass import LOAD_BEYOND, LOAD_LATER, SWINGING_LOAD, carried
from identify.mismatch.uncatalogued_memory import EFFECTS as MEMORIES
from identify.mismatch.uncatalogued_memory import FRESH_DRAG, VISCOUS_LATER, remembering
from identify.mismatch.uncatalogued_places import EFFECTS as PLACES
from identify.mismatch.uncatalogued_places import SIDES, TURN, interval, placed
from identify.mismatch.ways_place import waves
from plant.effects.effect import Effect, Parameter
from plant.kernels.cosine import TWO_PI, cos_turns
from plant.kernels.exponential import exp_neg
from plant.kernels.laws import (
    AFTER,
    BACKWARD,
    FORCE,
    FORWARD,
    LANES,
    LEVEL,
    MIDDLE,
    SPEED,
    TO_STEP,
    VELOCITY,
    VISCOUS_BACKWARD,
    VISCOUS_FORWARD,
    Rows,
    law,
)
from plant.kernels.step import FASTMATH

OPEN = 0.7  # of the travel, at most, before a pull begins: nearer to an end, it is a stop that gives back too little
WIDTH = 1.25  # of a frequency: what swings answers so much below and above it
PLAY = 5e-3, 0.4  # of the travel: less is a spring, more hardly pulls
WORN = 2.5  # times its way or time: then 8 % are left of a drag
MOST_WAVES = 20  # of a level along the travel


@law(TO_STEP)
def _pull_back(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        rest = x[j] if x[j] == x[j] else b[MIDDLE + j]
        b[FORCE + j] += p[j] * (b[MIDDLE + j] - rest)


@law(AFTER)
def _creep(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        place = b[MIDDLE + j]
        rest = x[j] if x[j] == x[j] else place
        x[j] = place + (rest - place) * exp_neg(h / p[LANES + j])


CREEPING_SPRING = Effect(
    name="creeping_spring",
    parameters=(
        Parameter("stiffness", "N/m", (0.0, 1e6), absent=0.0, about="k"),
        Parameter("time_constant", "s", (1e-2, 1e2), (1e-6, 1e6), about="τ"),
    ),
    laws=(_pull_back, _creep),
    initial=(math.nan,),
    source="Maxwell's spring and damper in series: seals, hoses",
)


@law(TO_STEP)
def _pull_along(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        b[FORCE + j] += p[j] * x[j]


@law(AFTER)
def _bend(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        velocity = b[VELOCITY + j]
        end = 1.0 if velocity > 0.0 else -1.0
        x[j] = end + (x[j] - end) * exp_neg(h * abs(velocity) / p[LANES + j])


CABLE = Effect(
    name="cable_hysteresis",
    parameters=(
        Parameter("force", "N", (0.0, 1e3), absent=0.0, about="A"),
        Parameter("travel", "m", (1e-4, 1.0), (1e-9, 1e6), about="d"),
    ),
    laws=(_pull_along, _bend),
    initial=(0.0,),
    source="Dahl's curve beside dry friction, soft enough to show: cable chains, seals, flexures",
)


@law(TO_STEP)
def _wavy_level(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        more = p[LANES + j] * cos_turns(b[MIDDLE + j] / p[j] + TURN * p[2 * LANES + j])
        b[FORWARD + j] *= 1.0 + more
        b[BACKWARD + j] *= 1.0 + more


LEVEL_RIPPLE = Effect(
    name="level_ripple",
    parameters=(
        Parameter("period", "m", (1e-3, 1.0), (1e-6, 1e3), about="λ"),
        Parameter("relative_amplitude", "1", (0.0, 1.0), (-2.0, 2.0), absent=0.0, about="a"),
        Parameter("phase", "rad", (-math.pi, math.pi), default=0.0, reported=False, about="φ"),
    ),
    laws=(_wavy_level,),
    source="dry friction that rises and falls along the guide",
)


@law(TO_STEP)
def _one_way(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        half = 0.5 * p[j] * max(p[3 * LANES + j] * (b[MIDDLE + j] - p[LANES + j]), 0.0)
        b[LEVEL + j] += half
        b[FORCE + j] += half * p[2 * LANES + j]


ONE_WAY_PULL = Effect(
    name="one_way_pull",
    parameters=(
        Parameter("slope", "N/m", (-1e6, 1e6), absent=0.0, about="k"),
        Parameter("begin", "m", (-10.0, 10.0), (-1e9, 1e9), about="y_0"),
        Parameter("direction", "1", (-1.0, 1.0), reported=False, about="+1 while the position grows"),
        Parameter("side", "1", (-1.0, 1.0), about="of y_0 on which it acts"),
    ),
    laws=(_one_way,),
    source="a hose that is pulled out and falls in, a wiper that pushes debris",
)


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def _dragged(held: float, place: float, half: float) -> float:
    """Where the end of a spring is that was `held` (nan: nobody knows), `half` the play from the `place` at most."""
    return min(max(held if held == held else place, place - half), place + half)


@law(TO_STEP)
def _pull_past_play(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        b[FORCE + j] += p[j] * (_dragged(x[j], b[MIDDLE + j], p[2 * LANES + j]) - p[LANES + j])


@law(AFTER)
def _drag_play(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        x[j] = _dragged(x[j], b[MIDDLE + j], p[2 * LANES + j])


SPRING_WITH_PLAY = Effect(
    name="spring_with_play",
    parameters=(
        Parameter("stiffness", "N/m", (-2000.0, 2000.0), absent=0.0, about="k"),
        Parameter("rest_position", "m", (-10.0, 10.0), (-1e9, 1e9), about="y_0"),
        Parameter("half_play", "m", (1e-4, 1.0), (0.0, 1e6), absent=0.0, about="w"),
    ),
    laws=(_pull_past_play, _drag_play),
    initial=(math.nan,),
    source="a spring behind a free travel (play operator): cable chains, counterbalances on worn pins",
)


@law(TO_STEP)
def _hang(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        turns = TURN * b[MIDDLE + j]
        b[FORCE + j] += p[j] * cos_turns(turns) + p[LANES + j] * cos_turns(turns - QUARTER)


HANGING_ARM = Effect(
    name="hanging_arm",
    parameters=(
        Parameter("across", "N", (-1e3, 1e3), (-1e9, 1e9), absent=0.0, about="m g l cos(y_0)"),
        Parameter("along", "N", (-1e3, 1e3), (-1e9, 1e9), absent=0.0, about="m g l sin(y_0)"),
    ),
    laws=(_hang,),
    source="the weight of an arm or an unbalance, with the sine of the angle",
)


@law(TO_STEP)
def _thicken(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        away = b[MIDDLE + j] - p[LANES + j]
        more = p[j] * away * away
        b[VISCOUS_FORWARD + j] += more
        b[VISCOUS_BACKWARD + j] += more


VISCOUS_ALONG = Effect(
    name="viscous_along",
    parameters=(
        Parameter("coefficient", "N*s/m^3", (-1e5, 1e5), (-1e12, 1e12), absent=0.0, about="c"),
        Parameter("centre", "m", (-10.0, 10.0), (-1e9, 1e9), about="y_0"),
    ),
    laws=(_thicken,),
    source="viscous friction that changes along the guide: grease that has been pushed to its ends, a bent rail",
)


@law(TO_STEP)
def _drag_by_acceleration(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        acceleration, speed = x[j], b[SPEED + j]
        acts = p[LANES + j] * acceleration * speed >= 0.0
        b[LEVEL + j] += p[j] * abs(acceleration) if acts else 0.0
        x[LANES + j] = speed


@law(AFTER)
def _accelerate(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        x[j] = (b[SPEED + j] - x[LANES + j]) / h


INERTIAL_DRAG = Effect(
    name="inertial_drag",
    parameters=(
        Parameter("coefficient", "kg", (-1e3, 1e3), (-1e9, 1e9), absent=0.0, about="c"),
        Parameter("sign", "1", (-1.0, 1.0), reported=False, about="+1 while speeding up, -1 while braking, 0 always"),
    ),
    laws=(_drag_by_acceleration, _accelerate),
    initial=(0.0, 0.0),
    source="dry friction that acceleration raises: an overhung mass that tilts its carriage, a brake that drags",
)


EFFECTS = (
    CREEPING_SPRING,
    CABLE,
    LEVEL_RIPPLE,
    ONE_WAY_PULL,
    SPRING_WITH_PLAY,
    HANGING_ARM,
    VISCOUS_ALONG,
    INERTIAL_DRAG,
    *MASSES,
    *MEMORIES,
    *DRIVES,
    *PLACES,
)
PLACED = {
    FRESH_DRAG.name,
    ONE_WAY_PULL.name,
    LOAD_BEYOND.name,
    LOAD_LATER.name,
    SWINGING_LOAD.name,
    VISCOUS_LATER.name,
    *(effect.name for effect in PLACES),
}  # act in part of their coordinate


def uncatalogued(s: Setting, named: Collection[str] = ()) -> list[Guise]:
    """Every way in which physics outside the catalogue is tried in recordings of this setting.

    Args:
        s: the setting.
        named: effects that have a name, those of plug-ins among them: what is one of them is none of these.
    """
    stiff = s.force / s.travel
    creep = Unknown("time_constant", 0.3, 0.01, 0.5 * s.duration, log=True, spread=2.0)
    travel = Unknown("travel", 0.1 * s.travel, 3e-3 * s.travel, 2.0 * s.travel, log=True, spread=1.5)
    spring = Unknown("stiffness", 0.3 * stiff, 0.0, 30.0 * stiff)
    force = Unknown("force", 0.1 * s.force, 0.0, 2.0 * s.force)
    bends = [share * s.travel for share in (0.01, 0.05, 0.2)]
    periods = [*s.periods, *(s.travel / np.arange(1.0, MOST_WAVES + 1.0))]
    ripple = waves(LEVEL_RIPPLE, "relative_amplitude", 0.1, 1.0, periods, (), None)
    every = [
        _tried(CREEPING_SPRING, (spring, creep), [0.1 * stiff], [0.05, 0.3, 1.5, 6.0], depends="time_since_reversal"),
        _tried(CABLE, (force, travel), [0.05 * s.force], bends, depends="distance_since_reversal"),
        dataclasses.replace(ripple, depends="position"),
    ]
    every += [
        _plays(s, stiff),
        *_hangs(s),
        _along_travel(s),
        *remembering(s),
        *_inertial(s),
        *_pulls(s, stiff),
        *carried(s),
        *driven(s),
        *placed(s),
    ]
    return [guise for guise in every if guise.name not in named]


def _plays(s: Setting, stiff: float) -> Guise:
    """A spring behind a free travel; `stiff` is a usual slope. [N/m]"""
    unknowns = (
        Unknown("stiffness", 0.3 * stiff, -30.0 * stiff, 30.0 * stiff),
        Unknown("rest_position", s.travel, s.middle - 20 * s.travel, s.middle + 20 * s.travel, origin=s.middle),
        Unknown("half_play", 0.05 * s.travel, PLAY[0] * s.travel, PLAY[1] * s.travel, log=True, spread=1.5),
    )
    plays = [share * s.travel for share in (0.02, 0.06, 0.15)]
    return _tried(SPRING_WITH_PLAY, unknowns, [0.03 * stiff], [s.middle], plays, depends="position")


def _hangs(s: Setting) -> list[Guise]:
    """The weight of what a rotary axis turns."""
    if not s.axis.is_rotary:
        return []
    moments = tuple(Unknown(name, 0.1 * s.force, -30.0 * s.force, 30.0 * s.force) for name in ("across", "along"))
    starts = 0.03 * s.force * np.array([(np.cos(angle), np.sin(angle)) for angle in TWO_PI * np.arange(LANES) / LANES])
    return [Guise(HANGING_ARM, moments, starts, depends="position")]


def _along_travel(s: Setting) -> Guise:
    """Viscous friction that grows with the square of the distance from some place."""
    unit = 0.3 * s.force / s.speed / s.travel**2
    unknowns = (
        Unknown("coefficient", unit, -100.0 * unit, 100.0 * unit),
        Unknown("centre", 0.2 * s.travel, s.lowest - s.travel, s.highest + s.travel, origin=s.middle),
    )
    places = [s.middle + share * s.travel for share in (-1.0, -0.3, 0.0, 0.3, 1.0)]
    return _tried(VISCOUS_ALONG, unknowns, [0.1 * unit], places, depends="position")


def _inertial(s: Setting) -> list[Guise]:
    """Dry friction that grows with acceleration: always, while speeding up, while braking."""
    drag = Unknown("coefficient", 0.1 * s.mass, -0.9 * s.mass, 2.0 * s.mass)
    tried = _tried(INERTIAL_DRAG, (drag,), [0.05 * s.mass], depends="acceleration")
    return [dataclasses.replace(tried, fixed=(("sign", sign),)) for sign in (0.0, *SIDES)]


def _pulls(s: Setting, stiff: float) -> list[Guise]:
    """What pulls in either direction, growing from some place towards either end; `stiff` is a usual slope. [N/m]"""
    slope = Unknown("slope", stiff, -50.0 * stiff, 50.0 * stiff)
    found = []
    for way, side in itertools.product(SIDES, SIDES):
        start = s.lowest if side > 0.0 else s.highest
        low, high = sorted((start, start + side * OPEN * s.travel))
        begin = Unknown("begin", 0.02 * s.travel, low, high, origin=s.middle, spread=50.0)
        begins = [start + side * share * s.travel for share in (0.02, 0.2, 0.4, 0.6)]
        one_way = _tried(ONE_WAY_PULL, (slope, begin), [0.1 * stiff], begins, depends="position")
        found.append(dataclasses.replace(one_way, fixed=(("direction", way), ("side", side))))
    return found


def acts_in(name: str, values: dict[str, float], reached: tuple[float, float], constant: float) -> tuple[float, float]:
    """Where on its coordinate, of which the recordings `reached` so much, physics that is `PLACED` acts.

    Beside it there is a `constant` force. [N]
    """
    low, high = reached
    if name == SWINGING_LOAD.name:
        return values["frequency"] / WIDTH, values["frequency"] * WIDTH
    if name == FRESH_DRAG.name:
        return 0.0, min(WORN * min(values["travel"], values["time_constant"]), high)  # the other one is endless
    if name in {LOAD_LATER.name, VISCOUS_LATER.name}:
        return min(values["time"], high), high
    begin = {ONE_WAY_PULL.name: "begin", LOAD_BEYOND.name: "place"}.get(name)
    if begin is None:
        return interval(name, values, reached, constant)
    return (min(values[begin], high), high) if values["side"] > 0.0 else (low, max(values[begin], low))


def _tried(effect: Effect, unknowns: tuple[Unknown, ...], *starts: Sequence[float], depends: str) -> Guise:
    """Physics that `depends` on a coordinate, from all combinations of starting values."""
    return Guise(effect, unknowns, grid(*starts), depends=depends)
