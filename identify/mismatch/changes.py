"""What differs between commissioning and today: friction, and effects that appeared, grew, shrank or went.

Both states are fitted together (`coupled`) with the model named in today's data. At first they share every unknown;
then one after the other is released, the most telling first, while the evidence is what a name needs. So a small set of
changes is found, each with the interval of the difference, and parameters that trade off within one state (dry friction
and Stribeck velocity) are not all called changed because one of them is. Where an effect sits (a place, a period, a
width) is shared: a state without the effect cannot tell it.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from identify.mismatch.compare import Fit, block_z, fit
from identify.mismatch.coupled import CoupledProblem, coupled
from identify.mismatch.curve import CURVE
from identify.mismatch.data import join
from identify.mismatch.guise import Guise
from identify.mismatch.report_values import reported
from identify.mismatch.result import Change
from identify.mismatch.rules import BIC, Z_STRONG
from identify.mismatch.score import spanned
from identify.polish import polish_all
from identify.preprocess import Samples

Floats = NDArray[np.float64]

MOST = 5  # changes
ITERATIONS = 12  # of a polish between two releases
DIFFERENCE = 1e-5  # of a scaled unknown
ABSENT = 0.25  # of today's strength: what is left of an effect that was not there


@dataclasses.dataclass(frozen=True, slots=True)
class Shown:
    """A quantity that may change: which unknowns carry it, and the effect it is the strength of."""

    name: str
    unknowns: tuple[int, ...]
    guise: Guise | None = None


def changes_since(chosen: Fit, before: Samples, today: Sequence[Samples]) -> tuple[Change, ...]:
    """Everything that differs by more than its uncertainty.

    Args:
        chosen: the model named in today's data, or the baseline.
        before: samples at commissioning.
        today: all samples of today.
    """
    problem, x = coupled(chosen.problem, chosen.x, before, join(list(today)))
    offered = _offered(chosen)
    current = fit(problem, x[None])
    released: list[Shown] = []
    while len(released) < MOST:
        richer = _release(current, [one for one in offered if one not in released], released)
        if richer is None:
            break
        current, one = richer
        released.append(one)
    current, released = _needed(current, released)
    if not released:
        return ()
    final = fit(current.problem, current.x[None])
    return tuple(_change(final, one) for one in released)


def strengths(guise: Guise) -> tuple[int, ...]:
    """Unknowns that say how strong an effect is; the others say where, or in which shape."""
    if guise.wave is not None:
        return guise.size - 2, guise.size - 1
    amplitude = guise.amplitude()
    return (amplitude,) if amplitude is not None else (0,)


def _offered(chosen: Fit) -> list[Shown]:
    """Friction, the constant force, and the strength of each effect."""
    problem = chosen.problem
    names = [row[0] for row in problem.named(chosen.x)]
    found = [Shown(name, (index,)) for index, name in enumerate(names) if index < problem.base]
    for guise in [guise for guise in problem.guises if guise.name != CURVE]:
        at = tuple(problem.slot(guise).start + index for index in strengths(guise))
        name = guise.wave[0] if guise.wave is not None else guise.unknowns[strengths(guise)[0]].parameter
        found.append(Shown(name, at, guise))
    return found


def _problem(fitted: Fit) -> CoupledProblem:
    """The coupled problem of a fit made here."""
    problem = fitted.problem
    assert isinstance(problem, CoupledProblem)  # by construction in this file
    return problem


def _release(current: Fit, offered: Sequence[Shown], released: Sequence[Shown]) -> tuple[Fit, Shown] | None:
    """The model with the most telling of `offered` released too, where it earns that."""
    own = _problem(current)
    taken = [index for one in released for index in one.unknowns]
    everything = own.releasing((*taken, *(index for one in offered for index in one.unknowns)))
    error, slope = everything.jacobian(own.carried(current.x, everything), current.found.gain)
    variance = float(error @ error) / len(error)
    known = everything.shared + len(taken)
    columns = np.arange(known, everything.p)
    basis = spanned(np.delete(slope, columns, axis=1))
    left = error - basis @ (basis.T @ error)
    promised, at = [], known
    for one in offered:
        own_columns = slope[:, at : at + len(one.unknowns)]
        at += len(one.unknowns)
        past = own_columns - basis @ (basis.T @ own_columns)
        score = past.T @ left
        promised.append(float(score @ np.linalg.pinv(past.T @ past, hermitian=True) @ score) / variance)
    for index in np.argsort(promised)[::-1][:2]:
        one = offered[int(index)]
        if promised[int(index)] < -0.5 * BIC:
            break
        richer = _polished(current, own.releasing((*taken, *one.unknowns)))
        if _earned(current, richer):
            return richer, one
    return None


def _polished(current: Fit, problem: CoupledProblem) -> Fit:
    """`problem` polished from where `current` is, at its gain."""
    start = _problem(current).carried(current.x, problem)
    ends = polish_all(problem, start[None], current.found.gain, ITERATIONS)
    found = dataclasses.replace(current.found, x=ends.x[0], criterion=float(ends.loss[0]))
    return Fit(problem, found)


def _earned(poorer: Fit, richer: Fit) -> bool:
    """Whether the evidence for a change is what a name needs, and comes from many places."""
    gained = richer.terms() - poorer.terms()
    price = (richer.problem.p - poorer.problem.p) * float(np.log(richer.problem.samples.used))
    return 2.0 * float(gained.sum()) - price > -BIC and block_z(gained) > Z_STRONG


def _needed(current: Fit, released: list[Shown]) -> tuple[Fit, list[Shown]]:
    """Take back what the later changes made unnecessary."""
    for one in list(released) if len(released) > 1 else []:
        rest = [other for other in released if other is not one]
        poorer = _polished(current, _problem(current).releasing(tuple(i for r in rest for i in r.unknowns)))
        if not _earned(poorer, current):
            current, released = poorer, rest
    return current, released


def _change(final: Fit, one: Shown) -> Change:
    """Before, after, and the interval of the difference."""
    problem = _problem(final)
    spread = final.spread
    (old, new), unit = _values(problem, final.x, one)
    gradient = np.zeros((1, len(final.x)))
    for index in range(problem.p):
        moved = final.x.copy()
        moved[index] += DIFFERENCE
        (low, high), _ = _values(problem, moved, one)
        gradient[0, index] = ((high - low) - (new - old)) / DIFFERENCE
    half = float(spread.half_widths(gradient)[0])
    interval = (new - old - half, new - old + half)
    if one.guise is None:
        return Change(one.name, old, new, unit, interval)
    return Change(one.name, old, new, unit, interval, one.guise.name, _kind(one.guise, old, new, half))


def _values(problem: CoupledProblem, x: Floats, one: Shown) -> tuple[tuple[float, float], str]:
    """The quantity at commissioning and today, and its unit."""
    found = []
    for state, own in zip(problem.states, problem.split(x[None]), strict=True):
        if one.guise is None:
            _, unit, value, _, _ = state.named(own[0])[one.unknowns[0]]
        else:
            values = reported(state, one.guise, own[0])
            value, unit = values.get(one.name) or next(iter(values.values()))
        found.append(value)
    return (found[0], found[1]), unit


def _kind(guise: Guise, old: float, new: float, half: float) -> str:
    """What became of an effect, in one word."""
    linear = guise.wave is not None or guise.amplitude() is not None
    small, large = sorted((abs(old), abs(new)))
    vanishing = linear and small < max(half, ABSENT * large)
    if vanishing or (not linear and small < ABSENT * large):
        stiffer = not linear and guise.unknowns[0].parameter.endswith(("stiffness", "limit"))
        return "appeared" if (abs(new) > abs(old)) != stiffer else "gone"
    return "grown" if abs(new) > abs(old) else "shrunk"
