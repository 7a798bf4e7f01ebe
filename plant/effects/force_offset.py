"""force_offset: + F_0, a constant force on the friction side (tilt, gravity or mass error, drive or sensor offset)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant.effects.effect import Effect, Floats, Parameter

if TYPE_CHECKING:
    from plant.machine import Machine


def _prepare(values: Floats, machine: Machine) -> Floats:
    machine.against = machine.against + values[0]
    return values[:0]


EFFECT = Effect(
    name="force_offset",
    parameters=(Parameter("force", "N", (-200.0, 200.0), absent=0.0, about="F_0, against the motion upwards"),),
    prepare=_prepare,
    source="textbook",
)
