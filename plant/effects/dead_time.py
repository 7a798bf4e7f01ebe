"""dead_time: F(t) = F_d(t - t_d); the input is shifted before the march, jumps and all (`plant/kernels/shift.py`)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant.effects.effect import Effect, Floats, Parameter

if TYPE_CHECKING:
    from plant.machine import Machine


def _prepare(values: Floats, machine: Machine) -> Floats:
    machine.delay = machine.delay + values[0]
    return values[:0]


EFFECT = Effect(
    name="dead_time",
    parameters=(Parameter("delay", "s", (0.0, 0.2), (0.0, 100.0), absent=0.0, about="t_d"),),
    prepare=_prepare,
    source="Ljung 1999",
)
