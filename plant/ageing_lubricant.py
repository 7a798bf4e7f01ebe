"""What happens to the lubricant: it is lost, changed, renewed; the Stribeck curve shifts."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import ClassVar

from plant.ageing import DAY, Condition, Moment, need


@dataclass(frozen=True, slots=True)
class Relubrication:
    """Fresh lubricant on given days: the loss of lubricant starts anew.

    Attributes:
        days: since the start. [d]
    """

    kind: ClassVar[str] = "relubrication"
    rank: ClassVar[int] = 0
    days: tuple[float, ...]

    def age(self, condition: Condition, moment: Moment) -> Condition:
        """Note the latest of the days that has passed."""
        done = [day * DAY for day in self.days if day * DAY <= moment.time]
        return dataclasses.replace(condition, lubricated_at=max([condition.lubricated_at, *done]))


@dataclass(frozen=True, slots=True)
class LubricantChange:
    """Another lubricant from one day on: F_v times the ratio of viscosities, v_s divided by it.

    Attributes:
        day: [d]
        viscosity_ratio: new to old. [1] > 0
        coulomb_ratio: new to old boundary friction. [1] > 0
    """

    kind: ClassVar[str] = "lubricant_change"
    rank: ClassVar[int] = 30
    day: float
    viscosity_ratio: float
    coulomb_ratio: float = 1.0

    def __post_init__(self) -> None:
        """Check ranges."""
        for name in ("viscosity_ratio", "coulomb_ratio"):
            need(self.kind, name, getattr(self, name), getattr(self, name) > 0, "> 0", "1")

    def age(self, condition: Condition, moment: Moment) -> Condition:
        """Scale from the day on."""
        if moment.time < self.day * DAY:
            return condition
        return condition.scaled(
            self.coulomb_ratio, self.coulomb_ratio, stribeck=1.0 / self.viscosity_ratio, viscous=self.viscosity_ratio
        )


@dataclass(frozen=True, slots=True)
class LubricantLoss:
    """The film starves: the Stribeck curve shifts to higher speeds, boundary friction rises, viscous drag falls.

    Starvation runs as 1 - exp(-age/time constant) from the onset, or from the last relubrication where that is later.

    Attributes:
        onset_day: [d]
        time_constant: [d] > 0
        coulomb_rise: relative, at full starvation. [1]
        static_rise: [1]
        stribeck_rise: [1]
        viscous_rise: negative: less film to shear. [1] > -1
    """

    kind: ClassVar[str] = "lubricant_loss"
    rank: ClassVar[int] = 50
    onset_day: float = 0.0
    time_constant: float = 90.0
    coulomb_rise: float = 0.15
    static_rise: float = 0.6
    stribeck_rise: float = 1.0
    viscous_rise: float = -0.3

    def __post_init__(self) -> None:
        """Check ranges."""
        need(self.kind, "time_constant", self.time_constant, self.time_constant > 0, "> 0", "d")
        for name in ("coulomb_rise", "static_rise", "stribeck_rise", "viscous_rise"):
            need(self.kind, name, getattr(self, name), getattr(self, name) > -1, "> -1", "1")

    def age(self, condition: Condition, moment: Moment) -> Condition:
        """Scale by the starvation reached."""
        days = (moment.time - max(self.onset_day * DAY, condition.lubricated_at)) / DAY
        starved = -math.expm1(-max(days, 0.0) / self.time_constant)
        return condition.scaled(
            1 + self.coulomb_rise * starved,
            1 + self.static_rise * starved,
            1 + self.stribeck_rise * starved,
            1 + self.viscous_rise * starved,
        )
