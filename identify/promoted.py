"""Friction together with effects that a diagnosis found before.

Nothing is selected here, the names are given (`tribowatch axes promote`). The effects' starting points come from what
the baseline leaves over in this very window, so that a last answer competes and does not bind.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from identify.mismatch.compare import Fit
from identify.mismatch.extended import ExtendedProblem
from identify.mismatch.guise import Guise
from identify.mismatch.report_values import Measured, quantities
from identify.mismatch.residual import setting_of
from identify.mismatch.score import Lead, extend, leads
from identify.mismatch.ways import guises
from identify.observer import gain_table
from identify.problem import FrictionProblem
from identify.result import Parameter
from identify.search import CLASSICAL, SearchResult, homotopy
from identify.uncertainty import Uncertainty
from plant.effects import find

Floats = NDArray[np.float64]

CONSTANT, OFFSET = 4, "force_offset"  # index of the baseline's constant force, and the effect that takes its place
KNOWN = 0.5  # half-width over the value, below which a parameter of an effect counts as identified


class PromotedProblem(ExtendedProblem):
    """The model of an axis with its effects: where `force_offset` is one of them, there is no constant force beside it.

    Both push alike. With both, the prior of the constant force would be all that is known of how they share it.
    """

    @cached_property
    def bounds(self) -> tuple[Floats, Floats]:
        """Lowest and highest scaled unknowns. (size,) each"""
        low, high = super().bounds
        if any(guise.name == OFFSET for guise in self.guises):
            low[CONSTANT] = high[CONSTANT] = 0.0
        return low, high


def with_effects(
    problem: FrictionProblem,
    found: SearchResult,
    names: Sequence[str],
    start: Mapping[str, float],
    rng: Generator,
) -> tuple[ExtendedProblem, SearchResult]:
    """Fit the model of `problem` with the effects called `names`, from the optimum of the baseline.

    Args:
        problem: the baseline model.
        found: where its search ended.
        names: of effects; those that this axis or window cannot show are left out, and a note says so.
        start: values to try too, by name, those of effects as `effect.parameter`.
        rng: of the polish's kicks.

    Raises:
        InputError: a name that no effect has.
    """
    bare = PromotedProblem(problem.samples, problem.axis, scales=problem.scales, first_state=problem.first_state)
    setting = setting_of(bare, found.x)
    ways = guises({name: find(name) for name in dict.fromkeys(names)}, setting)
    fit = Fit(bare, found)
    while ways:
        lead = _most_telling(fit, ways)
        extended, x = extend(fit, lead.guise, lead.start[None])
        fit = Fit(extended, dataclasses.replace(found, x=x[0]))
        ways = [way for way in ways if way.name != lead.guise.name]
    missing = [name for name in dict.fromkeys(names) if name not in fit.names]
    if missing:
        note = f"not fitted, for this axis or window cannot show it: {', '.join(missing)}"
        samples = dataclasses.replace(problem.samples, removed=(*problem.samples.removed, note))
        fit = Fit(fit.problem.on(samples, problem.first_state), fit.found)
    gains, settings = gain_table(problem.samples.sample_time)
    end = homotopy(fit.problem, _points(fit, start), gains, settings, rng)
    return fit.problem, dataclasses.replace(end, evaluations=found.evaluations + end.evaluations)


def _most_telling(fit: Fit, ways: list[Guise]) -> Lead:
    """The guise whose response explains most of what is left; the first one where nothing shows."""
    found = leads(fit, ways, fit.found.gain)
    return found[0] if found else Lead(ways[0], ways[0].scaled_starts()[0], 0.0, np.empty(0))


def _points(fit: Fit, start: Mapping[str, float]) -> Floats:
    """Starts of the polish: what the window suggests, a textbook friction, the last answer. (k, size)"""
    problem = fit.problem
    textbook = fit.x.copy()
    textbook[:4] = CLASSICAL
    if not any(name.startswith(f"{guise.name}.") for guise in problem.guises for name in start):
        return np.stack([fit.x, textbook])
    known = fit.x.copy()
    friction = problem.encode(start)
    known[: problem.base] = friction[: problem.base]
    for guise in problem.guises:
        slot = problem.slot(guise)
        waves = {len(guise.unknowns) - 2, len(guise.unknowns) - 1} if guise.wave is not None else set()
        for index, unknown in enumerate(guise.unknowns):
            value = start.get(f"{guise.name}.{unknown.parameter}")
            if value is not None and index not in waves and not (unknown.log and value <= 0.0):
                known[slot.start + index] = unknown.scaled(value)
    return np.clip(np.stack([fit.x, textbook, known]), *problem.bounds)


def describe_effects(problem: ExtendedProblem, found: SearchResult, spread: Uncertainty) -> dict[str, Parameter]:
    """Parameters of the effects with intervals, called `effect.parameter`."""
    fit = Fit(problem, found)
    described = {}
    for guise in problem.guises:
        slot = problem.slot(guise)
        units = {unknown.parameter: unknown.unit for unknown in guise.unknowns if not unknown.log}
        if guise.wave is not None:
            units[guise.wave[0]] = guise.unknowns[-2].unit
        stuck = {
            unknown.parameter
            for unknown, edge in zip(guise.unknowns, spread.at_bound[slot], strict=True)
            if edge and unknown.parameter not in (guise.wave or ())
        }
        for name, quantity in quantities(Measured(fit, spread), guise).items():
            low, high = quantity.ci95 if quantity.ci95 is not None else (-np.inf, np.inf)
            wide = max(KNOWN * abs(quantity.value), units.get(name, 0.0))
            known = name not in stuck and 0.5 * (high - low) < wide
            full = f"{guise.name}.{name}"
            described[full] = Parameter(
                full, quantity.value, quantity.unit, (low, high) if known else None, known, name in stuck
            )
    return described


def without_twin(parameters: Mapping[str, Parameter]) -> dict[str, Parameter]:
    """`parameters` without the constant force that `force_offset` has taken the place of."""
    taken = any(name.startswith(f"{OFFSET}.") for name in parameters)
    return {name: one for name, one in parameters.items() if not (taken and name == "constant_force")}
