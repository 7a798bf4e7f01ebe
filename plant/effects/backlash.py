"""backlash: free travel b between motor and mass; J/R_c² moves alone inside it, contact is a stiff damped spring.

The contact is the belt of transmission_compliance where that is on too; else a spring of CONTACT_RATE, nearly
critically damped, so that the sides meet without bouncing: stiffer contact changes nothing that a position sensor sees.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant.effects.effect import Effect, Floats, Parameter

if TYPE_CHECKING:
    from plant.machine import Machine

CONTACT_RATE = 1000.0  # rad/s: 100 N deflect a contact of 20 kg against 5 kg by 25 µm
CONTACT_DAMPING_RATIO = 0.7


def _prepare(values: Floats, machine: Machine) -> Floats:
    machine.split("backlash")
    machine.half_gap = 0.5 * values[0]
    reduced = machine.reduced_mass()
    alone = machine.stiffness == 0.0
    machine.stiffness = np.where(alone, reduced * CONTACT_RATE**2, machine.stiffness)
    machine.damping = np.where(alone, 2.0 * CONTACT_DAMPING_RATIO * reduced * CONTACT_RATE, machine.damping)
    return values[:0]


def _rate(values: Floats, machine: Machine, speed: float) -> Floats:  # noqa: ARG001
    rate: Floats = np.sqrt(machine.stiffness / machine.reduced_mass())
    return rate


EFFECT = Effect(
    name="backlash",
    parameters=(Parameter("gap", "m", (1e-5, 1e-2), (0.0, 10.0), absent=0.0, about="b, the whole free travel"),),
    order=60,
    prepare=_prepare,
    rate=_rate,
    source="Nordin & Gutman 2002, Automatica 38",
)
