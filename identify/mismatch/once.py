"""A step that came once, in one of several recordings that follow each other, and is there in all after it.

An effect is as old as its recording otherwise, and begins anew with each: a warm-up does, a jam does not.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from identify.mismatch.compare import Fit, fit
from identify.mismatch.conclusion import WORTH, Conclusion
from identify.mismatch.data import begins, following
from identify.mismatch.explore import explore
from identify.mismatch.guise import Guise
from identify.mismatch.rules import TIED_BIC, Z_STRONG, best_of, cost
from identify.mismatch.select import select
from identify.mismatch.wandering import EDGE, STEP, moment_of
from identify.mismatch.ways import guises
from plant.effects import find

FOLLOW = "recordings taken to follow each other: the step in recording {} is there in all after it"


def happened_once(found: Conclusion) -> Conclusion | None:
    """The conclusion that friction stepped in one of the fitted recordings, where that stands; or None.

    Where the judge is predicted nearly as well as by what is fitted to it, friction is the same, and is not asked.
    """
    if found.astray * WORTH < 1.0:
        return None
    for number in range(len(begins(found.evidence.train))):
        told = _stepped(found, number)
        if told is not None:
            return told
    return None


def _stepped(found: Conclusion, number: int) -> Conclusion | None:
    """The conclusion that friction stepped in the fitted recording of this `number`, more than slightly; or None."""
    evidence, place, length = following(found.evidence, number)
    before = found.selection.baseline
    baseline = dataclasses.replace(before, problem=before.problem.on(evidence.train, before.problem.first_state))
    setting = dataclasses.replace(found.setting, duration=float(evidence.train.t.max()))
    ways = guises({STEP: find(STEP)}, setting)
    at_once = [dataclasses.replace(guise, freed=None) for guise in ways]
    _, steps = explore(baseline, at_once, evidence.held_out, found.progress)
    if best_of(steps) is None:
        return None  # nor will it, where it takes its time
    selection = select(baseline, ways, evidence.held_out, found.progress)
    if not selection.steps:
        return None
    guise, fitted = selection.steps[0].guise, selection.chosen
    if selection.steps[0].evidence.z < Z_STRONG:
        return None  # one place of many moments and recordings: friction that wanders has such
    if not EDGE * length < moment_of(fitted) < (1.0 - EDGE) * length:
        return None
    likelier = [one for one in found.selection.opening if one.refused is None or one.misplaced]
    between = evidence.train.t[begins(found.evidence.train)[1:]]
    others = [cost(one.fit) for one in likelier] + [cost(_at(fitted, guise, float(t))) for t in between]
    if min(others, default=np.inf) < cost(fitted) + TIED_BIC:
        return None
    evidence = dataclasses.replace(evidence, removed=(*evidence.removed, FOLLOW.format(place + 1)))
    told = dataclasses.replace(
        found, evidence=evidence, setting=setting, selection=selection, plain=selection.baseline, told_twice=False
    )
    return told if told.explains and not told.slight else None


def _at(fitted: Fit, guise: Guise, moment: float) -> Fit:
    """The model with the step where a recording begins [s] instead: friction of another day is no event."""
    index = [unknown.parameter for unknown in guise.unknowns].index("time")
    left = tuple(unknown for unknown in guise.unknowns if unknown.parameter != "time")
    fixed = (*guise.fixed, ("time", moment - fitted.problem.samples.sample_time))
    pinned = dataclasses.replace(guise, unknowns=left, starts=np.delete(guise.starts, index, axis=1), fixed=fixed)
    x = np.delete(fitted.x, fitted.problem.slot(guise).start + index)
    return fit(fitted.problem.including((pinned,)), x[None])
