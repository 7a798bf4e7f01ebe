"""torque_scale_error: F_d (1 + e)."""

from __future__ import annotations

from plant.effects.effect import Effect, Parameter
from plant.kernels.laws import DRIVE, LANES, TO_DRIVE, Rows, law


@law(TO_DRIVE)
def _scale(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        b[DRIVE + j] *= 1.0 + p[j]


EFFECT = Effect(
    name="torque_scale_error",
    parameters=(Parameter("relative_error", "1", (-0.3, 0.3), (-1.0, 10.0), absent=0.0, about="e"),),
    laws=(_scale,),
    order=20,
    source="torque constant",
)
