"""torque_saturation: F = clip(F_d, ±F_max), the drive's current limit. Unlimited (absent) is inf.

A motor whose iron saturates has a rounded shoulder: a parabola from (1 - κ) F_max to (1 + κ) F_max, C1 at both ends.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from plant.effects.effect import Effect, Floats, Parameter
from plant.kernels.laws import DRIVE, LANES, RAMP, TO_DRIVE, Rows, law

if TYPE_CHECKING:
    from plant.machine import Machine


@law(TO_DRIVE)
def _clip(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        limit, half = p[j], p[LANES + j]
        size = abs(b[DRIVE + j])
        over = size - limit + half
        if over > 0.0:
            left = limit if over >= 2.0 * half else size - over * over / (4.0 * half)
            b[DRIVE + j] = math.copysign(left, b[DRIVE + j])
            b[RAMP + j] *= 0.0 if over >= 2.0 * half else 1.0 - over / (2.0 * half)


def _prepare(values: Floats, machine: Machine) -> Floats:
    limit, knee = values[0] * abs(machine.surroundings.mechanics.gain), values[1]
    return np.stack([limit, np.multiply(knee, limit, out=np.zeros_like(limit), where=knee > 0.0)])


EFFECT = Effect(
    name="torque_saturation",
    parameters=(
        Parameter("limit", "N*m", (1e-3, 1e3), (0.0, math.inf), absent=math.inf, about="F_max as torque"),
        Parameter("knee", "1", (0.0, 1.0), (0.0, 1.0), default=0.0, reported=False, about="κ: of a shoulder"),
    ),
    laws=(_clip,),
    order=10,
    prepare=_prepare,
    source="drive current limit; magnetic saturation",
)
