"""Every way in which the effects of the catalogue, and plug-in effects, may be present in one set of recordings."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from identify.mismatch import ways_drive, ways_memory, ways_place
from identify.mismatch.guise import Guise, Setting, Unknown, grid
from identify.mismatch.own_curves import own_curve
from plant.effects.effect import Effect


def guises(effects: dict[str, Effect], setting: Setting) -> list[Guise]:
    """Every way in which `effects` may be present in recordings of this setting."""
    found: list[Guise] = []
    for name, effect in effects.items():
        make = TAILORED.get(name)
        found += make(effect, setting) if make is not None else [plug_in(effect)]
    return [own_curve(guise, setting) for guise in found]


def plug_in(effect: Effect) -> Guise:
    """A guise from the plausible ranges alone: amplitudes small, everything else at three places of its range."""
    unknowns, axes = [], []
    fixed = []
    for p in effect.parameters:
        low, high = p.plausible
        if p.absent == 0.0:
            unknowns.append(Unknown(p.name, 0.1 * max(abs(low), abs(high)), low, high))
            axes.append([0.05 * (high if high > 0 else low)])
        elif not p.reported and p.default is not None and not callable(p.default):
            fixed.append((p.name, float(p.default)))
        elif low > 0:
            unknowns.append(Unknown(p.name, math.sqrt(low * high), low, high, log=True))
            axes.append(list(np.geomspace(low, high, 5)[1:4]))
        else:
            unknowns.append(Unknown(p.name, 0.25 * (high - low), low, high, origin=0.5 * (low + high)))
            axes.append(list(np.linspace(low, high, 5)[1:4]))
    return Guise(effect, tuple(unknowns), grid(*axes), tuple(fixed))


TAILORED: dict[str, Callable[[Effect, Setting], list[Guise]]] = {
    "force_offset": ways_drive.offset,
    "coulomb_asymmetry": ways_drive.ratio("asymmetry_ratio", 0.1, 0.98, 0.02),
    "viscous_asymmetry": ways_drive.ratio("asymmetry_ratio", 0.2, 0.98, 0.05),
    "position_dependent_friction": ways_place.position_friction,
    "rail_defect": ways_place.defect,
    "presliding_hysteresis": ways_memory.bristles,
    "backlash": ways_memory.backlash,
    "transmission_compliance": ways_memory.compliance,
    "torque_ripple": ways_place.ripple,
    "pulley_eccentricity": ways_place.eccentricity,
    "load_dependent_friction": ways_drive.ratio("coefficient", 0.1, 0.6, 0.02),
    "thermal_drift": ways_memory.thermal,
    "quadratic_drag": ways_drive.drag,
    "position_spring": ways_place.spring,
    "inertia_error": ways_drive.inertia,
    "torque_scale_error": ways_drive.ratio("relative_error", 0.1, 0.5, 0.03, ways_drive.SHEET),
    "actuator_lag": ways_drive.lag("time_constant"),
    "dead_time": ways_drive.lag("delay"),
    "torque_saturation": ways_drive.saturation,
    "dwell_time_stiction": ways_memory.dwell,
    "end_stop": ways_place.end_stop,
    "step_change": ways_memory.step,
}
