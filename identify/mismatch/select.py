"""Which effects, and how sure: forward, swap, backward; every step decided by several judges at once."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from identify.mismatch.compare import Fit, compare, fit
from identify.mismatch.explore import explore
from identify.mismatch.guise import Guise
from identify.mismatch.progress import Stage, Tell, unheard
from identify.mismatch.rules import BIC, LESSER, Step, best_of, clock_shift, price
from identify.preprocess import Samples

MOST_EFFECTS = 3
AGAIN = 3  # leads per observer gain looked at again when a chosen effect is put to the test
TWINS = {
    name: family - {name}
    for family in (
        frozenset({"force_offset", "coulomb_asymmetry", "viscous_asymmetry", "position_spring"}),
        frozenset({"rail_defect", "position_dependent_friction", "torque_ripple", "pulley_eccentricity", "end_stop"}),
        frozenset({"inertia_error", "torque_scale_error", "load_dependent_friction", "quadratic_drag"}),
        frozenset({"actuator_lag", "dead_time", "transmission_compliance"}),
        frozenset({"presliding_hysteresis", "backlash", "dwell_time_stiction"}),
        frozenset({"thermal_drift", "step_change"}),
    )
    for name in family
}


@dataclass(slots=True)
class Selection:
    """The chosen model and what competed with it.

    Attributes:
        baseline: nothing but friction.
        chosen: the model with all effects, and perhaps a shift of the clock that is none.
        steps: the effects, in the order of their finding.
        rivals: what was tried at each step.
        shift: whether torque and position turned out to be stamped by so little apart that it is no effect.
    """

    baseline: Fit
    chosen: Fit
    steps: list[Step] = field(default_factory=list)
    rivals: list[list[Step]] = field(default_factory=list)
    shift: bool = False


def select(baseline: Fit, guises: list[Guise], unseen: Samples, progress: Tell = unheard) -> Selection:
    """Add effects one by one while one earns its name, then try to swap and to drop each."""
    selection = Selection(baseline, baseline)
    while len(selection.steps) < MOST_EFFECTS:
        current = selection.chosen
        taken = {guise.name for guise in current.problem.guises}
        steps = explore(current, [guise for guise in guises if guise.name not in taken], unseen, progress)
        shift = None if selection.shift else clock_shift(steps)
        if shift is not None:
            selection.chosen, selection.shift = shift.fit, True
            continue
        selection.rivals.append(steps)
        best = best_of(steps)
        so_far = price(baseline) - price(current)
        if best is None or -best.evidence.bic < LESSER * so_far:
            break
        selection.steps.append(best)
        selection.chosen = best.fit
    if len(selection.steps) > 1:
        _reconsider(selection, guises, unseen, progress)
    return selection


def _reconsider(selection: Selection, guises: list[Guise], unseen: Samples, progress: Tell) -> None:
    """Put each effect to the test once the others are in: is it still needed, and is it still it and not a twin?

    A first name is chosen while the others are missing, and then shaped by what it stands in for.
    """
    for step in list(selection.steps[:-1]):
        rest = without(selection.chosen, step.guise)
        twins = TWINS.get(step.guise.name, frozenset()) | {step.guise.name}
        taken = {s.guise.name for s in selection.steps if s is not step}
        offered = [guise for guise in guises if guise.name in twins - taken]
        steps = [s for s in explore(rest, offered, unseen, progress, AGAIN, Stage.TEST) if s.refused is None]
        if not steps:
            if compare(rest, selection.chosen, unseen).bic < BIC:  # a worse fit of the same, but needed it is
                continue
            selection.steps = [s for s in selection.steps if s is not step]
            selection.chosen = rest
        elif price(steps[0].fit) < price(selection.chosen):
            index = selection.steps.index(step)
            selection.steps[index], selection.rivals[index] = steps[0], steps
            selection.chosen = steps[0].fit


def without(fitted: Fit, guise: Guise) -> Fit:
    """The model refitted without one of its effects."""
    problem = fitted.problem
    rest = problem.including(tuple(other for other in problem.guises if other is not guise))
    bare = np.concatenate(
        [np.delete(fitted.x[: problem.p], np.arange(problem.p)[problem.slot(guise)]), fitted.x[problem.p :]]
    )
    return fit(rest, bare[None])
