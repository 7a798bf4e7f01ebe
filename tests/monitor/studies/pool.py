"""A pool of real identifications of simulated healthy windows: the errors every study of the watch draws from.

Six kinds of axis, each window at its own temperature, now and then with a payload the axis file does not know, with
friction that does not repeat from run to run, nor within a run. What is kept is the answer beside the truth.
`python -m tests.monitor.studies.pool --windows 10500` writes var/studies/pool.npz (about 15 min of one core, once).
Seeds below 100 000 were looked at while search and watch were made.
"""

from __future__ import annotations

import argparse
import dataclasses
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from identify.identification import identify_friction
from monitor.identify_window import curve_of
from plant.ageing import Condition
from plant.axis import Axis, Orientation
from plant.friction import StribeckFriction
from plant.scenario import Scenario
from plant.scenario_file import parse_scenario

POOL = Path("var/studies/pool.npz")
FIRST = 100_000  # seed
POINTS = 12  # of the common grid of speeds that one window covers at most
COMMON = """
name = "{name}"
description = "pool"
seed = 0
[axis]
preset = "{preset}"
{drive}
[bursts]
start = 2026-01-05T06:00:00Z
samples = 2000
interval_hours = 12.0
days = 180.0
[sensors]
position_noise = 2e-5
position_resolution = 1e-5
torque_per_mille = 1.0
{sensors}
"""
SINE = '[excitation]\nform = "sine"\namplitude = {amplitude}\nfrequency = 0.2\n'
MULTI = '[excitation]\nform = "multisine"\namplitude = 1.1\nfrequencies = [0.13, 0.31, 0.7]\nseed = 3\n'
LOOP = """[motion]
form = "production_cycle"
stations = [0.5, 1.3, 0.9]
dwells = [0.5, 0.3, 0.6]
speed = 0.6
acceleration = 3.0
jerk = 40.0
torque = "mean"
[motion.cascade]
position_gain = 20.0
velocity_gain = 3000.0
integral_time = 0.02
acceleration_feedforward = 0.8
torque_limit = 8.0
"""


@dataclass(frozen=True)
class Family:
    """One kind of axis: how it is driven, and how far friction wanders within a run (share of F_c, rms)."""

    name: str
    preset: str
    drive: str
    dirt: float
    sensors: str = ""
    horizontal: bool = False


FAMILIES = (
    Family("sine", "paper-literal", SINE.format(amplitude=2.3), 0.0),
    Family("sine, friction restless", "paper-literal", SINE.format(amplitude=2.3), 0.02),
    Family("bump, sine", "paper-bump", SINE.format(amplitude=2.4), 0.005),
    Family("production cycle", "paper-bump", LOOP, 0.0, "torque_noise = 0.01"),
    Family("three sines, friction restless", "paper-literal", MULTI, 0.05),
    Family("horizontal, mass unknown", "paper-literal", SINE.format(amplitude=2.3), 0.005, horizontal=True),
)


@dataclass(frozen=True)
class Restless:
    """An excitation with the force nobody modelled on top (Ornstein-Uhlenbeck, 0.1 s). [N m]"""

    base: object
    extra: np.ndarray

    def torque(self, t):
        return self.base.torque(t) + self.extra[: np.size(t)]


def scenario_of(family: Family) -> Scenario:
    text = COMMON.format(name="pool", preset=family.preset, drive=family.drive, sensors=family.sensors)
    scenario = parse_scenario(text, family.name, Path())
    if not family.horizontal:
        return scenario
    mechanics = dataclasses.replace(scenario.axis.mechanics, orientation=Orientation.HORIZONTAL, inertia_known=False)
    return dataclasses.replace(scenario, axis=dataclasses.replace(scenario.axis, mechanics=mechanics),
                               drive=dataclasses.replace(scenario.drive, offset=0.0))  # fmt: skip


def restless(scenario: Scenario, share: float, rng: np.random.Generator) -> np.ndarray:
    n, phi = scenario.bursts.samples, np.exp(-scenario.sample_time / 0.1)
    white = rng.standard_normal(n)
    white[1:] *= np.sqrt(1 - phi**2)
    for k in range(1, n):
        white[k] += phi * white[k - 1]
    return share * scenario.friction.coulomb_force * white


def window(scenario: Scenario, family: Family, seed: int) -> tuple[Axis, StribeckFriction, object, dict[str, float]]:
    """Axis file, true law and recording of one healthy window: its own temperature, payload and chance."""
    rng = np.random.default_rng([9, seed])
    warmth = rng.uniform(-8.0, 8.0)  # K from the temperature at which the law holds
    thickness = np.exp(-0.025 * warmth)
    chance = np.exp(rng.standard_normal(4) * (0.02, 0.02, 0.03, 0.02))
    load = float(rng.uniform(0.2, 3.0)) if rng.random() < 0.2 else 0.0
    condition = Condition(temperature=21.0 + warmth, load=load, dry_force=1.5 * load).scaled(
        chance[0], chance[1], chance[2] / thickness, chance[3] * thickness
    )
    law = condition.friction(scenario.friction)
    gain = scenario.axis.mechanics.gain
    extra = restless(scenario, family.dirt, rng) / gain
    moved = scenario
    if family.dirt:
        moved = dataclasses.replace(scenario, drive=Restless(scenario.drive, extra))
    true = moved._run(condition, law, f"pool {family.name} {seed}")
    if family.dirt:
        true = dataclasses.replace(true, force=true.force - gain * extra)
    seen = scenario.sensors.apply(true, gain, scenario.axis.drive.rated_force, rng)
    return scenario.axis, law, seen, {"temperature": 21.0 + warmth, "load": load}


def row(scenario: Scenario, number: int, seed: int) -> dict[str, object]:
    """Identify one window; the answer beside the truth, in fixed shapes."""
    family = FAMILIES[number]
    axis, law, recording, condition = window(scenario, family, seed)
    answer = identify_friction(recording, axis, seed=seed)
    curve = curve_of(answer)
    out = {name: np.full(POINTS, np.nan) for name in ("speed", "value", "half", "truth")}
    if curve is not None:
        n = min(POINTS, len(curve.speeds))
        speeds = np.array(curve.speeds[:n])
        out["speed"][:n], out["value"][:n] = speeds, curve.values[:n]
        out["half"][:n] = (np.array(curve.high[:n]) - np.array(curve.low[:n])) / 2
        out["truth"][:n] = law.force(speeds)
    parameters = answer.parameters

    def of(name):
        known = parameters.get(name)
        return (known.value, (known.ci95[1] - known.ci95[0]) / 2 if known.ci95 else np.nan) if known else (np.nan,) * 2

    constant, mass, v_s = of("constant_force"), of("moving_mass"), of("stribeck_velocity")
    return out | {
        "family": number, "seed": seed, "identified": answer.verdict.value == "identified", **condition,
        "fastest": curve.fastest if curve else np.nan, "latent": answer.latent_force or 0.0,
        "constant": constant[0], "constant_half": constant[1], "mass": mass[0], "mass_half": mass[1],
        "stribeck": v_s[0], "coulomb": law.coulomb_force,
    }  # fmt: skip


def make(windows: int, path: Path = POOL) -> None:
    """Fill the pool up to `windows`; what an interrupted run left beside it is gone on with."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part, rows = path.with_suffix(".part.npz"), []
    begun = part if part.exists() else path
    if begun.exists():
        with np.load(begun) as kept:
            rows = [{name: kept[name][i] for name in kept.files} for i in range(len(kept["seed"]))]
    scenarios = [scenario_of(family) for family in FAMILIES]
    begin = time.monotonic()
    for seed in range(FIRST + len(rows), FIRST + windows):
        rows.append(row(scenarios[seed % len(FAMILIES)], seed % len(FAMILIES), seed))
        if len(rows) % 200 == 0 or len(rows) == windows:
            temporary = path.with_suffix(".new.npz")
            np.savez_compressed(temporary, **{name: np.array([one[name] for one in rows]) for name in rows[0]})
            temporary.replace(part)
            print(f"{len(rows)} windows, {time.monotonic() - begin:.0f} s", flush=True)
    if part.exists():
        part.replace(path)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--windows", type=int, default=10500)
    make(parser.parse_args().windows)
