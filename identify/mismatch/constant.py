"""A constant force where mass and gravity are known: it is an effect then, and several names may stand for it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.mismatch.compare import Fit, fit
from identify.mismatch.guise import NO_FINDING, Guise
from identify.mismatch.report_values import measured, quantities
from identify.mismatch.result import FoundEffect
from identify.mismatch.rules import (
    KNOWN,
    LESSER,
    SAME,
    TIED_BIC,
    beyond,
    constant_of,
    price,
)
from identify.mismatch.score import extend
from identify.polish import polish_all
from identify.promoted import CONSTANT

Floats = NDArray[np.float64]

ITERATIONS = 15
OFFSET_KNOWN = 0.5  # relative half-width of a constant force that may carry a name
ONE_SIDED = {"torque_saturation"}  # against gravity a clip is felt in one direction: a constant mends its shape
# a payload weighs, a wrong scale weighs the weight, and under a weight friction that goes with the load is greater
# upwards than downwards
READINGS = ("force_offset", "inertia_error", "torque_scale_error", "load_dependent_friction")


@dataclass(frozen=True, slots=True, eq=False)
class Constant:
    """A constant force that earned a name.

    Attributes:
        fit: the model with it.
        effect: its likeliest name; `force_offset` where that is as likely.
        names: that, and all names that explain at least nine tenths as much.
        evidence: for a constant force beyond what the axis file allows. [1]
    """

    fit: Fit
    effect: FoundEffect
    names: tuple[str, ...]
    evidence: float


def constant_force(fitted: Fit, ways: list[Guise], rest: float, so_far: float) -> Constant | None:
    """The constant force of `fitted` as an effect, where it is beyond what the axis file allows.

    A reading whose size may well be zero does not stand for a force that is there, however much likelier it makes the
    data otherwise; it is told beside the name.

    Args:
        fitted: the chosen model.
        ways: all guises.
        rest: force that nothing explains, rms. [N]
        so_far: evidence for what is named already, whose shapes are known only so well. [1]
    """
    known = _known(fitted)
    taken = {guise.name for guise in fitted.problem.guises}
    if known is None or taken & (SAME | ONE_SIDED):
        return None
    value, half = known
    found = {guise.name: _read(fitted, guise, value) for guise in ways if _constant(guise) and guise.name not in taken}
    odd = {name: _oddity(reading, name) for name, reading in found.items() if not beyond(reading)}
    found = {name: found[name] for name, why in odd.items() if why is None or why.endswith(NO_FINDING)}
    if not found:
        return None
    cost = {name: price(found[name]) for name in READINGS if name in found}
    told = {name for name in cost if odd[name] is not None or _sure(found[name], name)}
    if not told:
        return None
    least = min(cost[name] for name in told)
    own = price(_held(fitted, _at_most(fitted))) - price(fitted)
    close = least + max(TIED_BIC, KNOWN * (so_far + own))
    likely = [name for name in cost if name in told and cost[name] < least + max(TIED_BIC, LESSER * so_far)]
    first = next((name for name in likely if odd[name] is None), None)
    if first is None:
        return None
    names = (first, *(name for name in cost if name != first and cost[name] < close))
    best = found[first]
    guise = next(guise for guise in best.problem.guises if guise.name == first)
    share = value**2 / (value**2 + rest**2)
    sizes = quantities(measured(best), guise)
    if guise.name == "force_offset":  # all of it, not only what is beyond the axis file
        sizes["force"] = replace(sizes["force"], value=value, ci95=(value - half, value + half))
    return Constant(best, FoundEffect(guise.name, share, sizes, abs(value)), names, own)


def _constant(guise: Guise) -> bool:
    """True for guises that may stand for a constant force."""
    if guise.name == "inertia_error":
        return ("weight_share", 1.0) in guise.fixed
    return guise.name in READINGS


def _known(fitted: Fit) -> tuple[float, float] | None:
    """The constant force and its half-width [N], where it is known well and to be beyond what the axis file allows."""
    if not beyond(fitted):
        return None
    value, half = constant_of(fitted)
    return (value, half) if half <= OFFSET_KNOWN * abs(value) else None


def _oddity(reading: Fit, name: str) -> str | None:
    """Why the size of what the constant force is read as is none, or no finding, if it may well be true; or None."""
    guise = reading.problem.guise(name)
    return guise.oddity(reading.x[reading.problem.slot(guise)])


def _sure(reading: Fit, name: str) -> bool:
    """Whether the interval of what the constant force is read as leaves no zero; its own does not (`_known`)."""
    interval = next(iter(quantities(measured(reading), reading.problem.guise(name)).values())).ci95
    return name == "force_offset" or interval is None or interval[0] * interval[1] > 0.0


def _read(fitted: Fit, guise: Guise, value: float) -> Fit:
    """The model with the constant force `value` [N] read as `guise`.

    The two stand for one another where nothing else tells the effect: what is left of the constant then is anything.
    """
    mechanics = fitted.problem.axis.mechanics
    per_unit = {
        "force_offset": 1.0,
        "inertia_error": mechanics.g,
        "torque_scale_error": mechanics.weight,
        "load_dependent_friction": fitted.dry_level,
    }
    size = value / per_unit[guise.name]
    starts = np.array([[guise.unknowns[0].scaled(sign * size)] for sign in (1.0, -1.0)])
    problem, x = extend(fitted, guise, np.clip(starts, *guise.bounds()))
    x[:, CONSTANT] = 0.0
    free = fit(problem, x)
    return free if not beyond(free) else _held(free, x)


def _at_most(fitted: Fit) -> Floats:
    """The unknowns, with as much of the constant force as the axis file allows. (1, size)"""
    x = fitted.x[None].copy()
    most = fitted.problem.ordinary_constant / fitted.problem.scales.force
    x[0, CONSTANT] = np.clip(x[0, CONSTANT], -most, most)
    return x


def _held(fitted: Fit, x: Floats) -> Fit:
    """`fitted`, with the constant force kept where it is at the points x (k, size), from there."""
    ends = polish_all(fitted.problem, x, fitted.found.gain, ITERATIONS, pinned=CONSTANT)
    found = replace(fitted.found, x=ends.x[ends.best], criterion=float(ends.loss[ends.best]))
    return Fit(fitted.problem, found)
