"""Static friction law of a guideway, eq. (1) and (2)."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plant.errors import ParameterError


@dataclass(frozen=True, slots=True)
class StribeckFriction:
    """Static friction law of a guideway, eq. (1).

    Uses exp(-|v|/v_s) where eq. (1) prints exp(-v/v_s): the text calls the law symmetric, the printed form is not.
    Units are those of a linear axis; on a rotary axis read N·m, rad/s and N·m·s/rad.

    Attributes:
        coulomb_force: F_c, sliding friction far from rest. [N] >= 0
        static_force: F_s, friction at the edge of motion; below F_c in the paper's own data. [N] >= 0
        stribeck_velocity: v_s, speed over which one turns into the other. [m/s] > 0
        viscous_coefficient: F_v. [N·s/m] >= 0

    Raises:
        ParameterError: a value out of range; names the field, the value, the range and the unit.
    """

    coulomb_force: float
    static_force: float
    stribeck_velocity: float
    viscous_coefficient: float

    def __post_init__(self) -> None:
        """Check every value against its physical range."""
        for field, unit in (("coulomb_force", "N"), ("static_force", "N"), ("viscous_coefficient", "N*s/m")):
            value = getattr(self, field)
            if not (math.isfinite(value) and value >= 0):
                raise ParameterError(field, value, ">= 0", unit)
        if not (math.isfinite(self.stribeck_velocity) and self.stribeck_velocity > 0):
            raise ParameterError("stribeck_velocity", self.stribeck_velocity, "> 0", "m/s")

    @property
    def as_array(self) -> NDArray[np.float64]:
        """F_c, F_s, v_s, F_v as an array of shape (4,)."""
        return np.array(dataclasses.astuple(self), dtype=np.float64)

    def force(self, velocity: ArrayLike) -> NDArray[np.float64]:
        """Friction force [N] at `velocity` [m/s]: same shape, takes the sign of the motion, 0 at rest."""
        v = np.asarray(velocity, dtype=np.float64)
        bump = (self.static_force - self.coulomb_force) * np.exp(-np.abs(v) / self.stribeck_velocity)
        return (self.coulomb_force + bump) * np.sign(v) + self.viscous_coefficient * v
