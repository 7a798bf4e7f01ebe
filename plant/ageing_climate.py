"""Causes that come and go: weather, the warmth of the shift, thinning lubricant, payload."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import ClassVar

from plant.ageing import DAY, Condition, Moment, need, wander

HOUR = 3600.0  # s
YEAR = 365.25 * DAY  # s


@dataclass(frozen=True, slots=True)
class Ambient:
    """Temperature of hall and weather: yearly and daily cosine plus slow chance.

    Attributes:
        mean: [degC]
        daily: amplitude, warmest at 15:00. [K]
        yearly: amplitude, warmest `warmest_day` days after the start. [K]
        warmest_day: [d]
        weather: standard deviation of the chance, which turns over in about four days. [K]
        seed: tells several sources of chance apart.
    """

    kind: ClassVar[str] = "ambient"
    rank: ClassVar[int] = 10
    mean: float = 20.0
    daily: float = 0.0
    yearly: float = 0.0
    warmest_day: float = 180.0
    weather: float = 0.0
    seed: int = 0

    def age(self, condition: Condition, moment: Moment) -> Condition:
        """Set the temperature of the day."""
        temperature = self.mean + self.daily * math.cos(2 * math.pi * (moment.time_of_day - 15 * HOUR) / DAY)
        temperature += self.yearly * math.cos(2 * math.pi * (moment.time - self.warmest_day * DAY) / YEAR)
        if self.weather:
            temperature += self.weather * wander(moment.time, 2 * DAY, moment.seed, self.seed)
        return dataclasses.replace(condition, temperature=temperature)


@dataclass(frozen=True, slots=True)
class WarmUp:
    """The machine warms itself while it works and cools overnight, both with one time constant.

    Attributes:
        rise: final. [K]
        time_constant: [s] > 0
        shift_start: time of day. [h]
        shift_hours: 0 < hours <= 24. [h]
    """

    kind: ClassVar[str] = "warm_up"
    rank: ClassVar[int] = 20
    rise: float
    time_constant: float = 3600.0
    shift_start: float = 6.0
    shift_hours: float = 16.0

    def __post_init__(self) -> None:
        """Check ranges."""
        need(self.kind, "time_constant", self.time_constant, self.time_constant > 0, "> 0", "s")
        need(self.kind, "shift_hours", self.shift_hours, 0 < self.shift_hours <= 24, "in 0..24", "h")

    def age(self, condition: Condition, moment: Moment) -> Condition:
        """Add the warmth of the shift; what the night leaves over from the day before counts as cold."""
        running = (moment.time_of_day - self.shift_start * HOUR) % DAY
        worked = min(running, self.shift_hours * HOUR)
        warmth = -math.expm1(-worked / self.time_constant) * math.exp(-(running - worked) / self.time_constant)
        return dataclasses.replace(condition, temperature=condition.temperature + self.rise * warmth)


@dataclass(frozen=True, slots=True)
class Viscosity:
    """The lubricant thins with temperature: F_v ~ eta, v_s ~ 1/eta, eta = exp(-b (T - T_0)) (Simoni et al. 2015).

    Attributes:
        per_kelvin: b. [1/K] >= 0, about 0.02-0.04 for greases and guideway oils near room temperature
        reference: T_0, where the axis' friction law holds. [degC]
    """

    kind: ClassVar[str] = "viscosity"
    rank: ClassVar[int] = 30
    per_kelvin: float = 0.025
    reference: float = 20.0

    def age(self, condition: Condition, moment: Moment) -> Condition:  # noqa: ARG002
        """Scale by the viscosity at the condition's temperature."""
        thickness = math.exp(-self.per_kelvin * (condition.temperature - self.reference))
        return condition.scaled(stribeck=1.0 / thickness, viscous=thickness)


@dataclass(frozen=True, slots=True)
class Load:
    """A payload during some days; it loads the guide as well.

    Attributes:
        mass: [kg]
        from_day: [d]
        to_day: [d]
        friction_per_kilogram: dry friction that the payload adds. [N/kg]
    """

    kind: ClassVar[str] = "load"
    rank: ClassVar[int] = 40
    mass: float
    from_day: float = 0.0
    to_day: float = 1e9
    friction_per_kilogram: float = 0.0

    def age(self, condition: Condition, moment: Moment) -> Condition:
        """Add the payload while it is on."""
        if not self.from_day * DAY <= moment.time < self.to_day * DAY:
            return condition
        dry = condition.dry_force + self.friction_per_kilogram * self.mass
        return dataclasses.replace(condition, load=condition.load + self.mass, dry_force=dry)
