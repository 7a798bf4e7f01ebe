"""backlash: free travel b between motor and mass; J/R_c² moves alone inside it, contact pushes and cannot pull.

The contact is the belt of transmission_compliance where that is on too; else a hard one of CONTACT_RATE, critically
damped: the sides meet without bouncing. The kernel softens it where the sub-step could not follow.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant.effects.effect import Effect, Floats, Parameter

if TYPE_CHECKING:
    from plant.machine import Machine

CONTACT_RATE = 4000.0  # rad/s: 100 N deflect the contact of 20 kg and 5 kg by 1.6 µm
CONTACT_DAMPING_RATIO = 1.0


def _prepare(values: Floats, machine: Machine) -> Floats:
    machine.split("backlash")
    machine.half_gap = 0.5 * values[0]
    reduced = machine.reduced_mass()
    alone = machine.stiffness == 0.0
    machine.stiffness = np.where(alone, reduced * CONTACT_RATE**2, machine.stiffness)
    machine.damping = np.where(alone, 2.0 * CONTACT_DAMPING_RATIO * reduced * CONTACT_RATE, machine.damping)
    return values[:0]


EFFECT = Effect(
    name="backlash",
    parameters=(Parameter("gap", "m", (1e-5, 1e-2), (0.0, 10.0), absent=0.0, about="b, the whole free travel"),),
    order=60,
    prepare=_prepare,
    source="Nordin & Gutman 2002, Automatica 38",
)
