"""A name that two recordings give, each fitted by itself: that stands in for agreement within one of them.

A stop that is touched once a stroke has its evidence in few places of a recording, and a gap whose state nobody knows
makes every free run worse. Chance is in few places, too; but another recording does not have the same chance, of the
same size at the same place.
"""

from __future__ import annotations

import dataclasses

from identify.mismatch.conclusion import Conclusion, overlap
from identify.mismatch.effect_sizes import may_be_absent
from identify.mismatch.report_values import measured, quantities
from identify.mismatch.result import Quantity
from identify.mismatch.rules import BIC_STRONG, FORESEEN, KNOWN, TIED_BIC, Step, lasting, misplacement
from identify.mismatch.select import EXACT, Selection
from identify.mismatch.wandering import STEP

WITH_FORCE = EXACT | {"load_dependent_friction"}
BETTER = 0.9  # of the baseline's one-second error on unseen data: where more is left, all data must be far likelier


def told_twice(first: Conclusion, turned: Conclusion) -> Conclusion | None:
    """The one name that leads in two conclusions, neither of which stands by itself; None where none is sure.

    Args:
        first: fitted to the recordings before the last, which judges.
        turned: with their roles exchanged.
    """
    told = [(found, step) for found in (first, turned) if (step := _leader(found)) is not None]
    if len(told) < 2 or sum(step.evidence.foreseen for _, step in told) < 2.0 * FORESEEN or not _agree(*told):
        return None
    found, step = min(told, key=lambda one: one[1].evidence.unseen)
    named = dataclasses.replace(step, refused=None)
    selection = Selection.beginning(named, found.selection.baseline, found.selection.opening)
    sure = dataclasses.replace(found, selection=selection, told_twice=True)
    known = sure.explains and not any(map(may_be_absent, sure.effects))
    return sure if known and (sure.error_left < BETTER or lasting(step.evidence)) else None


def _leader(found: Conclusion) -> Step | None:
    """What all data together make far likelier than any other name on top of the baseline; or None.

    Physics in no catalogue must only be less likely, unless it predicts better: some of it acts in one place, and so
    does what is asked for here.
    """
    if found.selection.aside or not found.selection.opening:
        return None
    first, *others = sorted(found.selection.opening, key=lambda step: -_everywhere(step))
    told = first.evidence
    if first.guise.name == STEP or told.bic > BIC_STRONG or told.foreseen < 0.0:
        return None
    if first.guise.name in found.outgrown:
        return None
    least = _everywhere(first) - max(TIED_BIC, KNOWN * _everywhere(first))
    rivals = [other for other in others if other.guise.depends is None or other.evidence.unseen < told.unseen]
    if any(_everywhere(rival) > least and not _equal(first, rival) for rival in rivals):
        return None
    return first if misplacement(first.fit, first.guise, told, first.acting) is None else None


def _equal(one: Step, other: Step) -> bool:
    """Whether two steps are one name, or two that grow with the force and that these data cannot tell apart."""
    names = {one.guise.name, other.guise.name}
    return len(names) == 1 or (names <= WITH_FORCE and abs(_everywhere(one) - _everywhere(other)) < TIED_BIC)


def _everywhere(step: Step) -> float:
    """Evidence of fitted and unseen data. [1]"""
    return step.evidence.foreseen - step.evidence.bic


def _agree(*told: tuple[Conclusion, Step]) -> bool:
    """Whether two steps are the same effect, every size of which may be the same."""
    if len({step.guise.name for _, step in told}) > 1:
        return False
    one, other = (_sizes(found, step) for found, step in told)
    for name in one.keys() & other.keys():
        ours, theirs = one[name].ci95, other[name].ci95
        if ours is not None and theirs is not None and not overlap(ours, theirs):
            return False
    return True


def _sizes(found: Conclusion, step: Step) -> dict[str, Quantity]:
    """What a step measures, as the conclusion's last polish has it where the effect was chosen."""
    if step.guise.name not in found.said:
        return quantities(measured(step.fit), step.guise)
    return quantities(measured(found.final), found.final.problem.guise(step.guise.name))
