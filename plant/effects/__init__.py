"""Named effects, one file each; others join through the entry point group `tribowatch.effects` (docs/effects.md)."""

from __future__ import annotations

import difflib
import importlib
from collections.abc import Mapping, Sequence
from functools import lru_cache
from importlib.metadata import entry_points

from plant.effects.effect import Effect, Parameter, Surroundings
from plant.errors import InputError

GROUP = "tribowatch.effects"

CATALOGUE = (
    "force_offset",
    "coulomb_asymmetry",
    "viscous_asymmetry",
    "position_dependent_friction",
    "rail_defect",
    "presliding_hysteresis",
    "backlash",
    "transmission_compliance",
    "torque_ripple",
    "pulley_eccentricity",
    "load_dependent_friction",
    "thermal_drift",
    "quadratic_drag",
    "position_spring",
    "inertia_error",
    "torque_scale_error",
    "actuator_lag",
    "dead_time",
    "torque_saturation",
    "dwell_time_stiction",
    "end_stop",
    "step_change",
)

EffectValues = Mapping[str, Mapping[str, float]]
__all__ = ["CATALOGUE", "GROUP", "Effect", "EffectValues", "Parameter", "Surroundings", "find", "find_all", "names"]


def names() -> tuple[str, ...]:
    """The catalogue in the order of effects.md, then the plug-ins by name."""
    return CATALOGUE + tuple(sorted({point.name for point in entry_points(group=GROUP)} - set(CATALOGUE)))


@lru_cache(maxsize=256)
def find(name: str) -> Effect:
    """The effect called `name`.

    Raises:
        InputError: no such effect; names the nearest one. Or a plug-in that is not an `Effect` of that name.
    """
    if name in CATALOGUE:
        effect = importlib.import_module(f"plant.effects.{name}").EFFECT
    else:
        point = next((point for point in entry_points(group=GROUP) if point.name == name), None)
        if point is None:
            near = difflib.get_close_matches(name, names(), 1)
            raise InputError(f"no effect is called {name}{f': did you mean {near[0]}?' if near else ''}")
        effect = point.load()
    if not isinstance(effect, Effect) or effect.name != name:
        raise InputError(f"the plug-in {name} of entry point group {GROUP} is not an Effect called {name}")
    return effect


def find_all(wanted: Sequence[str]) -> tuple[Effect, ...]:
    """The effects called `wanted`, in the order in which their laws run."""
    return tuple(sorted((find(name) for name in wanted), key=lambda effect: (effect.order, effect.name)))
