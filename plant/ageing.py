"""How an axis changes over months: frozen stages that compose into the condition of the axis at one moment.

Every stage is a pure function of the moment (time since the start, distance travelled, time of day), so any day can be
asked for without living through the days before it. Stages act in the order of their `rank`, whatever order they are
listed in: maintenance, temperature, viscosity, load, lubricant, wear, damage, and chance last.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np

from plant.errors import ParameterError
from plant.friction import StribeckFriction

DAY = 86400.0  # s
WANDER_LINES = 24  # cosines that imitate a slow random process; its distribution is near Gaussian from about ten on

EffectValues = tuple[str, Mapping[str, float]]


@dataclass(frozen=True, slots=True)
class Moment:
    """When an axis is looked at.

    Attributes:
        time: since the start of the scenario. [s]
        travelled: distance since the start. [m]
        time_of_day: since midnight. [s]
        seed: of everything that happens by chance.
    """

    time: float
    travelled: float = 0.0
    time_of_day: float = 0.0
    seed: int = 0


@dataclass(frozen=True, slots=True)
class Condition:
    """What the months have done to an axis; the default is the axis as delivered.

    Attributes:
        coulomb: factor on F_c. [1]
        static: factor on F_s. [1]
        stribeck: factor on v_s. [1]
        viscous: factor on F_v. [1]
        dry_force: added to F_c and F_s. [N]
        temperature: of guide and lubricant. [degC]
        load: payload carried on top of the axis' own mass. [kg]
        lubricated_at: time of the last lubrication; minus infinity before the first. [s]
        effects: named effects that have appeared, with their parameters (effects.md).
    """

    coulomb: float = 1.0
    static: float = 1.0
    stribeck: float = 1.0
    viscous: float = 1.0
    dry_force: float = 0.0
    temperature: float = 20.0
    load: float = 0.0
    lubricated_at: float = -math.inf
    effects: tuple[EffectValues, ...] = ()

    def scaled(
        self, coulomb: float = 1.0, static: float = 1.0, stribeck: float = 1.0, viscous: float = 1.0
    ) -> Condition:
        """Return the condition with its factors multiplied by these. [1]"""
        return dataclasses.replace(
            self,
            coulomb=self.coulomb * coulomb,
            static=self.static * static,
            stribeck=self.stribeck * stribeck,
            viscous=self.viscous * viscous,
        )

    def friction(self, new: StribeckFriction) -> StribeckFriction:
        """Friction law in this condition of an axis that was `new`; no parameter falls below 0."""
        return StribeckFriction(
            coulomb_force=max(new.coulomb_force * self.coulomb + self.dry_force, 0.0),
            static_force=max(new.static_force * self.static + self.dry_force, 0.0),
            stribeck_velocity=new.stribeck_velocity * self.stribeck,
            viscous_coefficient=new.viscous_coefficient * self.viscous,
        )


class Stage(Protocol):
    """One cause of change."""

    kind: ClassVar[str]
    rank: ClassVar[int]

    def age(self, condition: Condition, moment: Moment) -> Condition:
        """Condition after this cause has acted until `moment`."""
        ...


@dataclass(frozen=True, slots=True)
class Ageing:
    """Several causes together."""

    stages: tuple[Stage, ...] = ()

    def condition(self, moment: Moment) -> Condition:
        """Condition of the axis at `moment`: the stages in the order of their rank."""
        condition = Condition()
        for stage in sorted(self.stages, key=lambda stage: stage.rank):
            condition = stage.age(condition, moment)
        return condition


def wander(time: float, correlation_time: float, *seed: int) -> float:
    """Slow random process of unit variance at `time` [s]: random phases and frequencies (Rahimi & Recht 2007). [1]"""
    rng = np.random.default_rng(seed)
    rates = rng.standard_normal(WANDER_LINES) / correlation_time
    phases = rng.uniform(0.0, 2 * math.pi, WANDER_LINES)
    return float(math.sqrt(2.0 / WANDER_LINES) * np.cos(rates * time + phases).sum())


def need(kind: str, name: str, value: float, allowed: bool, words: str, unit: str) -> None:
    """Raise a ParameterError for `name` of stage `kind` unless `value` is finite and `allowed`."""
    if not (math.isfinite(value) and allowed):
        raise ParameterError(f"{kind}: {name}", value, words, unit)
