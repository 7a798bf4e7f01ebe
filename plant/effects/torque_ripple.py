"""torque_ripple: + A cos(n θ + φ) with θ = y/R_m the motor angle, period 2π R_m/n; or the same times the torque.

Acts at the motor. With `relative_amplitude` a the friction side gains a F_d cos(n θ + φ).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from plant.axis import Mechanics
from plant.effects.effect import Effect, Floats, Parameter
from plant.kernels.cosine import cos_turns
from plant.kernels.laws import DRIVE, LANES, MOTOR_FORCE, MOTOR_MIDDLE, TO_DRIVE, Rows, law

if TYPE_CHECKING:
    from plant.machine import Machine

TURN = 0.5 / math.pi


@law(TO_DRIVE)
def _ripple(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        wave = cos_turns(b[MOTOR_MIDDLE + j] / p[j] + TURN * p[3 * LANES + j])
        b[MOTOR_FORCE + j] += p[LANES + j] * wave
        b[DRIVE + j] -= p[2 * LANES + j] * wave * b[DRIVE + j]


def _rate(values: Floats, machine: Machine, speed: float) -> Floats:  # noqa: ARG001
    rate: Floats = 2.0 * math.pi * speed / values[0]
    return rate


def _one_turn(mechanics: Mechanics) -> float:
    return 2.0 * math.pi * mechanics.Rm


EFFECT = Effect(
    name="torque_ripple",
    parameters=(
        Parameter("period", "m", (1e-3, 1.0), (1e-6, 1e3), default=_one_turn, about="2π R_m/n"),
        Parameter("amplitude", "N", (0.0, 200.0), absent=0.0, default=0.0, about="A"),
        Parameter("relative_amplitude", "1", (0.0, 0.3), (-1.0, 1.0), absent=0.0, default=0.0, about="A over F_d"),
        Parameter("phase", "rad", (-math.pi, math.pi), default=0.0, reported=False, about="φ"),
    ),
    laws=(_ripple,),
    order=40,
    rate=_rate,
    source="Holtz & Springob 1996",
)
