"""step_change: F_c -> F_c + A at t_s: jam, lost lubricant, brake drag.

Taken at its word: F_s stays. With `static_share` 1 it rises by A too, as under a brake that drags at any speed.
"""

from __future__ import annotations

from plant.effects.effect import Effect, Parameter
from plant.kernels.laws import CLIMB, LANES, RISE, TO_STEP, Rows, law


@law(TO_STEP)
def _climb(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        part = (t + 0.5 * h - p[LANES + j]) / h  # the part of the sub-step after t_s: the impulse is exact
        step = p[j] * min(max(part, 0.0), 1.0)
        b[CLIMB + j] += step
        b[RISE + j] += p[2 * LANES + j] * step


EFFECT = Effect(
    name="step_change",
    parameters=(
        Parameter("step", "N", (-200.0, 200.0), absent=0.0, about="A"),
        Parameter("time", "s", (0.0, 1e5), about="t_s"),
        Parameter("static_share", "1", (0.0, 1.0), (0.0, 1.0), default=0.0, reported=False, about="1: F_s rises too"),
    ),
    laws=(_climb,),
    source="jam, lost lubricant, brake drag",
)
