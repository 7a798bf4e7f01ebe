"""What an identified friction law predicts one second ahead: the picture beside the criterion of eq. (4)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.criterion import restarted
from identify.preprocess import prepare
from identify.result import IdentificationResult
from plant.axis import Axis, TorqueHold
from plant.errors import InputError
from plant.friction import StribeckFriction
from plant.recording import Recording
from plant.simulation import simulate

Floats = NDArray[np.float64]
LAW = ("coulomb_force", "static_force", "stribeck_velocity", "viscous_coefficient")


@dataclass(frozen=True, slots=True, eq=False)
class Ahead:
    """Free runs of one second from the measured state; a new run begins where `run` changes.

    Attributes:
        t: [s] (n,)
        run: index of the free run. (n,)
        position: measured. [m or rad] (n,)
        error: measured minus predicted position. [m or rad] (n,)
    """

    t: Floats
    run: NDArray[np.int64]
    position: Floats
    error: Floats


def one_second_ahead(recording: Recording, axis: Axis, result: IdentificationResult) -> Ahead | None:
    """March the identified law over `recording`, one second at a time; None where it holds no whole law."""
    found = {name: one.value for name, one in result.parameters.items()}
    if not all(name in found for name in LAW) or any("." in name for name in found):
        return None
    samples, states = restarted(prepare(recording, axis))
    law = StribeckFriction(*(found[name] for name in LAW))
    hold = TorqueHold.LINEAR if samples.linear else TorqueHold.HOLD
    error = np.full(len(samples), np.nan)
    for number, (position, velocity) in enumerate(states):
        mine = np.flatnonzero(samples.run == number)
        if len(mine) < 2:
            continue
        try:
            marched = simulate(
                axis,
                law,
                samples.force[mine] / axis.mechanics.gain,
                t=samples.t[mine],
                hold=hold,
                constant_force=found.get("constant_force", 0.0),
                moving_mass=found.get("moving_mass"),
                position0=float(position),
                velocity0=float(velocity),
            )
        except InputError:  # a value at its bound that the front door refuses: no picture of this run
            continue
        error[mine] = samples.position[mine] - marched.position
    return Ahead(samples.t, samples.run, samples.position, error)
