"""coulomb_asymmetry: the dry level of eq. (1) times (1 + a) moving up, times (1 - a) moving down."""

from __future__ import annotations

from collections.abc import Mapping

from plant.effects.effect import Effect, Floats, Parameter
from plant.kernels.laws import BACKWARD, FORWARD, LANES, TO_STEP, Rows, law


@law(TO_STEP)
def _levels(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        b[FORWARD + j] *= 1.0 + p[j]
        b[BACKWARD + j] *= 1.0 - p[j]


def _derive(values: Mapping[str, float], friction: Floats) -> dict[str, tuple[float, str]]:
    return {"coulomb_difference_half": (values["asymmetry_ratio"] * float(friction[0]), "N")}


EFFECT = Effect(
    name="coulomb_asymmetry",
    parameters=(Parameter("asymmetry_ratio", "1", (-0.4, 0.4), (-1.0, 1.0), absent=0.0, about="a"),),
    laws=(_levels,),
    derive=_derive,
    source="Elhami & Brookfield 1996",
)
