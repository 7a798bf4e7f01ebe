"""What differs between commissioning and today: friction, and effects that appeared, grew, shrank or went.

The model named in today's data is fitted to both states. Where an effect sits (a place on the rail, a period, a width)
is taken from today, for a state without the effect cannot tell it; how strong it is, and friction itself, are free in
both. So a rail defect of today does not read as a rise of the dry friction, and its strength at commissioning has an
interval of its own.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from identify.mismatch.compare import Fit, fit
from identify.mismatch.data import join
from identify.mismatch.extended import ExtendedProblem
from identify.mismatch.guise import Guise
from identify.mismatch.pictures import friction_of
from identify.mismatch.report_values import quantities, spread_of
from identify.mismatch.result import Change, Quantity
from identify.mismatch.select import BIC
from identify.preprocess import Samples

Floats = NDArray[np.float64]

FAMILY = 0.05  # chance that anything at all is called changed on a machine that did not change


@dataclasses.dataclass(frozen=True, slots=True)
class _State:
    """The model in one state: friction, strength of each effect, and whether each effect is needed there."""

    friction: dict[str, Quantity]
    strength: dict[str, tuple[str, Quantity]]
    needed: dict[str, bool]


def changes_since(chosen: Fit, before: Samples, today: Sequence[Samples]) -> tuple[Change, ...]:
    """Everything that differs by more than its uncertainty, all comparisons taken together.

    Args:
        chosen: the model named in today's data, or the baseline.
        before: samples at commissioning.
        today: all samples of today.
    """
    samples = join(list(today))
    now = _fitted(chosen.problem.on(samples), [chosen.x[: chosen.problem.p]])
    after = _state(now, now.problem.guises)
    pinned = _at_commissioning(now, before)
    then = _state(pinned, now.problem.guises)
    found = []
    number = len(after.friction) + len(after.strength)
    widen = float(norm.ppf(1.0 - 0.5 * FAMILY / number) / norm.ppf(0.975))
    for name, new in after.friction.items():
        old = then.friction.get(name)
        if old is not None and (change := _change(name, old, new, widen)) is not None:
            found.append(change)
    for effect, (parameter, new) in after.strength.items():
        old = then.strength[effect][1]
        change = _change(parameter, old, new, widen)
        if change is not None:
            found.append(dataclasses.replace(change, effect=effect, kind=_kind(effect, then, after, change)))
    return tuple(found)


def _fitted(problem: ExtendedProblem, points: Sequence[Floats]) -> Fit:
    """The likeliest end from unknowns (p,) each."""
    starts = np.zeros(problem.size - problem.p)
    return fit(problem, np.array([np.concatenate([point, starts]) for point in points]))


def _at_commissioning(now: Fit, before: Samples) -> Fit:
    """Today's model on the samples of commissioning; places and shapes stay as they are today."""
    problem = now.problem.on(before)
    low, high = (edge.copy() for edge in problem.bounds)
    absent = now.x[: problem.p].copy()
    for guise in problem.guises:
        slot = problem.slot(guise)
        for index in range(guise.size):
            if index in strengths(guise):
                absent[slot.start + index] = 0.0 if _linear(guise) else absent[slot.start + index]
            else:
                low[slot.start + index] = high[slot.start + index] = now.x[slot.start + index]
    problem.bounds = low, high
    return _fitted(problem, [now.x[: problem.p], absent])


def strengths(guise: Guise) -> tuple[int, ...]:
    """Unknowns that say how strong an effect is; the others say where, or in which shape."""
    if guise.wave is not None:
        return guise.size - 2, guise.size - 1
    amplitude = guise.amplitude()
    return (amplitude,) if amplitude is not None else (0,)


def _linear(guise: Guise) -> bool:
    """True where zero strength is no effect."""
    return guise.wave is not None or guise.amplitude() is not None


def _state(fitted: Fit, guises: Sequence[Guise]) -> _State:
    """Read a fit of one state."""
    spread = spread_of(fitted)
    strength, needed = {}, {}
    for guise in guises:
        shown = quantities(fitted, guise, spread)
        name = guise.wave[0] if guise.wave is not None else guise.unknowns[strengths(guise)[0]].parameter
        name = name if name in shown else next(iter(shown))
        strength[guise.name] = name, shown[name]
        needed[guise.name] = _needed(fitted, guise)
    return _State(friction_of(fitted), strength, needed)


def _needed(fitted: Fit, guise: Guise) -> bool:
    """Whether this state's data ask for the effect: the evidence that a name needs."""
    problem = fitted.problem
    rest = problem.including(tuple(other for other in problem.guises if other is not guise))
    parts = [fitted.x[: problem.base], *(fitted.x[problem.slot(other)] for other in rest.guises)]
    poorer = _fitted(rest, [np.concatenate(parts)])
    extra = guise.size * float(np.log(problem.samples.used))
    return poorer.found.criterion - fitted.found.criterion - extra > -BIC


def _change(name: str, old: Quantity, new: Quantity, widen: float) -> Change | None:
    """The difference with its 95 % interval, where it is beyond the interval widened for many comparisons."""
    if old.ci95 is None or new.ci95 is None:
        return None
    half = float(np.hypot(old.ci95[1] - old.ci95[0], new.ci95[1] - new.ci95[0])) / 2.0
    moved = new.value - old.value
    if not abs(moved) > widen * half:
        return None
    return Change(name, old.value, new.value, old.unit, (moved - half, moved + half))


def _kind(effect: str, then: _State, after: _State, change: Change) -> str:
    """What became of an effect, in one word."""
    if not then.needed[effect]:
        return "appeared"
    if not after.needed[effect]:
        return "gone"
    return "grown" if abs(change.after) > abs(change.before) else "shrunk"
