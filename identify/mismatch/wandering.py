"""Dry friction that wanders has many steps, and many places, none of which is the one that a name means."""

from __future__ import annotations

import numpy as np

from identify.mismatch.compare import ONCE, Fit
from identify.mismatch.guise import OWN_CURVE, Guise
from identify.mismatch.locate import coordinates
from identify.mismatch.nameless import gain_of_one
from identify.mismatch.probes import View

STEP, WARMTH = "step_change", "thermal_drift"
MOMENTS = 24  # at which one more step is tried
MORE = 0.1  # of the evidence of fitted and unseen data for a change: if another step has this much, friction wanders
CHANCE = 15.0  # evidence that the best of so many moments has by chance: about 2 ln 24, and its scatter
EDGE = 0.05  # of the recording: a step so close to its ends may be anything that ended or began there
NEAR = 0.1  # of the recording: a step so close to the named one mends its shape, and is no other
BACK = -250.0  # evidence of the end of unseen data for a step: where it is less, friction is as it was before again
LEAST = 0.035, 0.02  # of the dry friction: friction wanders by 1 to 3 %, and a step of less is one of its moods; one
# of which all data are sure may be smaller
MOODS = 0.02  # of the dry friction: what falls by less while a recording lasts is how friction is just then
OTHERS = "friction steps at other moments too"  # beginning of the reason
PLACE = "rail_defect"
SPOTS = 60  # on the travel, at which one more is tried
FAINT = 0.1  # of the dry friction: a place that is harder by more is one, whatever the others are
BROAD = 0.5  # of the travel, four standard deviations: a faint place that is as long is how friction varies along it
ALIKE = 0.12  # of a faint place's evidence: if another one has this much, friction varies all along the guide; beside
# true ones the others had 0.004 to 0.06
APART = 2.0  # widths of both between them


def wanders(
    fitted: Fit, guise: Guise, evidence: float, acting: float, *, proven: bool, sure: bool = False, parting: float = 0.0
) -> str | None:
    """Why a change in time is no event of its own, or None.

    What leaves hardly any error of unseen data happens in them at the same moment: no friction wanders twice alike.
    But a brake that drags for a while and frees itself is no step.

    Args:
        fitted: the model with the change.
        guise: the effect, or physics in no catalogue; what does not happen in time never wanders.
        evidence: of fitted and of unseen data for the change, > 0. [1]
        acting: force of the change, where it acts. [N]
        proven: whether unseen data foretell it, and leave hardly any error, or tell it in all places alike.
        sure: whether all data are far likelier with it, and half of the error on unseen ones is gone.
        parting: the least evidence of unseen data for it from any moment on. [1]
    """
    name = guise.name
    if name not in ONCE and guise.depends != "time":
        return None
    if name == STEP and abs(_value(fitted, "step")) < LEAST[proven or sure] * fitted.dry_level:
        return f"a step of {_value(fitted, 'step'):.2g} is no more than friction wanders by"
    if name == STEP and parting < BACK:
        return f"{OWN_CURVE}: it goes back in data that were not fitted"
    if name == WARMTH and acting < MOODS * fitted.dry_level:
        return f"a warmth of {acting:.2g} is no more than friction wanders by"
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


def one_of_many(fitted: Fit, evidence: float) -> bool:
    """Whether the model's faint place on the guide is one of many: another as wide, or twice, is nearly as likely.

    Or so long that there is no room for others.

    Args:
        fitted: the model with its `rail_defect`, and all that it has beside that.
        evidence: of all data for the place. [1]
    """
    height, centre, width = (_value(fitted, parameter, PLACE) for parameter in ("amplitude", "centre", "width"))
    if abs(height) > FAINT * fitted.dry_level:
        return False
    if 4.0 * width > BROAD * fitted.problem.scales.travel:
        return True
    view = View.of(fitted, fitted.found.gain)
    samples = view.foreseen()
    direction = coordinates(samples, fitted.problem.axis)["direction"]
    places = np.linspace(float(samples.position.min()), float(samples.position.max()), SPOTS)
    most = 0.0
    for wide in (width, 2.0 * width):
        others = places[np.abs(places - centre) > APART * (width + wide)]
        away = (samples.position[:, None] - others) / wide
        seen = view.responses(np.exp(-0.5 * away**2) * direction[:, None])
        most = max([most, *(gain_of_one(view, one) for one in seen.T)])
    return most > max(ALIKE * evidence, CHANCE)


def moment_of(fitted: Fit) -> float:
    """When the friction of a model with a `step_change` steps. [s]"""
    return _value(fitted, "time")


def _value(fitted: Fit, parameter: str, name: str = STEP) -> float:
    """A parameter of the model's effect of this name. [its unit]"""
    guise = fitted.problem.guise(name)
    return guise.value(fitted.x[fitted.problem.slot(guise)], parameter)
