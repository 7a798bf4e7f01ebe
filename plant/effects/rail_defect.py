"""rail_defect: + A exp(-(y - y0)²/2w²) s, a place where the guide runs harder (or, A < 0, easier)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant.effects.effect import Effect, Floats, Parameter
from plant.kernels.exponential import exp_neg
from plant.kernels.laws import LANES, LEVEL, MIDDLE, TO_STEP, Rows, law

if TYPE_CHECKING:
    from plant.machine import Machine


@law(TO_STEP)
def _level(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        away = (b[MIDDLE + j] - p[LANES + j]) / p[2 * LANES + j]
        b[LEVEL + j] += p[j] * exp_neg(0.5 * away * away)


def _rate(values: Floats, machine: Machine, speed: float) -> Floats:  # noqa: ARG001
    rate: Floats = speed / values[2]
    return rate


EFFECT = Effect(
    name="rail_defect",
    parameters=(
        Parameter("amplitude", "N", (-200.0, 200.0), absent=0.0, about="A"),
        Parameter("centre", "m", (-10.0, 10.0), about="y0"),
        Parameter("width", "m", (0.002, 0.2), (1e-6, 1e3), about="w, standard deviation"),
    ),
    laws=(_level,),
    rate=_rate,
    source="guide damage of rolling and plain bearings",
)
