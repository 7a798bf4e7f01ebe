"""Years of one axis at the level of estimates: truth from the plant's ageing, errors from the pool of real answers."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from monitor.estimate import Curve, Estimate, Parameter
from monitor.samples import Window, WindowId
from plant.friction import StribeckFriction
from plant.presets import paper_friction
from tests.monitor.studies.pool import FAMILIES, POOL

DAY_NS = 86_400 * 10**9
GRAVITY = 9.81


class Pool:
    """Real answers by family, those with and those without a payload apart."""

    def __init__(self, path: Path = POOL) -> None:
        with np.load(path) as stored:
            self.rows = {name: stored[name] for name in stored.files}
        self._by = {
            (family, loaded): np.flatnonzero(
                (self.rows["family"] == family) & self.rows["identified"] & ((self.rows["load"] > 0) == loaded)
            )
            for family in range(len(FAMILIES))
            for loaded in (False, True)
        }

    def __len__(self) -> int:
        return len(self.rows["seed"])

    def draw(self, family: int, loaded: bool, rng: np.random.Generator) -> int:
        return int(rng.choice(self._by[family, loaded]))


@dataclass(frozen=True)
class Axis:
    """One healthy axis with its habits.

    Attributes:
        family: of the pool.
        every_hours: from window to window. [h]
        scatter: run-to-run standard deviation of dry and viscous friction. [1]
        wandering: standard deviation of slow factors, turning over in five days. [1]
        daily, yearly, weather, warmth: of the temperature. [K]
        load: payload of half of the windows, reported. [kg]
    """

    family: int
    seed: int
    every_hours: float = 12.0
    scatter: float = 0.012
    wandering: float = 0.0
    daily: float = 1.5
    yearly: float = 4.0
    weather: float = 1.0
    warmth: float = 4.0
    load: float = 0.0

    @classmethod
    def at_random(cls, seed: int) -> Axis:
        rng = np.random.default_rng([77, seed])
        return cls(
            family=seed % len(FAMILIES), seed=seed, every_hours=float(rng.choice([12.0, 24.0])),
            scatter=float(rng.uniform(0.005, 0.025)), wandering=float(rng.choice([0.0, 0.005, 0.01])),
            daily=float(rng.uniform(0, 3)), yearly=float(rng.uniform(0, 6)), weather=float(rng.uniform(0.3, 2)),
            warmth=float(rng.uniform(0, 6)), load=float(rng.choice([0.0, 0.0, 2.0])),
        )  # fmt: skip

    @cached_property
    def law(self) -> StribeckFriction:
        return paper_friction(FAMILIES[self.family].preset)

    def __hash__(self) -> int:
        return hash((self.family, self.seed))


def slow(n: int, step_days: float, days: float, rng: np.random.Generator) -> np.ndarray:
    """A slow random process of unit variance, sampled n times."""
    rates, phases = rng.standard_normal(32) / days, rng.uniform(0, 2 * np.pi, 32)
    t = step_days * np.arange(n)
    return np.sqrt(2 / 32) * np.cos(rates[:, None] * t + phases[:, None]).sum(axis=0)


Change = Callable[[float], dict[str, float]]  # day -> factors on coulomb, static, viscous


def nothing(_day: float) -> dict[str, float]:
    return {}


def estimates(axis: Axis, pool: Pool, windows: int, change: Change = nothing) -> Iterator[Estimate]:
    """Window after window of `axis`, healthy but for `change`."""
    rng = np.random.default_rng([5, axis.seed])
    step = axis.every_hours / 24
    day = step * np.arange(windows)
    hours = (6.0 + rng.uniform(0, 3, windows) + axis.every_hours * np.arange(windows)) % 24
    working = (hours > 6) & (hours < 22)
    temperature = 21 + axis.daily * np.cos(2 * np.pi * (hours - 15) / 24) + axis.weather * slow(windows, step, 2, rng)
    temperature += axis.yearly * np.cos(2 * np.pi * (day - 180) / 365.25) + axis.warmth * working * rng.random(windows)
    wander = axis.wandering * slow(windows, step, 5.0, rng)
    chance = rng.standard_normal((windows, 4)) * np.array([1, 1, 1.5, 1]) * axis.scatter
    loads = np.where(rng.random(windows) < 0.5, axis.load, 0.0)
    vertical = not FAMILIES[axis.family].horizontal
    for k in range(windows):
        thickness = float(np.exp(-0.025 * (temperature[k] - 21)))
        factors = {"coulomb": 1.0, "static": 1.0, "viscous": 1.0, "stribeck": 1.0, "scale": 1.0} | change(float(day[k]))
        dry = 1.5 * loads[k]
        law = dataclasses.replace(
            axis.law,
            coulomb_force=axis.law.coulomb_force * np.exp(chance[k, 0] + wander[k]) * factors["coulomb"] + dry,
            static_force=axis.law.static_force * np.exp(chance[k, 1] + wander[k]) * factors["static"] + dry,
            stribeck_velocity=axis.law.stribeck_velocity * np.exp(chance[k, 2]) / thickness * factors["stribeck"],
            viscous_coefficient=axis.law.viscous_coefficient * np.exp(chance[k, 3]) * thickness * factors["viscous"],
        )
        row = pool.draw(axis.family, bool(loads[k]), rng)
        conditions = {"temperature": float(temperature[k]), "load": float(loads[k])}
        yield answer(pool, row, law, k, round(k * step * DAY_NS), conditions, vertical)


def answer(
    pool: Pool,
    row: int,
    law: StribeckFriction,
    number: int,
    start_ns: int,
    conditions: dict[str, float],
    vertical: bool,
) -> Estimate:
    """What identification would say of `law`, with the errors it made in `row` of the pool."""
    rows = pool.rows
    told = np.isfinite(rows["speed"][row])
    speeds = rows["speed"][row][told]
    relative = rows["value"][row][told] / rows["truth"][row][told]
    force = law.force(speeds) * relative
    half = force * rows["half"][row][told] / rows["value"][row][told]
    curve = Curve(*(tuple(one.tolist()) for one in (speeds, force, force - half, force + half)),
                  float(rows["fastest"][row]))  # fmt: skip
    weight = GRAVITY * (conditions["load"] - rows["load"][row]) if vertical else 0.0
    parameters = [Parameter("stribeck_velocity", law.stribeck_velocity, "m/s", 0.0, 1.0)]
    for name, unit, shift in (("constant", "N", weight), ("mass", "kg", 0.0)):
        value, spread = rows[name][row] + shift, rows[f"{name}_half"][row]
        if np.isfinite(spread):
            key = {"constant": "constant_force", "mass": "moving_mass"}[name]
            parameters.append(Parameter(key, float(value), unit, float(value - spread), float(value + spread)))
    return Estimate(
        Window(WindowId(1, 2000 * number, 2000), start_ns, start_ns + 20 * 10**9), "identified", None, "ga+polish", 0,
        "study", "", {}, parameters=tuple(parameters), curve=curve,
        conditions={**conditions, "latent_force": float(rows["latent"][row])},
    )  # fmt: skip
