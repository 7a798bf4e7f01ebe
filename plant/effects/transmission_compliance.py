"""transmission_compliance: two masses, J/R_c² at the motor and M at the load, belt of stiffness k_b and damping d_b.

m_m y_m'' = F_d - T, M y'' = T - M g - F_f, T = k_b (y_m - y) + d_b (y_m' - y'). Rigid (absent) is k_b = inf.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from plant.effects.effect import Effect, Floats, Parameter

if TYPE_CHECKING:
    from plant.machine import Machine


def _prepare(values: Floats, machine: Machine) -> Floats:
    machine.split("transmission_compliance")
    machine.stiffness, machine.damping = values[0], values[1]
    return values[:0]


def _rate(values: Floats, machine: Machine, speed: float) -> Floats:  # noqa: ARG001
    rate: Floats = np.sqrt(values[0] / machine.reduced_mass())
    return rate


EFFECT = Effect(
    name="transmission_compliance",
    parameters=(
        Parameter("stiffness", "N/m", (1e3, 1e6), (1.0, math.inf), absent=math.inf, about="k_b"),
        Parameter("damping", "N*s/m", (0.0, 1e4), (0.0, 1e6), default=0.0, about="d_b"),
    ),
    prepare=_prepare,
    rate=_rate,
    source="Ellis, Control System Design Guide",
)
