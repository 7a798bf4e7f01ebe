"""torque_saturation: F = clip(F_d, ±F_max), the drive's current limit. Unlimited (absent) is inf."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from plant.effects.effect import Effect, Floats, Parameter
from plant.kernels.laws import DRIVE, LANES, TO_DRIVE, Rows, law

if TYPE_CHECKING:
    from plant.machine import Machine


@law(TO_DRIVE)
def _clip(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        b[DRIVE + j] = min(max(b[DRIVE + j], -p[j]), p[j])


def _prepare(values: Floats, machine: Machine) -> Floats:
    force: Floats = values * abs(machine.surroundings.mechanics.gain)
    return force


EFFECT = Effect(
    name="torque_saturation",
    parameters=(Parameter("limit", "N*m", (1e-3, 1e3), (0.0, math.inf), absent=math.inf, about="F_max as torque"),),
    laws=(_clip,),
    order=10,
    prepare=_prepare,
    source="drive current limit",
)
