"""end_stop: + k (y - y_e) beyond y_e, where beyond is away from the middle of the travel."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant.effects.effect import Effect, Floats, Parameter
from plant.kernels.laws import FORCE, LANES, MIDDLE, TO_STEP, Rows, law

if TYPE_CHECKING:
    from plant.machine import Machine


@law(TO_STEP)
def _force(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        side = p[2 * LANES + j]
        b[FORCE + j] += p[LANES + j] * side * max(side * (b[MIDDLE + j] - p[j]), 0.0)


def _prepare(values: Floats, machine: Machine) -> Floats:
    return np.vstack([values, np.where(values[0] >= machine.surroundings.middle, 1.0, -1.0)])


def _rate(values: Floats, machine: Machine, speed: float) -> Floats:  # noqa: ARG001
    rate: Floats = np.sqrt(values[1] / machine.mass)
    return rate


EFFECT = Effect(
    name="end_stop",
    parameters=(
        Parameter("position", "m", (-10.0, 10.0), about="y_e"),
        Parameter("stiffness", "N/m", (1e3, 1e6), (0.0, 1e9), absent=0.0, about="k"),
    ),
    laws=(_force,),
    prepare=_prepare,
    rate=_rate,
    source="bumper, hard stop",
)
