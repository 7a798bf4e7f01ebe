"""thermal_drift: F_v(t) = F_v (1 + κ exp(-t/τ)), t from the start of the recording."""

from __future__ import annotations

from plant.effects.effect import Effect, Parameter
from plant.kernels.exponential import exp_neg
from plant.kernels.laws import LANES, TO_STEP, VISCOUS_BACKWARD, VISCOUS_FORWARD, Rows, law


@law(TO_STEP)
def _coefficients(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        factor = 1.0 + p[j] * exp_neg(max(t, 0.0) / p[LANES + j])
        b[VISCOUS_FORWARD + j] *= factor
        b[VISCOUS_BACKWARD + j] *= factor


EFFECT = Effect(
    name="thermal_drift",
    parameters=(
        Parameter("relative_drop", "1", (-0.9, 5.0), (-1.0, 100.0), absent=0.0, about="κ"),
        Parameter("time_constant", "s", (5.0, 3600.0), (1e-3, 1e9), about="τ"),
    ),
    laws=(_coefficients,),
    source="Bittencourt et al. 2010; Simoni et al. 2015",
)
