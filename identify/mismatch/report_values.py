"""Reported quantities of a fitted effect, with intervals carried over from the unknowns.

A model that is not quite right errs alike all through one motion, and no scatter within it tells. Another motion errs
otherwise: where the unseen data, fitted on their own, want another value than chance allows, the interval grows by what
two motions differ by (random effects: DerSimonian & Laird 1986, with two studies). The value stays that of the fit.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.mismatch.compare import Fit
from identify.mismatch.extended import ExtendedProblem
from identify.mismatch.guise import Guise
from identify.mismatch.own_curves import LASTING
from identify.mismatch.result import Quantity
from identify.mismatch.wandering import STEP
from identify.polish import polish_all
from identify.preprocess import Samples
from identify.uncertainty import Uncertainty
from identify.waves import NORMAL
from plant.effects.effect import unit_on

Floats = NDArray[np.float64]

DIFFERENCE = 1e-5  # of a scaled unknown
ITERATIONS = 10
LONGEST_REST = 3.0  # s, within which a moment is looked for that is as likely
UNTOLD = 3.0  # half-width of a logarithm: a factor of 20 either way, and zero is about as likely
EDGE = 1e-6  # of a scaled unknown: nearer to its bound it is there
MOMENTS = 61


@dataclass(frozen=True, slots=True, eq=False)
class Measured:
    """A fit and the uncertainty of its unknowns."""

    fit: Fit
    spread: Uncertainty


def measured(fit: Fit) -> Measured:
    """`fit` and how well it knows its unknowns."""
    return Measured(fit, fit.spread)


def second_opinion(first: Fit, unseen: Samples) -> Measured:
    """The same model fitted to data that the first fit has not seen, from where that ended."""
    there = first.on(unseen)
    ends = polish_all(there.problem, there.x[None], first.found.gain, ITERATIONS)
    found = dataclasses.replace(first.found, x=ends.x[0], criterion=float(ends.loss[0]))
    return measured(Fit(there.problem, found))


def quantities(
    one: Measured, guise: Guise, second: Measured | None = None, *, pooled: bool = False
) -> dict[str, Quantity]:
    """Reported parameters of `guise` by name, with 95 % intervals; those of logarithmic unknowns are asymmetric.

    Args:
        one: the fit.
        guise: the effect.
        second: the same model fitted to other data; where both differ by more than chance, the intervals grow.
        pooled: give the mean of both fits, each weighed by how well it is known, instead of the first.
    """
    own = _on_scale(one, guise)
    other = {} if second is None or not _reaches(second, one, guise) else _on_scale(second, guise)
    found = {}
    for name, (value, unit, at, half) in own.items():
        if name in other and name != "time":  # unseen data have another clock, or none of the moment
            _, _, there, half_there = other[name]
            apart = 0.5 * max((NORMAL * (there - at)) ** 2 - half**2 - half_there**2, 0.0)  # beyond chance
            half = float(np.sqrt(half**2 + apart))
            if pooled and min(half, half_there) > 0.0:  # a bound is known to itself only
                linear = at == value
                weight = 1.0 / (1.0 + half**2 / (half_there**2 + apart))
                at += (1.0 - weight) * (there - at)
                half *= float(np.sqrt(weight))
                value = at if linear else float(np.exp(at))
        if name == "rest_position" and _takes_constant(one.fit.problem, guise):
            half = float(np.hypot(half, one.fit.problem.ordinary_constant / abs(own["stiffness"][0])))
        if at == value:
            interval = value - half, value + half
            if name == "time":
                low, high = _as_likely(one.fit, guise)
                while_it_lasts = 0.5 * _lasts(one.fit, guise)
                recorded = one.fit.problem.samples.t
                interval = (
                    max(min(interval[0], low) - while_it_lasts, float(recorded.min())),
                    min(max(interval[1], high) + while_it_lasts, float(recorded.max())),
                )
        else:
            factor = float(np.exp(min(half, 50.0)))
            interval = (value / factor, value * factor)
            if guise.optional(name) and (half > UNTOLD or _none_of_it(one.fit, guise, name)):
                interval = (0.0, max(value, _at_most(one.fit, guise, name)))
        found[name] = Quantity(value, unit, interval)
    return found


def _reaches(second: Measured, one: Measured, guise: Guise) -> bool:
    """Whether the other data go on past the moment at which friction steps, if it does, and began before it."""
    if guise.name != STEP:
        return True
    moment, recorded = guise.value(one.fit.x[one.fit.problem.slot(guise)], "time"), second.fit.problem.samples.t
    return bool(recorded.min() < moment < recorded.max())


def _none_of_it(fit: Fit, guise: Guise, parameter: str) -> bool:
    """Whether a damping, of which there may be none, ended where there is as good as none."""
    index = _index(fit, guise, parameter)
    return bool(fit.x[index] <= fit.problem.bounds[0][index] + EDGE)


def _at_most(fit: Fit, guise: Guise, parameter: str) -> float:
    """The largest value of a damping that would be about as likely, all else as fitted."""
    problem, unknown = fit.problem, guise.unknown(parameter)
    index = _index(fit, guise, parameter)
    points = np.repeat(fit.x[None], MOMENTS, axis=0)
    low, high = problem.bounds
    points[:, index] = np.linspace(low[index], high[index], MOMENTS)
    losses = problem.losses(points, fit.found.gain)
    likely = np.flatnonzero(losses <= min(float(losses.min()), fit.found.criterion) + NORMAL**2)
    return float(unknown.value(points[min(likely[-1] + 1 if len(likely) else 0, MOMENTS - 1), index, None])[0])


def _index(fit: Fit, guise: Guise, parameter: str) -> int:
    """Where the unknown of a parameter is among those of the fit."""
    start: int = fit.problem.slot(guise).start
    return start + guise.unknowns.index(guise.unknown(parameter))


def _lasts(fit: Fit, guise: Guise) -> float:
    """How long a step takes [s]: within that, its moment is any."""
    return guise.value(fit.x[fit.problem.slot(guise)], LASTING) if LASTING in guise.shapes else 0.0


def _as_likely(fit: Fit, guise: Guise) -> tuple[float, float]:
    """First and last moment [s] at which a step would be about as likely: while the axis rests nobody sees it."""
    place = guise.place()
    if place is None:
        return np.inf, -np.inf
    problem, unknown = fit.problem, guise.unknowns[place]
    index = problem.slot(guise).start + place
    value = float(unknown.value(fit.x[index, None])[0])
    ends = []
    for sign in (-1.0, 1.0):
        moments = value + sign * np.linspace(0.0, LONGEST_REST, MOMENTS)
        points = np.repeat(fit.x[None], MOMENTS, axis=0)
        points[:, index] = [unknown.scaled(moment) for moment in moments]
        losses = problem.losses(np.clip(points, *problem.bounds), fit.found.gain)
        unlikely = np.flatnonzero(losses > losses[0] + NORMAL**2)
        ends.append(float(moments[unlikely[0] - 1 if len(unlikely) else -1]))
    return ends[0], ends[1]


def _on_scale(one: Measured, guise: Guise) -> dict[str, tuple[float, str, float, float]]:
    """Name -> value, unit, then value and half-width of its interval on its own scale: logarithmic or not."""
    fit, spread = one.fit, one.spread
    centre = reported(fit.problem, guise, fit.x)
    names = list(centre)
    gradients = np.zeros((len(names), len(fit.x)))
    for index in range(fit.problem.p):
        moved = fit.x.copy()
        moved[index] += DIFFERENCE
        changed = reported(fit.problem, guise, moved)
        gradients[:, index] = [(changed[name][0] - centre[name][0]) / DIFFERENCE for name in names]
    logarithmic = {unknown.parameter for unknown in guise.unknowns if unknown.log}
    found = {}
    for name, half in zip(names, spread.half_widths(gradients), strict=True):
        value, unit = centre[name]
        if name in logarithmic and value > 0:
            found[name] = value, unit, float(np.log(value)), float(half) / value
        else:
            found[name] = value, unit, value, float(half)
    return found


def reported(problem: ExtendedProblem, guise: Guise, x: Floats) -> dict[str, tuple[float, str]]:
    """Name -> value, unit of what results show of `guise` at unknowns x."""
    values = guise.values(x[None, problem.slot(guise)])[:, 0]
    law = problem.law(x[None])[:, 0]
    friction = np.array([law[0], law[0] + law[1], 1.0 / law[2], law[3]])
    given = {p.name: float(v) for p, v in zip(guise.effect.parameters, values, strict=True)}
    held = {name for name, _ in guise.fixed}
    shown = {
        p.name: (given[p.name], p.unit_on(problem.axis))
        for p in guise.effect.parameters
        if p.reported and not (p.name in held and p.absent == given[p.name])
    }
    if _takes_constant(problem, guise):
        offset = float(law[5])
        shown["rest_position"] = (given["rest_position"] - offset / given["stiffness"], problem.axis.position_unit)
    derived = guise.effect.derive(given, friction)
    return {**shown, **{name: (float(value), unit_on(unit, problem.axis)) for name, (value, unit) in derived.items()}}


def _takes_constant(problem: ExtendedProblem, guise: Guise) -> bool:
    """Whether a spring is all that the constant force is told by: where it is at rest, as far as that is ordinary."""
    return guise.name == "position_spring" and not problem.gravity_known
