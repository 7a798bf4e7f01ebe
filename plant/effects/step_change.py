"""step_change: F_c -> F_c + A at t_s, with the bump F_s - F_c unchanged: jam, lost lubricant, brake drag."""

from __future__ import annotations

from plant.effects.effect import Effect, Parameter
from plant.kernels.laws import LANES, LEVEL, TO_STEP, Rows, law


@law(TO_STEP)
def _level(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        part = (t + 0.5 * h - p[LANES + j]) / h  # the part of the sub-step after t_s: the impulse is exact
        b[LEVEL + j] += p[j] * min(max(part, 0.0), 1.0)


EFFECT = Effect(
    name="step_change",
    parameters=(
        Parameter("step", "N", (-200.0, 200.0), absent=0.0, about="A"),
        Parameter("time", "s", (0.0, 1e5), about="t_s"),
    ),
    laws=(_level,),
    source="jam, lost lubricant, brake drag",
)
