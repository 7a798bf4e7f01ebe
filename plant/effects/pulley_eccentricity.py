"""pulley_eccentricity: effective radius R_c (1 + e cos(y/R_c + φ)), so the force at the belt is F_d/(1 + e cos(...)).

The change of J/R_c² and its speed term are left out: J is a fifth of the moving mass and the drive force dominates.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from plant.axis import Mechanics
from plant.effects.effect import Effect, Floats, Parameter
from plant.kernels.cosine import cos_turns
from plant.kernels.laws import DRIVE, LANES, MOTOR_MIDDLE, TO_DRIVE, Rows, law

if TYPE_CHECKING:
    from plant.machine import Machine

TURN = 0.5 / math.pi


@law(TO_DRIVE)
def _lever(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        b[DRIVE + j] /= 1.0 + p[j] * cos_turns(b[MOTOR_MIDDLE + j] / p[LANES + j] + TURN * p[2 * LANES + j])


def _rate(values: Floats, machine: Machine, speed: float) -> Floats:  # noqa: ARG001
    rate: Floats = 2.0 * math.pi * speed / values[1]
    return rate


def _one_turn(mechanics: Mechanics) -> float:
    return 2.0 * math.pi * mechanics.Rc


EFFECT = Effect(
    name="pulley_eccentricity",
    parameters=(
        Parameter("relative_eccentricity", "1", (0.0, 0.3), (-0.9, 0.9), absent=0.0, about="e"),
        Parameter("period", "m", (1e-3, 10.0), (1e-6, 1e3), default=_one_turn, about="2π R_c"),
        Parameter("phase", "rad", (-math.pi, math.pi), default=0.0, reported=False, about="φ"),
    ),
    laws=(_lever,),
    order=30,
    rate=_rate,
    source="gear and pulley run-out",
)
