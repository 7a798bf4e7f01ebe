"""Reported quantities of a fitted effect, with intervals carried over from the unknowns."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from identify.mismatch.compare import Fit
from identify.mismatch.extended import ExtendedProblem
from identify.mismatch.guise import Guise
from identify.mismatch.result import Quantity
from identify.uncertainty import Uncertainty, uncertainty

Floats = NDArray[np.float64]

DIFFERENCE = 1e-5  # of a scaled unknown


def spread_of(fit: Fit) -> Uncertainty:
    """Uncertainty of all unknowns of a fit."""
    return uncertainty(fit.problem, fit.x, fit.found.gain)


def quantities(fit: Fit, guise: Guise, spread: Uncertainty) -> dict[str, Quantity]:
    """Reported parameters of `guise` by name, with 95 % intervals; those of logarithmic unknowns are asymmetric."""
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
    for name, gradient in zip(names, gradients, strict=True):
        value, unit = centre[name]
        half = float(spread.half_widths(gradient[None])[0])
        if name in logarithmic and value > 0:
            factor = float(np.exp(min(half / value, 50.0)))
            interval = (value / factor, value * factor)
        else:
            interval = (value - half, value + half)
        found[name] = Quantity(value, unit, interval)
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
    if guise.name == "position_spring" and not problem.gravity_known:
        offset = float(law[5])
        shown["rest_position"] = (given["rest_position"] - offset / given["stiffness"], problem.axis.position_unit)
    derived = guise.effect.derive(given, friction)
    return {**shown, **{name: (float(value), unit) for name, (value, unit) in derived.items()}}
