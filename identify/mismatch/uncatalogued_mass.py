"""Mass that is in no catalogue: carried for a part of the way or of the time, hung on a spring, loose on the carriage.

What looks like it in the catalogue is a wrong mass, a torque constant, a soft transmission; like all of
`uncatalogued.py` it is located, never named.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from identify.mismatch.guise import PLACED_SPREAD, Guise, Setting, Unknown, grid
from identify.mismatch.own_curves import QUARTER
from identify.mismatch.uncatalogued_places import SIDES, TURN, past
from plant.axis import Orientation
from plant.effects.effect import Effect, Parameter
from plant.kernels.cosine import TWO_PI, cos_turns
from plant.kernels.exponential import exp_neg
from plant.kernels.laws import AFTER, FORCE, LANES, MASS, MIDDLE, SPEED, TO_STEP, VELOCITY, Rows, law
from plant.kernels.step import FASTMATH

LIGHTEST = 0.1  # of the moving mass, at least, is left where what is added is negative
HERTZ = 0.4, 10.0, 35  # starts of what swings: so close that a few swings stay in step
SHOWN = 0.05  # of the rate of the samples: frequencies that they show well
SLIPS = 0.03, 0.1, 0.3  # of the highest acceleration: beyond it what is loose may slip
SHARP = 5e-3  # of the travel: how sharply a load is picked up


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def _bear(b: Rows, x: Rows, j: int, more: float) -> None:
    """Let machine `j` bear so much `more` [kg] than its own mass, which its state `x` keeps."""
    empty = x[j] if x[j] == x[j] else b[MASS + j]
    x[j] = empty
    b[MASS + j] = max(empty + more, LIGHTEST * empty)


@law(TO_STEP)
def _load_one_way(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        carried = p[j] if p[LANES + j] * b[SPEED + j] > 0.0 else 0.0
        _bear(b, x, j, carried)
        b[FORCE + j] += p[2 * LANES + j] * carried


ONE_WAY_LOAD = Effect(
    name="one_way_load",
    parameters=(
        Parameter("mass", "kg", (-1e4, 1e4), absent=0.0, about="Δm"),
        Parameter("direction", "1", (-1.0, 1.0), reported=False, about="+1 while the position grows"),
        Parameter("gravity", "m/s^2", (0.0, 9.81), reported=False, about="that acts on it along the axis"),
    ),
    laws=(_load_one_way,),
    initial=(math.nan,),
    source="a payload that is carried one way: picked at one end, set down at the other",
)


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def _own(away: float, speed: float, omega: float, damping: float) -> float:
    """Acceleration of what swings, `away` from the axis and moving relative to it. [m/s^2]"""
    return -omega * (omega * away + 2.0 * damping * speed)


@law(TO_STEP)
def _swing(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        own = _own(x[j], x[LANES + j], TWO_PI * p[LANES + j], p[2 * LANES + j])
        b[FORCE + j] += p[j] * (own - x[2 * LANES + j])


@law(AFTER)
def _sway(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        speed = b[SPEED + j]
        before = x[3 * LANES + j] if x[3 * LANES + j] == x[3 * LANES + j] else speed
        x[2 * LANES + j], x[3 * LANES + j] = (speed - before) / h, speed
        own = _own(x[j], x[LANES + j], TWO_PI * p[LANES + j], p[2 * LANES + j])
        x[LANES + j] += h * (own - x[2 * LANES + j])
        x[j] += h * x[LANES + j]


SWINGING_LOAD = Effect(
    name="swinging_load",
    parameters=(
        Parameter("mass", "kg", (0.0, 1e4), absent=0.0, about="m_s, of the moving mass"),
        Parameter("frequency", "Hz", (0.1, 50.0), (1e-3, 1e4), about="f"),
        Parameter("damping_ratio", "1", (1e-3, 1.0), (1e-9, 10.0), about="ζ"),
    ),
    laws=(_swing, _sway),
    initial=(0.0, 0.0, 0.0, math.nan),
    source="part of the mass hangs on a spring: a pendulum, a liquid, a frame that sways",
)


@law(TO_STEP)
def _grow_heavier(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        turns, speed = p[2 * LANES + j] * TURN * b[MIDDLE + j], b[SPEED + j]
        across, along = cos_turns(turns), cos_turns(turns - QUARTER)
        heavier = p[j] * across + p[LANES + j] * along
        steeper = p[2 * LANES + j] * (p[LANES + j] * across - p[j] * along)
        _bear(b, x, j, heavier)
        b[FORCE + j] += 0.5 * steeper * speed * speed


INERTIA_ALONG = Effect(
    name="inertia_along",
    parameters=(
        Parameter("across", "kg", (-1e3, 1e3), (-1e9, 1e9), absent=0.0, about="Δm cos(n y_0)"),
        Parameter("along", "kg", (-1e3, 1e3), (-1e9, 1e9), absent=0.0, about="Δm sin(n y_0)"),
        Parameter("times", "rad/m", (0.0, 1e3), (0.0, 1e9), reported=False, about="n: waves of 2π/n"),
    ),
    laws=(_grow_heavier,),
    initial=(math.nan,),
    source="a mass that changes along the travel, m y'' + m' y'^2/2: a linkage, an arm that unfolds, a reel",
)


@law(TO_STEP)
def _load_beyond(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        carried = p[j] * past(p[2 * LANES + j] * (b[MIDDLE + j] - p[LANES + j]) / p[4 * LANES + j])
        _bear(b, x, j, carried)
        b[FORCE + j] += p[3 * LANES + j] * carried


LOAD_BEYOND = Effect(
    name="load_beyond",
    parameters=(
        Parameter("mass", "kg", (-1e4, 1e4), absent=0.0, about="Δm"),
        Parameter("place", "m", (-10.0, 10.0), (-1e9, 1e9), about="y_0"),
        Parameter("side", "1", (-1.0, 1.0), about="of y_0 on which it is carried"),
        Parameter("gravity", "m/s^2", (0.0, 9.81), reported=False, about="that acts on it along the axis"),
        Parameter("length", "m", (1e-6, 1.0), (1e-9, 1e6), reported=False, about="of the transition"),
    ),
    laws=(_load_beyond,),
    initial=(math.nan,),
    source="a payload, a chain, a second carriage that is carried along beyond one place",
)


@law(TO_STEP)
def _load_later(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:
    for j in range(LANES):
        carried = p[j] * min(max((t - p[LANES + j]) / h + 1.0, 0.0), 1.0)
        _bear(b, x, j, carried)
        b[FORCE + j] += p[2 * LANES + j] * carried


LOAD_LATER = Effect(
    name="load_later",
    parameters=(
        Parameter("mass", "kg", (-1e4, 1e4), absent=0.0, about="Δm"),
        Parameter("time", "s", (0.0, 1e5), (-1e9, 1e9), about="from which on it is carried"),
        Parameter("gravity", "m/s^2", (0.0, 9.81), reported=False, about="that acts on it along the axis"),
    ),
    laws=(_load_later,),
    initial=(math.nan,),
    source="a payload that is picked up, or set down, while the recording runs",
)


@law(TO_STEP)
def _carry_loose(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        empty = x[LANES + j] if x[LANES + j] == x[LANES + j] else b[MASS + j]
        own = x[j] if x[j] == x[j] else b[SPEED + j]
        ahead, most = b[SPEED + j] - own, p[LANES + j]
        sticks = abs(ahead) <= h * most
        x[j], x[LANES + j] = own, empty
        b[MASS + j] = empty + (p[j] if sticks else 0.0)
        b[FORCE + j] += 0.0 if sticks else (p[j] * most if ahead > 0.0 else -p[j] * most)


@law(AFTER)
def _slide_on(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        most = h * p[LANES + j]
        x[j] += min(max(b[SPEED + j] - x[j], -most), most)


LOOSE_LOAD = Effect(
    name="loose_load",
    parameters=(
        Parameter("mass", "kg", (0.0, 1e4), absent=0.0, about="m_l, of the moving mass"),
        Parameter("slips", "m/s^2", (1e-3, 1e3), (1e-9, 1e9), about="acceleration beyond which it slips"),
    ),
    laws=(_carry_loose, _slide_on),
    initial=(math.nan, math.nan),
    source="a load that lies loose on the carriage and slips where it is accelerated too fast",
)


@law(TO_STEP)
def _drag_along(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        own = x[j] if x[j] == x[j] else b[SPEED + j]
        x[j] = own
        b[FORCE + j] += p[j] * (b[SPEED + j] - own) / p[LANES + j]


@law(AFTER)
def _come_along(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        speed = b[VELOCITY + j]
        x[j] = speed + (x[j] - speed) * exp_neg(h / p[LANES + j])


DRAGGED_LOAD = Effect(
    name="dragged_load",
    parameters=(
        Parameter("mass", "kg", (0.0, 1e4), absent=0.0, about="m_d, of the moving mass"),
        Parameter("time_constant", "s", (1e-2, 100.0), (1e-6, 1e6), about="τ, after which it has come along"),
    ),
    laws=(_drag_along, _come_along),
    initial=(math.nan,),
    source="a mass that a damper drags along: oil in a housing, a load on a viscous mount, a slipping clutch",
)
EFFECTS = (ONE_WAY_LOAD, SWINGING_LOAD, INERTIA_ALONG, LOAD_BEYOND, LOAD_LATER, LOOSE_LOAD, DRAGGED_LOAD)


def carried(s: Setting) -> list[Guise]:
    """Every way in which mass is tried in recordings of this setting."""
    return [*_loads(s), *_swings(s), *_heavier(s), *_loose(s)]


def _loads(s: Setting) -> list[Guise]:
    """A payload that is carried in either direction only, beyond one place, or from one moment on."""
    mechanics = s.axis.mechanics
    gravity = ("gravity", mechanics.g if mechanics.orientation is Orientation.VERTICAL else 0.0)
    mass = Unknown("mass", 0.1 * s.mass, -0.6 * s.mass, 2.0 * s.mass)
    begun = [0.05 * s.mass]
    place = Unknown("place", 0.02 * s.travel, s.lowest, s.highest, origin=s.middle, spread=PLACED_SPREAD)
    places = (s.lowest + s.travel * np.linspace(0.2, 0.8, 4)).tolist()
    length = ("length", SHARP * s.travel)
    found = [Guise(LOAD_LATER, (mass, s.moment), grid(begun, s.moments), fixed=(gravity,), depends="time")]
    for side in SIDES:
        one_way = (("direction", side), gravity)
        found.append(Guise(ONE_WAY_LOAD, (mass,), grid(begun), fixed=one_way, depends="acceleration"))
        beyond = (("side", side), gravity, length)
        found.append(Guise(LOAD_BEYOND, (mass, place), grid(begun, places), fixed=beyond, depends="position"))
    return found


def _loose(s: Setting) -> list[Guise]:
    """A part of the mass that slips, or that comes along late."""
    mass = Unknown("mass", 0.1 * s.mass, 0.0, 0.6 * s.mass)
    slips = Unknown("slips", 1.0, 0.01, 100.0, log=True, spread=1.5)
    late = Unknown("time_constant", 0.1, 3.0 * s.sample_time, 5.0, log=True, spread=1.5)
    fastest = s.peak / s.mass
    begun = [0.05 * s.mass]
    return [
        Guise(LOOSE_LOAD, (mass, slips), grid(begun, [share * fastest for share in SLIPS]), depends="acceleration"),
        Guise(DRAGGED_LOAD, (mass, late), grid(begun, [0.04, 0.15, 0.6]), depends="acceleration"),
    ]


def _swings(s: Setting) -> list[Guise]:
    """What swings so slowly that the samples show it; beside the motor, that is what a soft transmission looks like."""
    fastest = SHOWN / s.sample_time
    hertz = [hertz for hertz in np.geomspace(*HERTZ).tolist() if hertz < fastest]
    if not hertz or s.axis.sensor.side != "load":
        return []
    swing = (
        Unknown("mass", 0.1 * s.mass, 0.0, 0.6 * s.mass),
        Unknown("frequency", 1.0, 0.5 * HERTZ[0], fastest, log=True, spread=50.0),
        Unknown("damping_ratio", 0.05, 1e-3, 0.7, log=True, spread=2.0),
    )
    return [Guise(SWINGING_LOAD, swing, grid([0.05 * s.mass], hertz, [0.03]), depends="frequency")]


def _heavier(s: Setting) -> list[Guise]:
    """A mass that changes along the travel: over half a wave of it, or of a rotary axis once and twice a turn."""
    times = (1.0, 2.0) if s.axis.is_rotary else (math.pi / s.travel,)
    masses = tuple(Unknown(name, 0.1 * s.mass, -0.8 * s.mass, 0.8 * s.mass) for name in ("across", "along"))
    starts = grid([0.05 * s.mass, -0.05 * s.mass], [0.05 * s.mass, -0.05 * s.mass])
    return [Guise(INERTIA_ALONG, masses, starts, fixed=(("times", n),), depends="position") for n in times]
