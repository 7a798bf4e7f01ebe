"""actuator_lag: τ F' + F = F_d, exact for a force held over the sub-step; starts settled at the first force."""

from __future__ import annotations

import math

from plant.effects.effect import Effect, Parameter
from plant.kernels.exponential import exp_neg
from plant.kernels.laws import DRIVE, LANES, RAMP, TO_DRIVE, Rows, law

SMALL = 1e-3


@law(TO_DRIVE)
def _lag(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        goal = b[DRIVE + j]
        lagged = goal if x[j] != x[j] else x[j]
        ratio = h / p[j]
        keeps = exp_neg(ratio)
        mean = (1.0 - keeps) / ratio if ratio > SMALL else 1.0 - 0.5 * ratio * (1.0 - ratio / 3.0)
        moment = (mean - keeps) / ratio if ratio > SMALL else 0.5 - ratio / 3.0 * (1.0 - 0.375 * ratio)
        b[DRIVE + j] = goal + (lagged - goal) * mean
        b[RAMP + j] = (1.0 - mean) * b[RAMP + j] + 12.0 * (moment - 0.5 * mean) * (lagged - goal)
        x[j] = goal + (lagged - goal) * keeps


EFFECT = Effect(
    name="actuator_lag",
    parameters=(Parameter("time_constant", "s", (0.0, 0.2), (0.0, 100.0), absent=0.0, about="τ"),),
    laws=(_lag,),
    order=25,
    initial=(math.nan,),
    source="Ljung 1999",
)
