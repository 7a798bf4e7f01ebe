"""inertia_error: (m_e + Δm) y'', and Δm g too where the axis is vertical and Δm is payload (`weight_share` 1)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant.axis import Orientation
from plant.effects.effect import Effect, Floats, Parameter
from plant.errors import ParameterError

if TYPE_CHECKING:
    from plant.machine import Machine


def _prepare(values: Floats, machine: Machine) -> Floats:
    mass = machine.mass + values[0]
    if (mass <= 0).any():
        raise ParameterError("inertia_error.mass_error", float(values[0].min()), "above minus the moving mass", "kg")
    machine.mass = mass
    if machine.surroundings.mechanics.orientation is Orientation.VERTICAL:
        machine.against = machine.against + np.prod(values, axis=0) * machine.surroundings.mechanics.g
    return values[:0]


EFFECT = Effect(
    name="inertia_error",
    parameters=(
        Parameter("mass_error", "kg", (-20.0, 20.0), absent=0.0, about="Δm"),
        Parameter("weight_share", "1", (0.0, 1.0), (0.0, 1.0), default=0.0, reported=False, about="1: Δm is payload"),
    ),
    order=70,  # after the transmission has split the mass: what is added is load
    prepare=_prepare,
    source="payload, data sheet",
)
