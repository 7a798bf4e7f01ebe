"""How well an effect's parameters can be known at best: the catalogue's curves are not quite the machine's.

However little noise there is, a bump is not exactly a bell, a stop not exactly a spring and a step not exactly sudden.
No interval is narrower than that.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from identify.mismatch.guise import Guise
from identify.mismatch.result import FoundEffect, Quantity
from identify.mismatch.rules import LATE

SIZE = 0.03  # relative: no size is better known
CURVED = 0.1  # relative: nor is what says how a curve bends
SCALE = 0.001  # relative: no period is better known: radii are not
MIDDLE = 0.1  # of its width: no defect's centre is better known: it need not be symmetric
SUDDEN = 0.03  # s: no step's moment is better known: it takes a while
CURVES = {"width", "damping", "bristle_damping", "gap", "relative_drop"}
BENT = {("end_stop", "stiffness"), ("thermal_drift", "time_constant"), ("dwell_time_stiction", "time_constant")}


def no_better(effect: str, values: dict[str, Quantity], stamped: float) -> dict[str, Quantity]:
    """The parameters of an effect, none better known than its curve is.

    Args:
        effect: its name.
        values: its parameters by name.
        stamped: how well the log tells when the torque acted. [s]
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
    return found


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
