"""viscous_asymmetry: F_v (1 + a) moving up, F_v (1 - a) moving down."""

from __future__ import annotations

from collections.abc import Mapping

from plant.effects.effect import Effect, Floats, Parameter
from plant.kernels.laws import LANES, TO_STEP, VISCOUS_BACKWARD, VISCOUS_FORWARD, Rows, law


@law(TO_STEP)
def _coefficients(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        b[VISCOUS_FORWARD + j] *= 1.0 + p[j]
        b[VISCOUS_BACKWARD + j] *= 1.0 - p[j]


def _derive(values: Mapping[str, float], friction: Floats) -> dict[str, tuple[float, str]]:
    return {"viscous_difference_half": (values["asymmetry_ratio"] * float(friction[3]), "N*s/m")}


EFFECT = Effect(
    name="viscous_asymmetry",
    parameters=(Parameter("asymmetry_ratio", "1", (-0.6, 0.6), (-1.0, 1.0), absent=0.0, about="a"),),
    laws=(_coefficients,),
    derive=_derive,
    source="Armstrong-Hélouvry, Dupont & Canudas de Wit 1994, Automatica 30",
)
