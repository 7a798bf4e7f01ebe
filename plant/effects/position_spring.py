"""position_spring: + k (y - y0), a cable chain or counterbalance."""

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
        b[FORCE + j] += p[j] * (b[MIDDLE + j] - p[LANES + j])


def _rate(values: Floats, machine: Machine, speed: float) -> Floats:  # noqa: ARG001
    rate: Floats = np.sqrt(abs(values[0]) / machine.mass)
    return rate


EFFECT = Effect(
    name="position_spring",
    parameters=(
        Parameter("stiffness", "N/m", (-2000.0, 2000.0), absent=0.0, about="k"),
        Parameter("rest_position", "m", (-10.0, 10.0), about="y0"),
    ),
    laws=(_force,),
    rate=_rate,
    source="cable chain, counterbalance",
)
