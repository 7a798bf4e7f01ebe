"""How much is left of what a named effect's own curve could take, if it were free to bend.

The catalogue knows the shapes of its effects imperfectly: a drive's limit has a knee, warmth is no exponential. What is
left of such a curve beside the effect looks like another one.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from identify.mismatch.compare import Fit
from identify.mismatch.locate import coordinates
from identify.mismatch.probes import View, shape_of
from identify.mismatch.shapes import hats

Floats = NDArray[np.float64]

KNOTS = 14  # along the coordinate of an effect
SIDES: dict[str, tuple[str, tuple[Callable[[dict[str, Floats]], Floats], ...]]] = {
    "thermal_drift": ("time", (lambda c: c["velocity"], lambda c: c["direction"])),
    "torque_saturation": ("torque", (lambda c: np.ones_like(c["torque"]),)),
    "load_dependent_friction": ("torque", (lambda c: c["direction"],)),
    "quadratic_drag": ("speed", (lambda c: c["direction"],)),
    "viscous_asymmetry": ("speed", (lambda c: np.abs(c["direction"]),)),
    "coulomb_asymmetry": ("speed", (lambda c: np.abs(c["direction"]),)),
    "presliding_hysteresis": ("distance_since_reversal", (lambda c: c["direction"],)),
}


def bend(fitted: Fit, name: str) -> float:
    """Evidence for a free curve along the coordinate of the effect `name` in a model that holds it; 0 for others."""
    if name not in SIDES:
        return 0.0
    coordinate, sides = SIDES[name]
    view = View.of(fitted, fitted.found.gain)
    known = coordinates(view.foreseen(), fitted.problem.axis)
    known["speed"] = np.abs(known["velocity"])
    x = known[coordinate]
    knots = np.unique(np.quantile(x, np.linspace(0.003, 0.997, KNOTS)))
    if len(knots) < 4:
        return 0.0
    forces = np.concatenate([hats(x, knots) * side(known)[:, None] for side in sides], axis=1)
    size = np.abs(forces).max(axis=0)
    return shape_of(view, view.responses(forces / np.where(size > 0.0, size, 1.0))).evidence
