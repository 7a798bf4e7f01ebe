"""The two clocks of a recording: torque and position may be stamped a little apart, by nobody knows how much.

No physics, and never named: a nuisance with a prior, in the last polish and in its intervals. What it shifts, a dead
time of the same length would shift too; so no time is known better than the clocks are.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from identify.mismatch.guise import CLOCK, Guise, Unknown
from plant.effects.effect import Effect, Parameter

if TYPE_CHECKING:
    from plant.machine import Machine

Floats = NDArray[np.float64]

DOUBT = 0.1  # of the recording's own period: standard deviation of the shift
EARLY = 0.6  # of it: a force logged as held that ran straight between the samples is half a period early


def _prepare(values: Floats, machine: Machine) -> Floats:
    machine.delay = machine.delay + values[0]
    return values[:0]


APART = Effect(
    name="clock",
    parameters=(Parameter("shift", "s", (-0.1, 0.1), absent=0.0, about="torque felt later than its stamp says"),),
    prepare=_prepare,
    source="no physics",
)


def clock(period: float, *, held: bool) -> Guise:
    """The shift in a recording of `period` [s] whose force is taken as `held` until the next sample, or not."""
    unknown = Unknown("shift", period, -(EARLY if held else CLOCK) * period, CLOCK * period, spread=DOUBT)
    return Guise(APART, (unknown,), np.array([[0.0]]))
