"""Friction that remembers, in no catalogue: how fast the axis has run lately, when it turned, how long it has rested.

What looks like it in the catalogue is a warmth, a stiction, bristles; like all of `uncatalogued.py` it is located,
never named.
"""

from __future__ import annotations

import dataclasses

from identify.mismatch.guise import Guise, Setting, Unknown, grid
from plant.effects.dwell_time_stiction import rests_for
from plant.effects.effect import Effect, Parameter
from plant.kernels.exponential import exp_neg
from plant.kernels.laws import (
    AFTER,
    BRISTLE_STIFFNESS,
    BUMP,
    CLIMB,
    INVERSE_STRIBECK,
    LANES,
    LEVEL,
    RISE,
    SPEED,
    STAGE_LEVEL,
    TO_STAGE,
    TO_STEP,
    VELOCITY,
    VISCOUS_BACKWARD,
    VISCOUS_FORWARD,
    Rows,
    law,
)

REVERSED, SEEN = 2e-5, 4.0  # of the travel, and of what the sensor resolves: so far back is a reversal
ENDLESS = 1e9  # m or s
LASTING = 0.3  # of a recording: friction that remembers longer changes with time
SHORTEST = 0.1  # s: of rests
BRIEFLY = 1.0  # s: friction that remembers no longer forgets between two reversals


@law(TO_STAGE)
def _late_level(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        bump = b[BUMP + j] + b[RISE + j] - b[CLIMB + j]
        slow = b[INVERSE_STRIBECK + j]
        b[STAGE_LEVEL + j] += bump * (exp_neg(x[j] * slow) - exp_neg(abs(b[VELOCITY + j]) * slow))


@law(AFTER)
def _follow_speed(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        speed = abs(b[VELOCITY + j])
        x[j] = speed + (x[j] - speed) * exp_neg(h / p[j])


FRICTIONAL_LAG = Effect(
    name="frictional_lag",
    parameters=(Parameter("time_constant", "s", (1e-3, 1.0), (1e-6, 1e3), absent=0.0, about="τ"),),
    laws=(_late_level, _follow_speed),
    initial=(0.0,),
    source="the Stribeck curve sees the speed late: Hess & Soom 1990",
)


@law(TO_STEP)
def _remember(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        b[LEVEL + j] += p[LANES + j] * x[j]


FILM = Effect(
    name="film_memory",
    parameters=(
        Parameter("time_constant", "s", (0.1, 100.0), (1e-6, 1e6), about="τ"),
        Parameter("per_speed", "N*s/m", (-1e4, 1e4), (-1e9, 1e9), absent=0.0, about="c"),
    ),
    laws=(_remember, _follow_speed),
    initial=(0.0,),
    source="dry friction that depends on how fast the axis has run lately: a film that is built up, heat",
)


@law(TO_STEP)
def _drag_afresh(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        b[LEVEL + j] += p[j] * x[j]


@law(AFTER)
def _wear_off(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        way, moved = x[2 * LANES + j], h * b[VELOCITY + j]
        back = max(x[LANES + j] - way * moved, 0.0) if way != 0.0 else x[LANES + j] + moved
        other = abs(back) > p[3 * LANES + j]
        left = x[j] * exp_neg(h / p[LANES + j] + abs(moved) / p[2 * LANES + j])
        x[j] = 1.0 if other and way != 0.0 else left
        begun = 1.0 if back > 0.0 else -1.0
        x[2 * LANES + j] = (-way if way != 0.0 else begun) if other else way
        x[LANES + j] = 0.0 if other else back


FRESH_DRAG = Effect(
    name="fresh_drag",
    parameters=(
        Parameter("force", "N", (0.0, 1e3), (-1e6, 1e6), absent=0.0, about="A"),
        Parameter("time_constant", "s", (1e-2, 1e2), (1e-6, 1e12), about="τ"),
        Parameter("travel", "m", (1e-4, 10.0), (1e-9, 1e12), about="d"),
        Parameter("play", "m", (1e-6, 1.0), (0.0, 1e6), reported=False, about="way back that is a reversal"),
    ),
    laws=(_drag_afresh, _wear_off),
    initial=(0.0, 0.0, 0.0),  # what is left of it, way back since the last turn, direction
    source="dry friction that is raised by a reversal and wears off: a seal lip that turns over, a film that builds up",
)


@law(TO_STEP)
def _stiffen(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        more = p[LANES + j] * x[j]
        b[LEVEL + j] += p[j] * x[j]
        b[VISCOUS_FORWARD + j] += more
        b[VISCOUS_BACKWARD + j] += more


@law(AFTER)
def _work(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        rested = rests_for(h, abs(b[SPEED + j]), b[BRISTLE_STIFFNESS + j])
        worked = x[j] * exp_neg(h * abs(b[VELOCITY + j]) / p[3 * LANES + j] + h / p[4 * LANES + j])
        x[j] = 1.0 - (1.0 - x[j]) * exp_neg(rested / p[2 * LANES + j]) if rested > 0.0 else worked


RESTED = Effect(
    name="rested_grease",
    parameters=(
        Parameter("force", "N", (0.0, 1e3), (-1e6, 1e6), absent=0.0, about="A"),
        Parameter("coefficient", "N*s/m", (0.0, 1e5), (-1e9, 1e9), absent=0.0, about="B"),
        Parameter("time_constant", "s", (1e-2, 1e3), (1e-6, 1e6), about="τ, of the rest"),
        Parameter("travel", "m", (1e-3, 10.0), (1e-9, 1e12), about="d, after which it is worked off"),
        Parameter("release", "s", (1e-3, 1e2), (1e-6, 1e12), about="τ_r, of motion, after which it is gone"),
    ),
    laws=(_stiffen, _work),
    initial=(0.0,),
    source="friction that a rest raises for more than a break-away: grease that stiffens, a brake that opens late",
)


@law(TO_STEP)
def _thicken(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        more = p[j] * min(max((t - p[LANES + j]) / h + 1.0, 0.0), 1.0)
        b[VISCOUS_FORWARD + j] += more
        b[VISCOUS_BACKWARD + j] += more


VISCOUS_LATER = Effect(
    name="viscous_later",
    parameters=(
        Parameter("coefficient", "N*s/m", (-1e4, 1e4), (-1e9, 1e9), absent=0.0, about="B"),
        Parameter("time", "s", (0.0, 1e5), (-1e9, 1e9), about="from which on it is there"),
    ),
    laws=(_thicken,),
    source="viscous friction that changes at one moment: fresh grease, a tool that dips in",
)
EFFECTS = (FRESH_DRAG, FRICTIONAL_LAG, FILM, RESTED, VISCOUS_LATER)


def remembering(s: Setting) -> list[Guise]:
    """Every way in which friction that remembers is tried in recordings of this setting."""
    lag = Unknown("time_constant", 0.03, 0.1 * s.sample_time, 1.0, log=True)
    late = Guise(FRICTIONAL_LAG, (lag,), grid([0.005, 0.015, 0.04, 0.12]), depends="velocity")
    return [late, _remembers(s), *_afresh(s), *_rested(s), _thickens(s)]


def _remembers(s: Setting) -> Guise:
    """Dry friction that depends on how fast the axis has run lately."""
    unit = 0.1 * s.force / s.speed
    unknowns = (
        Unknown("time_constant", 3.0, 0.1, 2.0 * s.duration, log=True, spread=2.0),
        Unknown("per_speed", unit, -20.0 * unit, 20.0 * unit),
    )
    times = [t for t in (0.2, 0.6, 2.0, 6.0, 20.0) if t < s.duration]
    return Guise(FILM, unknowns, grid(times, [0.1 * unit]), depends="velocity")


def _afresh(s: Setting) -> list[Guise]:
    """Dry friction raised by each reversal, which wears off along the way, or with time."""
    force = Unknown("force", 0.1 * s.force, 0.0, 2.0 * s.force)
    travel = Unknown("travel", 0.1 * s.travel, 3e-3 * s.travel, 2.0 * s.travel, log=True, spread=1.5)
    time = Unknown("time_constant", 0.3, 2.0 * s.sample_time, 0.2 * s.duration, log=True, spread=1.5)
    play = ("play", max(REVERSED * s.travel, SEEN * s.axis.sensor.position_resolution))
    ways = [share * s.travel for share in (0.01, 0.04, 0.15)]
    times = [0.06, 0.25, 1.0]
    along = Guise(FRESH_DRAG, (force, travel), grid([0.1 * s.force], ways), depends="distance_since_reversal")
    late = Guise(FRESH_DRAG, (force, time), grid([0.1 * s.force], times), depends="time_since_reversal")
    return [
        dataclasses.replace(along, fixed=(("time_constant", ENDLESS), play)),
        dataclasses.replace(late, fixed=(("travel", ENDLESS), play)),
    ]


def _rested(s: Setting) -> list[Guise]:
    """Dry or viscous friction raised by a rest, where the axis rests, and worked off along the way, or with time."""
    if s.rests < SHORTEST:
        return []
    raised = {"force": 0.1 * s.force, "coefficient": 0.1 * s.force / s.speed}
    time = Unknown("time_constant", s.rests, 0.03 * s.rests, 30.0 * s.rests, log=True, spread=1.5)
    travel = Unknown("travel", 0.1 * s.travel, 0.01 * s.travel, 3.0 * s.travel, log=True, spread=1.5)
    times, ways = [0.3 * s.rests, 2.0 * s.rests], [share * s.travel for share in (0.05, 0.2, 0.7)]
    found = []
    for name, unit in raised.items():
        unknowns = (Unknown(name, unit, 0.0, 20.0 * unit), time, travel)
        fixed = (*((other, 0.0) for other in raised if other != name), ("release", ENDLESS))
        found.append(Guise(RESTED, unknowns, grid([0.5 * unit], times, ways), fixed=fixed, depends="dwell_time"))
    release = Unknown("release", 0.2, 2.0 * s.sample_time, 0.2 * s.duration, log=True, spread=1.5)
    any_rest = dataclasses.replace(time, low=1e-3 * s.rests)
    opens = (Unknown("force", raised["force"], 0.0, 20.0 * raised["force"]), any_rest, release)
    starts = grid([0.5 * raised["force"]], [0.1 * s.rests, 2.0 * s.rests], [0.06, 0.25, 1.0])
    late = (("coefficient", 0.0), ("travel", ENDLESS))
    return [*found, Guise(RESTED, opens, starts, fixed=late, depends="dwell_time")]


def _thickens(s: Setting) -> Guise:
    """Viscous friction that is another from one moment on."""
    unit = 0.1 * s.force / s.speed
    coefficient = Unknown("coefficient", unit, -20.0 * unit, 20.0 * unit)
    return Guise(VISCOUS_LATER, (coefficient, s.moment), grid([0.5 * unit], s.moments), depends="time")


def remembers_along(time_constant: float, duration: float) -> tuple[str, ...]:
    """Coordinates of friction that remembers speed for `time_constant` in recordings of `duration` [s], the first best.

    What is forgotten within a reversal is not told from what begins anew at each.
    """
    if time_constant > LASTING * duration:
        return "time", "velocity"
    return ("velocity", "time_since_reversal") if time_constant < BRIEFLY else ("velocity",)
