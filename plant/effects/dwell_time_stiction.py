"""dwell_time_stiction: F_s(t_rest) = F_s + A (1 - exp(-t_rest/τ)), gone after about a millimetre of slip.

As a contact age x between 0 and 1, x' = (1 - x)/τ - |v| x/d, F_s + A x: the equation above while at rest, and a decay
over d of slip while moving. Young (0) at the start of a recording.
"""

from __future__ import annotations

from plant.effects.effect import Effect, Parameter
from plant.kernels.exponential import exp_neg
from plant.kernels.laws import AFTER, LANES, RISE, SPEED, TO_STEP, VELOCITY, Rows, law

SLIP = 0.5e-3  # m: 14 % are left after a millimetre


@law(TO_STEP)
def _rise(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        renews = 1.0 / p[LANES + j]
        rate = renews + abs(b[SPEED + j]) / p[2 * LANES + j]
        goal = renews / rate
        b[RISE + j] += p[j] * (goal + (x[j] - goal) * exp_neg(0.5 * h * rate))


@law(AFTER)
def _age(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        renews = 1.0 / p[LANES + j]
        rate = renews + abs(b[VELOCITY + j]) / p[2 * LANES + j]
        goal = renews / rate
        x[j] = goal + (x[j] - goal) * exp_neg(h * rate)


EFFECT = Effect(
    name="dwell_time_stiction",
    parameters=(
        Parameter("stiction_rise", "N", (0.0, 200.0), absent=0.0, about="A"),
        Parameter("time_constant", "s", (0.01, 100.0), (1e-3, 1e6), about="τ"),
        Parameter("slip", "m", (1e-4, 2e-3), (1e-7, 1.0), default=SLIP, reported=False, about="d"),
    ),
    laws=(_rise, _age),
    initial=(0.0,),
    source="Rabinowicz 1951; Armstrong-Hélouvry et al. 1994",
)
