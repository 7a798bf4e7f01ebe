"""What stays until it is repaired, wear, a rail defect, a jam; and friction that does not repeat exactly (§5)."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from plant.ageing import DAY, Condition, Moment, need, wander

KILOMETRE = 1000.0  # m


@dataclass(frozen=True, slots=True)
class Wear:
    """Dry friction rises with the distance travelled, as worn volume does (Archard 1953), up to a limit.

    Attributes:
        per_kilometre: relative rise of F_c and F_s. [1/km]
        onset: distance without wear. [km]
        limit: largest relative rise. [1]
    """

    kind: ClassVar[str] = "wear"
    rank: ClassVar[int] = 60
    per_kilometre: float
    onset: float = 0.0
    limit: float = 1.0

    def age(self, condition: Condition, moment: Moment) -> Condition:
        """Raise F_c and F_s alike."""
        rise = min(max(moment.travelled / KILOMETRE - self.onset, 0.0) * self.per_kilometre, self.limit)
        return condition.scaled(coulomb=1 + rise, static=1 + rise)


@dataclass(frozen=True, slots=True)
class GrowingRailDefect:
    """A spot on the rail that resists, more every day: the effect `rail_defect` with a growing amplitude.

    Attributes:
        centre: [m]
        width: standard deviation. [m]
        newtons_per_day: [N/d]
        onset_day: [d]
        limit: largest amplitude. [N]
    """

    kind: ClassVar[str] = "rail_defect"
    rank: ClassVar[int] = 70
    centre: float
    width: float
    newtons_per_day: float
    onset_day: float = 0.0
    limit: float = 200.0

    def age(self, condition: Condition, moment: Moment) -> Condition:
        """Add the defect once it has an amplitude."""
        days = max(moment.time / DAY - self.onset_day, 0.0)
        amplitude = min(days * self.newtons_per_day, self.limit)
        if amplitude == 0:
            return condition
        defect = ("rail_defect", {"amplitude": amplitude, "centre": self.centre, "width": self.width})
        return dataclasses.replace(condition, effects=(*condition.effects, defect))


@dataclass(frozen=True, slots=True)
class Jam:
    """Something sticks in the guide from one day on, until it is cleared: dry friction steps up.

    Attributes:
        day: [d]
        force: [N]
        cleared_day: [d]
    """

    kind: ClassVar[str] = "jam"
    rank: ClassVar[int] = 70
    day: float
    force: float
    cleared_day: float = 1e9

    def age(self, condition: Condition, moment: Moment) -> Condition:
        """Add the force while it sticks."""
        if not self.day * DAY <= moment.time < self.cleared_day * DAY:
            return condition
        return dataclasses.replace(condition, dry_force=condition.dry_force + self.force)


@dataclass(frozen=True, slots=True)
class Scatter:
    """Friction "not very repetitive" (§5): from run to run by chance, and wandering over days; log-normal factors.

    Attributes:
        coulomb: standard deviation of the run-to-run factor on F_c. [1]
        static: on F_s. [1]
        stribeck: on v_s. [1]
        viscous: on F_v. [1]
        wandering: standard deviation of the slow factor on F_c and F_s. [1]
        wandering_days: over which it turns. [d] > 0
        seed: tells several sources of chance apart.
    """

    kind: ClassVar[str] = "scatter"
    rank: ClassVar[int] = 90
    coulomb: float = 0.0
    static: float = 0.0
    stribeck: float = 0.0
    viscous: float = 0.0
    wandering: float = 0.0
    wandering_days: float = 5.0
    seed: int = 0

    def __post_init__(self) -> None:
        """Check ranges."""
        for name in ("coulomb", "static", "stribeck", "viscous", "wandering"):
            need(self.kind, name, getattr(self, name), getattr(self, name) >= 0, ">= 0", "1")
        need(self.kind, "wandering_days", self.wandering_days, self.wandering_days > 0, "> 0", "d")

    def age(self, condition: Condition, moment: Moment) -> Condition:
        """Scale by the chance that belongs to this moment: the same moment, the same chance."""
        rng = np.random.default_rng([moment.seed, self.seed, round(moment.time * 1e3)])
        chance = rng.standard_normal(4) * (self.coulomb, self.static, self.stribeck, self.viscous)
        if self.wandering:
            chance[:2] += self.wandering * wander(moment.time, self.wandering_days * DAY, moment.seed, self.seed)
        return condition.scaled(*map(float, np.exp(chance)))
