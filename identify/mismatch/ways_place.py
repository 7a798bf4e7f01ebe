"""Where effects that depend on the position may be present: a slope, a place, a period, an end."""

from __future__ import annotations

import math

import numpy as np

from identify.mismatch.guise import TRAVEL, Guise, Setting, Unknown, grid
from plant.effects.effect import Effect

LONGEST = 1.5  # of the travel: a turn of the motor whose ripple shows on it
PARTS = (2, 3, 4, 6, 8, 12)  # poles, phases, slots of a motor: how often its ripple comes in a turn
SOFT = 10.0  # N/m on most machines: stops are looked for, and taken for none, that are a hundredth of a stop
DAMPS = 5.0  # over the usual speed, of a stop's dissipation: none gives back so little
PART = 10.0  # travels: of a longer turn of the pulley so little is seen that its eccentricity is a factor on the torque


def position_friction(e: Effect, s: Setting) -> list[Guise]:
    """A slope of the dry friction."""
    steepest = 1.0 / (0.5 * s.travel)
    return [Guise(e, (Unknown("relative_slope", 0.3 * steepest, -steepest, steepest),), grid([0.05 * steepest]))]


def defect(e: Effect, s: Setting) -> list[Guise]:
    """A bump anywhere on the travel, narrow to wide; what is wider than a quarter of the travel is no place.

    Two millimetres are narrow on a machine of ordinary travel; on a smaller one it is as small a part of its travel.
    """
    metre = min(s.metre, s.travel / TRAVEL)
    widest = min(0.2 * metre, 0.25 * s.travel)
    unknowns = (
        Unknown("amplitude", 0.1 * s.force, -2 * s.force, 2 * s.force),
        Unknown("centre", 0.02 * s.travel, s.lowest, s.highest, origin=s.middle, spread=50.0),
        Unknown("width", 0.02 * metre, 0.002 * metre, widest, log=True, spread=1.5),
    )
    widths = [w * metre for w in (0.006, 0.02, 0.06) if w * metre <= widest] or [0.006 * metre]
    rows = [
        (0.05 * s.force, centre, width)
        for width in widths
        for centre in np.arange(s.lowest + width, s.highest, min(1.5 * width, 0.1 * s.travel))
    ]
    rows += [(0.05 * s.force, spot, width) for spot in s.spots for width in widths]
    return [Guise(e, unknowns, np.array(rows))]


def waves(
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


def ripple(e: Effect, s: Setting) -> list[Guise]:
    """Waves of a turn of the motor, of its parts, and wherever the residual force repeats."""
    mechanics = s.axis.mechanics
    turn = 2.0 * math.pi * mechanics.Rm
    whole = [turn] if 1e-3 * s.travel < turn < LONGEST * s.travel else []
    periods = whole + [p for p in (*(turn / n for n in PARTS), *s.periods) if 1e-3 * s.travel < p < s.travel]
    if not periods:
        return []
    known = None if mechanics.Rm == 1.0 and not s.axis.is_rotary else turn  # an axis file may leave the radius out
    return [
        waves(e, "amplitude", 0.1 * s.force, s.force, periods, (("relative_amplitude", 0.0),), known),
        waves(e, "relative_amplitude", 0.1, 0.5, periods, (("amplitude", 0.0),), known),
    ]


def eccentricity(e: Effect, s: Setting) -> list[Guise]:
    """A wave of a turn of the pulley, whose radius is known: a free one bends to whatever else is missing."""
    turn = 2.0 * math.pi * s.axis.mechanics.Rc
    if turn > PART * s.travel:
        return []
    return [waves(e, "relative_eccentricity", 0.1, 0.4, [turn], (), turn, (0.8, 1.25)).bound_to(1)]


def spring(e: Effect, s: Setting) -> list[Guise]:
    """A stiffness about the middle."""
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


def end_stop(e: Effect, s: Setting) -> list[Guise]:
    """A stop at either end of the travel, which may damp."""
    found = []
    for end, side in ((s.highest, 1.0), (s.lowest, -1.0)):
        inner = sorted((s.middle, end + side * 0.02 * s.travel))
        unknowns = (
            Unknown("position", 0.02 * s.travel, inner[0], inner[1], origin=end, spread=30.0),
            Unknown("stiffness", 1e4 * s.spring, SOFT * s.spring, 1e6 * s.spring, log=True),
            Unknown("dissipation", 1.0 / s.speed, 0.0, DAMPS / s.speed),
        )
        depths = [share * s.travel for share in (0.01, 0.03, 0.08, 0.16)]
        rows = [(end - side * depth, push * s.force / depth, 0.0) for depth in depths for push in (0.03, 0.2, 1.0)]
        low, high = (-np.inf, SOFT * s.spring, 0.0), (np.inf, 1e6 * s.spring, 0.0)
        found.append(Guise(e, unknowns, np.clip(np.array(rows), low, high)))
    return found
