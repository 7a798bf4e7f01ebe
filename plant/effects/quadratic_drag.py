"""quadratic_drag: + c v |v|."""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant.effects.effect import Effect, Floats, Parameter
from plant.kernels.laws import DRAG, LANES, TO_STEP, Rows, law

if TYPE_CHECKING:
    from plant.machine import Machine


@law(TO_STEP)
def _drag(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        b[DRAG + j] += p[j]


def _rate(values: Floats, machine: Machine, speed: float) -> Floats:
    rate: Floats = 2.0 * speed * abs(values[0]) / machine.mass
    return rate


EFFECT = Effect(
    name="quadratic_drag",
    parameters=(Parameter("coefficient", "N*s^2/m^2", (0.0, 2000.0), (-1e6, 1e6), absent=0.0, about="c"),),
    laws=(_drag,),
    rate=_rate,
    source="textbook",
)
