"""What an identified model makes of a window: free runs of one second each, for evidence. Pure."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from monitor.estimate import Estimate
from monitor.identify_window import recording_of
from monitor.samples import Samples
from plant.axis import Axis
from plant.friction import StribeckFriction
from plant.recording import Floats
from plant.simulation import simulate

RUN_SECONDS = 1.0  # s, as eq. (4) is judged (identify/criterion.py)
AROUND = 3  # samples on either side for the speed at which a run starts
LAW = ("coulomb_force", "static_force", "stribeck_velocity", "viscous_coefficient")


@dataclass(frozen=True, slots=True)
class FitSamples:
    """Position of the model at every sample; NaN where it could not run. [m or rad]"""

    position: Floats


def fit_of(samples: Samples, axis: Axis, estimate: Estimate) -> FitSamples | None:
    """March the identified law over the window; None where nothing was identified."""
    values = {one.name: one.value for one in estimate.parameters}
    if estimate.verdict != "identified" or not all(name in values for name in LAW):
        return None
    recording = recording_of(samples, axis)
    effects: dict[str, dict[str, float]] = {}
    for name, value in values.items():
        if "." in name:  # of a promoted effect: rail_defect.amplitude
            effect, parameter = name.split(".", 1)
            effects.setdefault(effect, {})[parameter] = value
    law = StribeckFriction(*(max(values[name], 1e-12) for name in LAW))
    position = np.full(len(recording), np.nan)
    usable = np.isfinite(recording.force) & np.isfinite(recording.position)
    edges = [0, *np.flatnonzero(np.diff(np.floor(recording.t / RUN_SECONDS)) > 0) + 1, len(recording)]
    for first, end in itertools.pairwise(edges):
        part = slice(first, end)
        if end - first < 2 or not usable[part].all():
            continue
        around = slice(max(0, first - AROUND), first + AROUND + 1)
        t, y = recording.t[around], recording.position[around]
        known = np.isfinite(y)
        speed = float(np.polyfit(t[known] - recording.t[first], y[known], 1)[0]) if known.sum() > 1 else 0.0
        position[part] = simulate(
            axis,
            law,
            recording.force[part] / axis.mechanics.gain,
            t=recording.t[part],
            hold=recording.hold,
            effects=effects,
            constant_force=values.get("constant_force", 0.0),
            moving_mass=values.get("moving_mass"),
            position0=float(recording.position[first]),
            velocity0=speed,
            substeps=2,
        ).position
    return FitSamples(position)
