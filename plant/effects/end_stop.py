"""end_stop: + k (y - y_e) beyond y_e, where beyond is away from the middle of the travel.

With `dissipation` α the force is k (y - y_e) (1 + α v) while it pushes: a bumper that damps (Hunt & Crossley 1975).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numba import njit

from plant.effects.effect import Effect, Floats, Parameter
from plant.kernels.laws import FORCE, LANES, MIDDLE, SPEED, TO_STEP, Rows, law
from plant.kernels.step import FASTMATH

if TYPE_CHECKING:
    from plant.machine import Machine

NO_TRAVEL = 1e-12  # m


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def stop_depth(depth: float, travel: float) -> float:
    """Mean depth in a stop over a sub-step of so much `travel`, `depth` at its middle; it is met inside. [m]."""
    first, last = max(depth - 0.5 * travel, 0.0), max(depth + 0.5 * travel, 0.0)
    return (last + first) * (last - first) / (2.0 * travel) if abs(travel) > NO_TRAVEL else max(depth, 0.0)


@law(TO_STEP)
def _force(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        side = p[3 * LANES + j]
        depth = stop_depth(side * (b[MIDDLE + j] - p[j]), side * h * b[SPEED + j])
        b[FORCE + j] += p[LANES + j] * side * depth * max(1.0 + p[2 * LANES + j] * side * b[SPEED + j], 0.0)


def _prepare(values: Floats, machine: Machine) -> Floats:
    return np.vstack([values, np.where(values[0] >= machine.surroundings.middle, 1.0, -1.0)])


def _rate(values: Floats, machine: Machine, speed: float) -> Floats:  # noqa: ARG001
    rate: Floats = np.sqrt(values[1] / machine.mass)
    return rate


EFFECT = Effect(
    name="end_stop",
    parameters=(
        Parameter("position", "m", (-10.0, 10.0), about="y_e"),
        Parameter("stiffness", "N/m", (1e3, 1e6), (0.0, 1e9), absent=0.0, about="k"),
        Parameter("dissipation", "s/m", (0.0, 10.0), (0.0, 1e6), default=0.0, reported=False, about="α"),
    ),
    laws=(_force,),
    prepare=_prepare,
    rate=_rate,
    source="bumper, hard stop",
)
