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
WEIGHT = 196.2  # N, of the paper's axis


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
        rows = self._by[family, loaded]
        return int(rows[rng.integers(len(rows))])

    def alike(self, family: int, load: float, rng: np.random.Generator, nearest: int) -> int:
        """One of the windows whose payload [kg] is most like `load`; where that is none, any without one."""
        if not load:
            return self.draw(family, False, rng)
        rows = self._by[family, True]
        return int(rng.choice(rows[np.argsort(np.abs(self.rows["load"][rows] - load))[:nearest]]))


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
        tells: its temperature.
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
    tells: bool = True

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


Change = Callable[[float], dict[str, float]]  # day -> factors on coulomb, static, viscous; latent, scale, offset (N)


def nothing(_day: float) -> dict[str, float]:
    return {}


class Life:
    """Everything that chance does to `axis`, drawn once: the same windows with and without a change."""

    def __init__(self, axis: Axis, pool: Pool, windows: int) -> None:
        self.axis, self.pool, self.windows = axis, pool, windows
        rng = np.random.default_rng([5, axis.seed])
        step = axis.every_hours / 24
        self.day = step * np.arange(windows)
        hours = (6.0 + rng.uniform(0, 3, windows) + axis.every_hours * np.arange(windows)) % 24
        working = (hours > 6) & (hours < 22)
        weather = axis.weather * slow(windows, step, 2, rng)
        temperature = 21 + axis.daily * np.cos(2 * np.pi * (hours - 15) / 24) + weather
        temperature += axis.yearly * np.cos(2 * np.pi * (self.day - 180) / 365.25)
        self.temperature = temperature + axis.warmth * working * rng.random(windows)
        wander = axis.wandering * slow(windows, step, 5.0, rng)
        chance = rng.standard_normal((windows, 4)) * np.array([1, 1, 1.5, 1]) * axis.scatter
        chance[:, :2] += wander[:, None]
        self.chance = np.exp(chance)
        self.load = np.where(rng.random(windows) < 0.5, axis.load, 0.0)
        self.row = np.array([pool.draw(axis.family, bool(load), rng) for load in self.load])
        self.vertical = not FAMILIES[axis.family].horizontal

    def __getitem__(self, k: int) -> Estimate:
        return self.at(k, {})

    def at(self, k: int, change: dict[str, float]) -> Estimate:
        """Window `k` with factors on the law."""
        thickness = float(np.exp(-0.025 * (self.temperature[k] - 21)))
        coulomb, static, stribeck, viscous = self.chance[k]
        dry, law = 1.5 * self.load[k], self.axis.law
        law = dataclasses.replace(
            law,
            coulomb_force=law.coulomb_force * coulomb * change.get("coulomb", 1.0) + dry,
            static_force=law.static_force * static * change.get("static", 1.0) + dry,
            stribeck_velocity=law.stribeck_velocity * stribeck / thickness * change.get("stribeck", 1.0),
            viscous_coefficient=law.viscous_coefficient * viscous * thickness * change.get("viscous", 1.0),
        )
        conditions = {"load": float(self.load[k])}
        if self.axis.tells:
            conditions["temperature"] = float(self.temperature[k])
        start = round(self.day[k] * DAY_NS)
        return answer(self.pool, int(self.row[k]), law, k, start, conditions, self.vertical, change)


def estimates(axis: Axis, pool: Pool, windows: int, change: Change = nothing) -> Iterator[Estimate]:
    """Window after window of `axis`, healthy but for `change`."""
    life = Life(axis, pool, windows)
    return (life.at(k, change(float(life.day[k]))) for k in range(windows))


def answer(
    pool: Pool,
    row: int,
    law: StribeckFriction,
    number: int,
    start_ns: int,
    conditions: dict[str, float],
    vertical: bool,
    change: dict[str, float],
) -> Estimate:
    """What identification would say of `law`, with the errors it made in `row` of the pool.

    Of `change`: `scale` is a torque read too large by that factor, `latent` [N] what the model lacks besides, `payload`
    [kg] what nobody reported, `offset` [N] a force from outside.
    """
    rows = pool.rows
    told = np.isfinite(rows["speed"][row])
    speeds = rows["speed"][row][told]
    relative = rows["value"][row][told] / rows["truth"][row][told]
    scale, payload = change.get("scale", 1.0), change.get("payload", 0.0)
    force = scale * law.force(speeds) * relative
    half = force * rows["half"][row][told] / rows["value"][row][told]
    curve = Curve(*(tuple(one.tolist()) for one in (speeds, force, force - half, force + half)),
                  float(rows["fastest"][row]))  # fmt: skip
    carried = payload + conditions.get("load", 0.0) - float(rows["load"][row])  # more than that of the real window
    weight = GRAVITY * carried if vertical else 0.0
    weight += change.get("offset", 0.0) + ((scale - 1) * WEIGHT if vertical else 0.0)
    parameters = [Parameter("stribeck_velocity", law.stribeck_velocity, "m/s", 0.0, 1.0)]
    for name, unit, shift in (("constant", "N", weight), ("mass", "kg", carried)):
        value, spread = scale ** (name == "mass") * (rows[name][row] + shift), rows[f"{name}_half"][row]
        if np.isfinite(spread):
            key = {"constant": "constant_force", "mass": "moving_mass"}[name]
            parameters.append(Parameter(key, float(value), unit, float(value - spread), float(value + spread)))
    return Estimate(
        Window(WindowId(1, 2000 * number, 2000), start_ns, start_ns + 20 * 10**9), "identified", None, "ga+polish", 0,
        "study", "", {}, parameters=tuple(parameters), curve=curve,
        conditions={**conditions, "latent_force": float(np.hypot(rows["latent"][row], change.get("latent", 0.0)))},
    )  # fmt: skip
