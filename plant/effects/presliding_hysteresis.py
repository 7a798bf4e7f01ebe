"""presliding_hysteresis: LuGre, z' = v - σ0 |v| z / g(v), F = σ0 z + σ1 z' + F_v v, g the dry level with |v|.

Replaces the set-valued friction; every effect that changes the dry level changes g. The kernel integrates the bristle
exactly for frozen speed. Rigid (absent) is σ0 = inf.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from plant.effects.effect import Effect, Floats, Parameter

if TYPE_CHECKING:
    from plant.machine import Machine


def _prepare(values: Floats, machine: Machine) -> Floats:
    machine.bristle_stiffness, machine.bristle_damping, machine.bristles = values[0], values[1], True
    return values[:0]


def _rate(values: Floats, machine: Machine, speed: float) -> Floats:  # noqa: ARG001
    rate: Floats = np.sqrt(values[0] / machine.mass)
    return rate


EFFECT = Effect(
    name="presliding_hysteresis",
    parameters=(
        Parameter("bristle_stiffness", "N/m", (1e3, 1e7), (1.0, math.inf), absent=math.inf, about="σ0"),
        Parameter("bristle_damping", "N*s/m", (0.0, 1e4), (0.0, 1e6), default=0.0, about="σ1"),
    ),
    prepare=_prepare,
    rate=_rate,
    source="Canudas de Wit et al. 1995, IEEE TAC 40; Dahl 1968",
)
