"""What was found with the roles of the recordings exchanged is another start for what was fitted first.

A likelihood that depends on when an axis breaks away has many peaks, and a search may end on a low one in one recording
and on the highest in another.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from identify.mismatch.compare import Fit, fit
from identify.mismatch.conclusion import Conclusion
from identify.mismatch.explore import weighed
from identify.mismatch.extended import ExtendedProblem, Floats
from identify.mismatch.rules import best_of
from identify.mismatch.select import Selection


def carried(first: Conclusion, turned: Conclusion) -> Conclusion | None:
    """`first` with the first name of `turned`, refitted from where that ended, if it is the answer there; or None."""
    baseline = first.selection.baseline
    steps = [step for step in turned.selection.steps if step.guise.name not in baseline.names]
    if not steps:
        return None
    guise = steps[0].guise
    problem = baseline.problem.including((*baseline.problem.guises, guise))
    step = weighed(baseline, fit(problem, starts_from(problem, baseline, turned.final)), guise, first.evidence.held_out)
    opening = [*first.selection.opening, step]
    if best_of(opening) is not step:
        return None
    selection = Selection.beginning(step, baseline, opening)
    found = dataclasses.replace(first, selection=selection)
    return found if found.explains else None


def starts_from(problem: ExtendedProblem, baseline: Fit, there: Fit) -> Floats:
    """The effect as it was found `there`, with friction of the `baseline` and with that beside it. (2, size)"""
    friction = {name: value for name, _, value, *_ in there.problem.named(there.x)}
    x = np.stack([problem.encode({}), problem.encode(friction)])
    x[0, : problem.base] = baseline.x[: problem.base]
    for guise in problem.guises:
        known = next((one for one in there.problem.guises if one.name == guise.name), None)
        if known is not None:
            x[:, problem.slot(guise)] = there.x[there.problem.slot(known)]
    return x
