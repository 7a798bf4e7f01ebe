"""position_dependent_friction: the dry level of eq. (1) times max(0, 1 + k (y - y_m)), y_m the middle of the travel."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from plant.effects.effect import Effect, Floats, Parameter
from plant.kernels.laws import BACKWARD, FORWARD, LANES, MIDDLE, TO_STEP, Rows, law

if TYPE_CHECKING:
    from plant.machine import Machine


@law(TO_STEP)
def _levels(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        factor = max(1.0 + p[j] * (b[MIDDLE + j] - p[LANES + j]), 0.0)
        b[FORWARD + j] *= factor
        b[BACKWARD + j] *= factor


def _prepare(values: Floats, machine: Machine) -> Floats:
    return np.vstack([values, np.full_like(values, machine.surroundings.middle)])


def _derive(values: Mapping[str, float], friction: Floats) -> dict[str, tuple[float, str]]:
    return {"slope": (values["relative_slope"] * float(friction[0]), "N/m")}


EFFECT = Effect(
    name="position_dependent_friction",
    parameters=(Parameter("relative_slope", "1/m", (-5.0, 5.0), absent=0.0, about="k"),),
    laws=(_levels,),
    prepare=_prepare,
    derive=_derive,
    source="Armstrong 1991, Control of Machines with Friction",
)
