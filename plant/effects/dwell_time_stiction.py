"""dwell_time_stiction: F_s(t_rest) = F_s + A (1 - exp(-t_rest/τ)), gone after about a millimetre of slip.

As a contact age x between 0 and 1, with F_s + A x: x' = (1 - x)/τ at rest, x' = -|v| x/d while moving. At the start of
a recording it is young (0) unless `age` says that the axis had rested before. A step that ends at rest counts as rest:
an observer's correction that friction swallows at once is no motion. Bristles never rest exactly: below REST_SPEED they
count as resting. The rise falls with speed as the rest of F_s does; the `level_share` of it does not, and only slip
takes it away.
"""

from __future__ import annotations

import math

from numba import njit

from plant.effects.effect import Effect, Parameter
from plant.kernels.exponential import exp_neg
from plant.kernels.laws import AFTER, BRISTLE_STIFFNESS, CLIMB, LANES, RISE, SPEED, TO_STEP, VELOCITY, Rows, law
from plant.kernels.step import FASTMATH

SLIP = 0.5e-3  # m: 14 % are left after a millimetre
REST_SPEED = 1e-4  # m/s, with bristles; without them rest is exact
AT_REST = 1e-9  # m/s
YOUNG = 1e-30  # contact age that is as good as none: numbers too small for the processor are slow


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def _older(age: float, first: float, rest: float, slipped: float) -> float:
    """Contact age, `first` where there is none, after `rest` time constants at rest or else `slipped` slip lengths."""
    age = age if age == age else first
    left = exp_neg(rest if rest > 0.0 else slipped)
    older = 1.0 - (1.0 - age) * left if rest > 0.0 else age * left
    return older if older > YOUNG else 0.0


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def rests_for(h: float, speed: float, bristles: float) -> float:
    """How much of `h` [s] the axis rests that moves at this `speed` [m/s]: all of it or none."""
    return h if speed < (REST_SPEED if bristles > 0.0 else AT_REST) else 0.0


@law(TO_STEP)
def _rise(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        speed = abs(b[SPEED + j])
        rest = rests_for(0.5 * h, speed, b[BRISTLE_STIFFNESS + j]) / p[LANES + j]
        rise = p[j] * _older(x[j], p[3 * LANES + j], rest, 0.5 * h * speed / p[2 * LANES + j])
        b[RISE + j] += rise
        b[CLIMB + j] += p[4 * LANES + j] * rise


@law(AFTER)
def _age(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        rested = rests_for(h, abs(b[SPEED + j]), b[BRISTLE_STIFFNESS + j])
        slipped = h * abs(b[VELOCITY + j]) / p[2 * LANES + j]
        x[j] = _older(x[j], p[3 * LANES + j], rested / p[LANES + j], slipped)


EFFECT = Effect(
    name="dwell_time_stiction",
    parameters=(
        Parameter("stiction_rise", "N", (0.0, 200.0), absent=0.0, about="A"),
        Parameter("time_constant", "s", (0.01, 100.0), (1e-3, 1e6), about="τ"),
        Parameter("slip", "m", (1e-4, 2e-3), (1e-7, 1.0), default=SLIP, reported=False, about="d"),
        Parameter("age", "1", (0.0, 1.0), default=0.0, reported=False, about="x at the start"),
        Parameter("level_share", "1", (0.0, 1.0), (0.0, 1.0), default=0.0, reported=False, about="of A, at any speed"),
    ),
    laws=(_rise, _age),
    initial=(math.nan,),
    source="Rabinowicz 1951; Armstrong-Hélouvry et al. 1994",
)
