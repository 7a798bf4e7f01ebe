"""Dry friction that wanders has many steps, none of which is the step that a name means."""

from __future__ import annotations

import numpy as np

from identify.mismatch.compare import ONCE, Fit
from identify.mismatch.locate import coordinates
from identify.mismatch.nameless import gain_of_one
from identify.mismatch.probes import View

STEP = "step_change"
MOMENTS = 24  # at which one more step is tried
MORE = 0.1  # of the evidence of fitted and unseen data for a change: if another step has this much, friction wanders
CHANCE = 15.0  # evidence that the best of so many moments has by chance: about 2 ln 24, and its scatter
EDGE = 0.03  # of the recording: a step so close to its ends may be anything that ended or began there
NEAR = 0.1  # of the recording: a step so close to the named one mends its shape, and is no other
LEAST = 0.035  # of the dry friction: friction wanders by 1 to 3 %, and a step of less is one of its moods
OTHERS = "friction steps at other moments too"  # beginning of the reason


def wanders(fitted: Fit, name: str, evidence: float, *, proven: bool) -> str | None:
    """Why a change in time is no event of its own, or None.

    What leaves hardly any error of unseen data happens in them at the same moment: no friction wanders twice alike.

    Args:
        fitted: the model with the change.
        name: of the effect; those that do not happen in time never wander.
        evidence: of fitted and of unseen data for the change, > 0. [1]
        proven: whether unseen data foretell it, and leave hardly any error.
    """
    if name not in ONCE:
        return None
    if name == STEP and abs(_value(fitted, "step")) < LEAST * fitted.dry_level:
        return f"a step of {_value(fitted, 'step'):.2g} is no more than friction wanders by"
    view = View.of(fitted, fitted.found.gain)
    samples = view.foreseen()
    first, last = float(samples.t.min()), float(samples.t.max())
    moments = np.linspace(first, last, MOMENTS + 2)[1:-1]
    if name == STEP:
        moment = moment_of(fitted)
        if not EDGE * (last - first) < moment - first < (1.0 - EDGE) * (last - first):
            return f"friction steps at {moment:.3g} s, where the fitted data begin or end"
        moments = moments[np.abs(moments - moment) > NEAR * (last - first)]
    if proven:
        return None
    direction = coordinates(samples, fitted.problem.axis)["direction"]
    seen = view.responses((samples.t[:, None] >= moments) * direction[:, None])
    most = max(gain_of_one(view, one) for one in seen.T)
    if most < max(MORE * evidence, CHANCE):
        return None
    return f"{OTHERS} (evidence {most:.0f} for one more)"


def moment_of(fitted: Fit) -> float:
    """When the friction of a model with a `step_change` steps. [s]"""
    return _value(fitted, "time")


def _value(fitted: Fit, parameter: str) -> float:
    """A parameter of the model's `step_change`. [its unit]"""
    guise = next(guise for guise in fitted.problem.guises if guise.name == STEP)
    return guise.value(fitted.x[fitted.problem.slot(guise)], parameter)
