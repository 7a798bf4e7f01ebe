"""A name put to the test by the nearest law that is not it: the same effect, its own curve free to bend.

The catalogue knows the shapes of its effects imperfectly. A counterbalance is progressive, a ripple has a second
harmonic, a drag another exponent than 2: what a fixed curve leaves of them looks like another effect, or like none. And
what is no such effect at all often wears its name: friction in one place is a rail defect where it acts both ways, a
drag of the third power is no quadratic drag. So where a name is likely, its curve is freed from where it was fitted; if
that explains clearly more, what it bends to decides: a shape the name allows is taken into account, any other takes the
name away. Both are judged like every step.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numba import njit
from numpy.typing import NDArray

from identify.mismatch.guise import Guise, Setting, Unknown
from identify.mismatch.ways_memory import MOTOR_RUBS, RUBBING
from plant.effects.dwell_time_stiction import rests_for
from plant.effects.effect import Effect, Parameter
from plant.effects.end_stop import NO_TRAVEL, stop_depth
from plant.kernels.cosine import cos_turns
from plant.kernels.exponential import exp_neg, power
from plant.kernels.laws import (
    AFTER,
    BACKWARD,
    BRISTLE_STIFFNESS,
    CLIMB,
    DRAG,
    DRIVE,
    FORCE,
    FORWARD,
    LANES,
    LEVEL,
    MASS,
    MIDDLE,
    MOTOR_FORCE,
    MOTOR_MIDDLE,
    RISE,
    SPEED,
    TO_DRIVE,
    TO_STEP,
    TRANSMITTED,
    VELOCITY,
    VISCOUS_BACKWARD,
    VISCOUS_FORWARD,
    Law,
    Rows,
    law,
)
from plant.kernels.step import FASTMATH

if TYPE_CHECKING:
    from plant.machine import Machine

Floats = NDArray[np.float64]

TURN = 0.5 / math.pi
QUARTER = 0.25  # of a turn: from a cosine to a sine
SLOWEST = 1e-3  # of the usual speed or load: below it, a power of it is as if it were so much
NEARLY = 0.5  # from 1, at most: another exponent of what goes with the load
EXPONENTS = 0.6  # from the catalogue's power of the speed: what falls or grows otherwise is another effect
ONE_WAY = 0.5  # of a defect's force: what pushes more than it rubs is none
FLAT, STRETCH = 0.1, 0.25  # of a defect: flatter and longer, of the travel, it is a stretch of another guide
SOFTENS, STEEPENS = 0.5, 2.2  # from 1, at most: other powers of a stop's depth; less hardly grows and is a weight
STEEPEST = 0.1  # of a spring's greatest slope within INNER: where it has less anywhere, it is none
INNER = 0.8  # of half the travel
FOLLOWS = 1.0  # beyond none and all: the share of the motor's inertia that follows the radius of its pulley
LEAST = 1e-6  # bend, share of an age: none
LENGTHS = 4.0  # times the longest slip of contacts that age exponentially
SLOWS = 10.0  # power of a contact's youth, past 1, by which it ages: there it is as good as the logarithm
YIELDS = -0.97, 3.0  # past 1, the power with which bristles yield
LASTING = "lasts"
LASTS = 0.15  # of the longest recording, at most, that a step takes: what takes longer is a drift
SECOND = 0.6  # of a wave, at most: each quadrature of its second harmonic
OUTER = 1.2  # of half the travel: beyond it curves bend no further
SOFTER, HARDER = 0.3, 30.0  # times a belt's stiffness: what its peak stretch may take off, or add
BIG = 30.0  # times the dry friction: forces of a spring's bend at the ends of the travel


@law(TO_STEP)
def _drag(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        ratio = max(abs(b[SPEED + j]) * p[2 * LANES + j], SLOWEST)
        b[DRAG + j] += p[j] * power(ratio, p[LANES + j])


@law(TO_STEP)
def _sides(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        ratio = max(abs(b[SPEED + j]) * p[2 * LANES + j], SLOWEST)
        more = p[j] * power(ratio, p[LANES + j])
        b[VISCOUS_FORWARD + j] *= 1.0 + more
        b[VISCOUS_BACKWARD + j] *= 1.0 - more


@law(TO_STEP)
def _load(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        force = abs(b[TRANSMITTED + j])
        ratio = max(force * p[2 * LANES + j], SLOWEST)
        b[LEVEL + j] += p[j] * force * power(ratio, p[LANES + j])


@law(TO_STEP)
def _defect(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        away = (b[MIDDLE + j] - p[LANES + j]) / p[2 * LANES + j]
        square, flat = away * away, p[4 * LANES + j]
        bump = p[j] * exp_neg(0.5 * square * (1.0 + flat * (square * square * square - 1.0)))
        b[LEVEL + j] += bump
        b[FORCE + j] += bump * p[3 * LANES + j]


@law(TO_STEP)
def _stop(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        side = p[5 * LANES + j]  # the effect itself puts it last
        depth = stop_depth(side * (b[MIDDLE + j] - p[j]), side * h * b[SPEED + j])
        deepest = max(side * (p[4 * LANES + j] - p[j]), NO_TRAVEL)
        steeper = power(max(depth / deepest, SLOWEST), p[3 * LANES + j])
        damped = max(1.0 + p[2 * LANES + j] * side * b[SPEED + j], 0.0)
        b[FORCE + j] += p[LANES + j] * side * depth * steeper * damped


@law(TO_STEP)
def _spring(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        place = b[MIDDLE + j]
        u = min(max((place - p[4 * LANES + j]) * p[5 * LANES + j], -OUTER), OUTER)
        more = p[2 * LANES + j] * (u * u - 1.0 / 3.0) + p[3 * LANES + j] * u * (u * u - 0.6)
        b[FORCE + j] += p[j] * (place - p[LANES + j]) + more


@law(TO_STEP)
def _slope(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        away = b[MIDDLE + j] - p[3 * LANES + j]  # the effect itself puts the middle of the travel last
        u = min(max(away * p[2 * LANES + j], -OUTER), OUTER)
        factor = max(1.0 + p[j] * away + p[LANES + j] * u * (u * u - 0.6), 0.0)
        b[FORWARD + j] *= factor
        b[BACKWARD + j] *= factor


@law(TO_STEP)
def _ramp(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        part = (t - p[LANES + j]) / max(p[3 * LANES + j], h) + 0.5
        step = p[j] * min(max(part, 0.0), 1.0)
        b[CLIMB + j] += step
        b[RISE + j] += p[2 * LANES + j] * step


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def _slower(age: float, first: float, rest: float, slipped: float, slows: float, slides: float) -> float:
    """Contact age that grows with x' = (1 - x)^(1 + slows) and shrinks with x^(1 - slides): from e^-t to ln t."""
    age = age if age == age else first
    young = max(1.0 - age, LEAST)
    if slows > LEAST:
        young = power(power(young, -slows) + slows * rest, -1.0 / slows)
    else:
        young *= exp_neg(rest)
    older = max(1.0 - young, LEAST)
    if slides > LEAST:
        older = power(max(power(older, slides) - slides * slipped, LEAST), 1.0 / slides)
    else:
        older *= exp_neg(slipped)
    return older


@law(TO_STEP)
def _slow_rise(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        speed = abs(b[SPEED + j])
        rest = rests_for(0.5 * h, speed, b[BRISTLE_STIFFNESS + j]) / p[LANES + j]
        slipped = 0.5 * h * speed / p[2 * LANES + j]
        rise = p[j] * _slower(x[j], p[3 * LANES + j], rest, slipped, p[5 * LANES + j], p[6 * LANES + j])
        b[RISE + j] += rise
        b[CLIMB + j] += p[4 * LANES + j] * rise


@law(AFTER)
def _slow_age(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        rested = rests_for(h, abs(b[SPEED + j]), b[BRISTLE_STIFFNESS + j])
        slipped = 0.0 if rested > 0.0 else h * abs(b[VELOCITY + j]) / p[2 * LANES + j]
        x[j] = _slower(x[j], p[3 * LANES + j], rested / p[LANES + j], slipped, p[5 * LANES + j], p[6 * LANES + j])


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def _second(turns: float, cosine: float, sine: float) -> float:
    """The second harmonic of a wave of so many `turns`."""
    value: float = cosine * cos_turns(2.0 * turns) + sine * cos_turns(2.0 * turns - QUARTER)
    return value


@law(TO_DRIVE)
def _ripple(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        turns = b[MOTOR_MIDDLE + j] / p[j]
        wave = cos_turns(turns + TURN * p[3 * LANES + j]) + _second(turns, p[4 * LANES + j], p[5 * LANES + j])
        b[MOTOR_FORCE + j] += p[LANES + j] * wave
        b[DRIVE + j] -= p[2 * LANES + j] * wave * b[DRIVE + j]


@law(TO_DRIVE)
def _lever(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    """A pulley of radius R_c r turns with v/(R_c r): what it holds of the mass, and speeds up, is J/R_c² over r²."""
    for j in range(LANES):
        turns = b[MOTOR_MIDDLE + j] / p[LANES + j]
        at, cosine, sine = turns + TURN * p[2 * LANES + j], p[3 * LANES + j], p[4 * LANES + j]
        inverse = 1.0 / (1.0 + p[j] * (cos_turns(at) + _second(turns, cosine, sine)))
        steeper = cos_turns(at + QUARTER) + 2.0 * _second(turns, sine, -cosine)
        b[DRIVE + j] *= inverse
        turning = p[5 * LANES + j] * p[6 * LANES + j]
        slope = p[j] * steeper / (TURN * p[LANES + j])
        more = turning * (inverse * inverse - 1.0)
        b[MASS + j] += more - x[j]
        x[j] = more
        b[MOTOR_FORCE + j] -= turning * slope * inverse**3 * b[VELOCITY + j] ** 2


def _twice_as_fast(effect: Effect) -> Callable[[Floats, Machine, float], Floats]:
    """The rate of an effect whose wave has a second harmonic."""

    def rate(values: Floats, machine: Machine, speed: float) -> Floats:
        return 2.0 * effect.rate(values, machine, speed)

    return rate


def _bent(guise: Guise, curve: Law, shapes: tuple[Unknown, ...], known: dict[str, float]) -> Guise:
    """`guise` with the law `curve`, the unknowns `shapes` after its first one, and what the law must know.

    The law reads the effect's parameters, then those of the shapes, then what is known. It has no starts of its own: it
    begins where the effect was fitted.
    """
    effect = guise.effect
    names = tuple(unknown.parameter for unknown in shapes)
    more = [Parameter(name, "1", (-math.inf, math.inf), default=0.0, reported=False) for name in (*names, *known)]
    other = dataclasses.replace(effect, parameters=(*effect.parameters, *more), laws=(curve,))
    unknowns = (guise.unknowns[0], *shapes, *guise.unknowns[1:])
    fixed = (*guise.fixed, *known.items())
    starts = np.empty((0, len(unknowns)))
    return dataclasses.replace(guise, effect=other, unknowns=unknowns, starts=starts, fixed=fixed, shapes=names)


def _free_drag(guise: Guise, s: Setting) -> Guise:
    """A force c |v|^(2 + bend), the bend such that c stays what it is at the usual speed."""
    bent = _bent(guise, _drag, (Unknown("bend", 1.0, -1.8, 4.0),), {"per_speed": 1.0 / s.speed})
    return dataclasses.replace(bent, allows=_nearly(2.0))


def _nearly(power_of_speed: float) -> Callable[[dict[str, float]], str | None]:
    """Why what bends away from this power of the speed is another effect, or None."""

    def why(values: dict[str, float]) -> str | None:
        bend = values["bend"]
        return f"with the power {power_of_speed + bend:.2g} of it" if abs(bend) > EXPONENTS else None

    return why


def _free_sides(guise: Guise, s: Setting) -> Guise:
    """Viscous friction whose two sides differ by another power of the speed than 1."""
    bent = _bent(guise, _sides, (Unknown("bend", 0.5, -0.9, 3.0),), {"per_speed": 1.0 / s.speed})
    return dataclasses.replace(bent, allows=_nearly(1.0))


def _free_load(guise: Guise, s: Setting) -> Guise:
    """Friction that grows with another power of the load than 1."""
    return _bent(guise, _load, (Unknown("bend", 0.5, -NEARLY, NEARLY),), {"per_force": 1.0 / s.peak})


def _free_defect(guise: Guise, s: Setting) -> Guise:
    """A bump that may be flat with steep flanks, from exp(-u/2) to exp(-u^4/2), or push: the same both ways."""
    shapes = (Unknown("one_way", 1.0, -3.0, 3.0), Unknown("flatness", 0.1, 0.0, 1.0))
    bent = _bent(guise, _defect, shapes, {"per_travel": 1.0 / s.travel})
    return dataclasses.replace(bent, allows=_no_defect)


def _no_defect(values: dict[str, float]) -> str | None:
    """Why a place that acts in one direction more than in the other, or alike over a stretch, is no defect, or None."""
    share = values["one_way"]
    if abs(share) > ONE_WAY:
        return f"{0.5 + 0.5 * share:.0%} of it towards larger positions, the rest the other way"
    stretch = 2.0 * values["width"] * values["per_travel"]
    return f"the same over {stretch:.0%} of the travel" if values["flatness"] > FLAT and stretch > STRETCH else None


def _free_stop(guise: Guise, s: Setting) -> Guise:  # noqa: ARG001
    """A stop whose force grows with another power of the depth than 1, with so much at its deepest: Hertz' is 1.5."""
    known = {"deepest": guise.unknown("position").origin}  # the end of the recorded travel
    return _bent(guise, _stop, (Unknown("bend", 0.5, -SOFTENS, STEEPENS),), known)


def _free_spring(guise: Guise, s: Setting) -> Guise:
    """A spring that is progressive, or softer at one end; straight parts are left to the stiffness."""
    shapes = tuple(Unknown(name, 0.1 * s.force, -BIG * s.force, BIG * s.force) for name in ("lopsided", "progressive"))
    bent = _bent(guise, _spring, shapes, {"middle": s.middle, "per_half": 2.0 / s.travel})
    return dataclasses.replace(bent, allows=_no_spring)


def _no_spring(values: dict[str, float]) -> str | None:
    """Why what hardly pulls over part of the travel, or pushes there, is no spring; or None."""
    u = np.linspace(-INNER, INNER, 17)
    slope = values["stiffness"] / values["per_half"]
    slopes = slope + 2.0 * values["lopsided"] * u + values["progressive"] * (3.0 * u * u - 0.6)
    slopes = slopes * np.sign(slope)
    return "slack or pushing over part of the travel" if slopes.min() < STEEPEST * slopes.max() else None


def _free_slope(guise: Guise, s: Setting) -> Guise:
    """Friction that rises along the guide more in the middle than at the ends, or less."""
    shapes = (Unknown("progressive", 0.1, -3.0, 3.0),)
    return _bent(guise, _slope, shapes, {"per_half": 2.0 / s.travel})


def _free_step(guise: Guise, s: Setting) -> Guise:
    """A step that takes a while, about its moment: a jam builds up, lubricant runs off."""
    shapes = (Unknown(LASTING, 0.5, 0.0, LASTS * s.duration),)
    return dataclasses.replace(_bent(guise, _ramp, shapes, {}), bends=(1.0, 4.0))


def _free_dwell(guise: Guise, s: Setting) -> Guise:  # noqa: ARG001
    """Contacts that age ever more slowly, as the logarithm of the rest, and slip away evenly: Dieterich 1972.

    The logarithm of an age that slip shortens goes with several slip lengths.
    """
    shapes = (Unknown("slows", 1.0, 0.0, SLOWS), Unknown("slides", 0.3, 0.0, 1.0))
    bent = _bent(guise, _slow_rise, shapes, {})
    effect = dataclasses.replace(bent.effect, laws=(_slow_rise, _slow_age))
    slip = dataclasses.replace(bent.unknowns[-1], high=LENGTHS * bent.unknowns[-1].high)
    unknowns = (*bent.unknowns[:-1], slip)
    return dataclasses.replace(bent, effect=effect, unknowns=unknowns, bends=(0.0, 2.0), endless=frozenset({"slows"}))


def _free_ripple(guise: Guise, s: Setting) -> Guise:  # noqa: ARG001
    """A second harmonic of the wave, in shares of it."""
    return _with_second(guise, _ripple)


def _free_lever(guise: Guise, s: Setting) -> Guise:
    """The same of a pulley; the motor's inertia turns faster where its radius is small, if it drives the belt."""
    mechanics = s.axis.mechanics
    turning = mechanics.J / mechanics.Rc**2 if mechanics.M > 0.0 else 0.0
    follows = (Unknown("inertia", 1.0, -FOLLOWS, 1.0 + FOLLOWS),)
    bent = _with_second(guise, _lever, follows, {"turning_mass": turning})
    return dataclasses.replace(bent, effect=dataclasses.replace(bent.effect, initial=(0.0,)))


def _with_second(
    guise: Guise, curve: Law, shapes: tuple[Unknown, ...] = (), known: dict[str, float] | None = None
) -> Guise:
    """A wave and its second harmonic, which must be the smaller: else the period is another."""
    second = tuple(Unknown(name, 0.3, -SECOND, SECOND) for name in ("second_cosine", "second_sine"))
    bent = _bent(guise, curve, (*second, *shapes), known or {})
    return dataclasses.replace(bent, effect=dataclasses.replace(bent.effect, rate=_twice_as_fast(guise.effect)))


def _free_belt(guise: Guise, s: Setting) -> Guise:
    """A belt whose stiffness grows with its stretch, by so many times at the stretch that the peak force gives it.

    Its motor may rub, too: a share of the friction that damps it, and holds it at rest while the load still swings.
    """
    effect = guise.effect

    def prepare(values: Floats, machine: Machine) -> Floats:
        rows = effect.prepare(values, machine)
        machine.hardening = values[-2] * (values[0] / s.peak) ** 2
        machine.motor_share = values[-1]
        return rows

    harder = Parameter("harder", "1", (-math.inf, math.inf), default=0.0, reported=False)
    bent = dataclasses.replace(effect, parameters=(*effect.parameters, harder, RUBBING), prepare=prepare)
    unknowns = (*guise.unknowns, Unknown("harder", 1.0, -SOFTER, HARDER), MOTOR_RUBS)
    starts = np.empty((0, len(unknowns)))
    return dataclasses.replace(guise, effect=bent, unknowns=unknowns, starts=starts, shapes=("harder",))


def _free_bristles(guise: Guise, s: Setting) -> Guise:  # noqa: ARG001
    """Bristles that yield with another power of what is left before they slide (Dahl 1968): many, not all alike.

    Sliders in parallel (Iwan 1966, Maxwell slip) yield sooner or later than LuGre's one does.
    """
    effect = guise.effect

    def prepare(values: Floats, machine: Machine) -> Floats:
        rows = effect.prepare(values, machine)
        machine.bristle_power = values[-1]
        return rows

    yields = Parameter("yields", "1", (-math.inf, math.inf), default=0.0, reported=False)
    bent = dataclasses.replace(effect, parameters=(*effect.parameters, yields), prepare=prepare)
    unknowns = (*guise.unknowns, Unknown("yields", 0.3, *YIELDS))
    starts = np.empty((0, len(unknowns)))
    return dataclasses.replace(guise, effect=bent, unknowns=unknowns, starts=starts, shapes=("yields",))


FREED: dict[str, Callable[[Guise, Setting], Guise]] = {
    "quadratic_drag": _free_drag,
    "viscous_asymmetry": _free_sides,
    "load_dependent_friction": _free_load,
    "rail_defect": _free_defect,
    "end_stop": _free_stop,
    "position_spring": _free_spring,
    "position_dependent_friction": _free_slope,
    "step_change": _free_step,
    "dwell_time_stiction": _free_dwell,
    "presliding_hysteresis": _free_bristles,
    "transmission_compliance": _free_belt,
    "torque_ripple": _free_ripple,
    "pulley_eccentricity": _free_lever,
}


def own_curve(guise: Guise, setting: Setting) -> Guise:
    """`guise`, knowing how its curve may bend where the catalogue's is one of many."""
    make = FREED.get(guise.name)
    return guise if make is None else dataclasses.replace(guise, freed=make(guise, setting))
