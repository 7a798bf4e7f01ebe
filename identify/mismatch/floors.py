"""How well an effect's parameters can be known at best: the catalogue's curves are not quite the machine's.

However little noise there is, a bump is not exactly a bell, a stop not exactly a spring and a step not exactly sudden.
No interval is narrower than that. Nor is what a contact gains by endless rest known better than how fast it gains it.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from identify.mismatch.guise import Guise
from identify.mismatch.result import FoundEffect, Quantity
from identify.mismatch.rules import BREAK_AWAY, LATE

SIZE = 0.03  # relative: no size is better known
CURVED = 0.1  # relative: nor is what says how a curve bends
SCALE = 0.001  # relative: no period is better known: radii are not
MIDDLE = 0.1  # of its width: no defect's centre is better known: it need not be symmetric
SUDDEN = 0.03  # s: no step's moment is better known: it takes a while
CURVES = {"width", "damping", "bristle_damping", "gap", "relative_drop"}
BENT = {("end_stop", "stiffness"), ("thermal_drift", "time_constant"), ("dwell_time_stiction", "time_constant")}


def no_better(effect: str, values: dict[str, Quantity], stamped: float, rests: float) -> dict[str, Quantity]:
    """The parameters of an effect, none better known than its curve is.

    Args:
        effect: its name.
        values: its parameters by name.
        stamped: how well the log tells when the torque acted. [s]
        rests: how long the axis rests at most. [s]
    """
    found = dict(values)
    for name, value in values.items():
        if value.ci95 is None:
            continue
        least = _least(effect, name, values)
        if effect in LATE:
            least = max(least, stamped)
        low, high = (float(np.hypot(end - value.value, least)) for end in value.ci95)
        floor = 0.0 if effect in LATE else -np.inf
        found[name] = dataclasses.replace(value, ci95=(max(value.value - low, floor), value.value + high))
    return _after_endless_rest(found, rests) if effect in BREAK_AWAY else found


def _after_endless_rest(values: dict[str, Quantity], rests: float) -> dict[str, Quantity]:
    """A rise with its time constant, told by what is there after `rests` [s]: A (1 - exp(-rests/τ)).

    The interval of A holds all that give that with some τ of its own interval. Where rests are all alike and a few τ
    long, A hardly depends on τ near the fitted one, and its half-width says nothing of longer ones.
    """
    rise, constant = values["stiction_rise"], values["time_constant"]
    if rise.ci95 is None or constant.ci95 is None:
        return values

    def gained(time_constant: float) -> float:
        return max(float(-np.expm1(-rests / max(time_constant, 1e-9))), 1e-9)

    (low, high), (soon, late), usual = rise.ci95, constant.ci95, gained(constant.value)
    interval = min(low, low * usual / gained(soon)), max(high, high * usual / gained(late))
    return {**values, "stiction_rise": dataclasses.replace(rise, ci95=interval)}


def within_reach(effect: FoundEffect, guise: Guise) -> FoundEffect:
    """`effect`, its intervals no wider than where each parameter was looked for: what lies beyond nobody asked.

    What a single stroke tells would have an interval of many decades.
    """
    found = dict(effect.parameters)
    for unknown in guise.unknowns:
        value = found.get(unknown.parameter)
        if value is not None and value.ci95 is not None:
            low, high = value.ci95
            least = 0.0 if unknown.log and guise.optional(unknown.parameter) else unknown.low
            reach = max(low, min(least, value.value)), min(high, max(unknown.high, value.value))
            found[unknown.parameter] = dataclasses.replace(value, ci95=reach)
    return dataclasses.replace(effect, parameters=found)


def _least(effect: str, name: str, values: dict[str, Quantity]) -> float:
    """Half-width below which the interval of a parameter may not be. [its unit]"""
    size = abs(values[name].value)
    known = {"time": SUDDEN, "position": 0.0, "rest_position": 0.0, "period": SCALE * size}
    if name == "centre":
        return MIDDLE * values["width"].value
    return known.get(name, (CURVED if name in CURVES or (effect, name) in BENT else SIZE) * size)
