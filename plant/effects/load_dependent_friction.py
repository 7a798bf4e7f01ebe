"""load_dependent_friction: the dry level grows by μ |F_t|, F_t the force the transmission carries."""

from __future__ import annotations

from plant.effects.effect import Effect, Parameter
from plant.kernels.laws import LANES, LEVEL, TO_STEP, TRANSMITTED, Rows, law


@law(TO_STEP)
def _level(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        b[LEVEL + j] += p[j] * abs(b[TRANSMITTED + j])


EFFECT = Effect(
    name="load_dependent_friction",
    parameters=(Parameter("coefficient", "1", (0.0, 0.4), (-1.0, 1.0), absent=0.0, about="μ"),),
    laws=(_level,),
    source="Wahrburg et al. 2018",
)
