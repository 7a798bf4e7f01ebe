"""Healthy machines over a year, drawn from a seed: seasons, shifts, payloads, friction that does not repeat, holidays.

Nothing wears and nothing breaks. Every second machine in open loop is marched by the independent simulator of
tests/reference; the others, and those in closed loop, by plant/.
"""

from __future__ import annotations

import dataclasses
import datetime as dt
from dataclasses import dataclass
from typing import Any

import numpy as np

from plant.ageing import Ageing, Condition
from plant.ageing_climate import Ambient, Load, Viscosity, WarmUp
from plant.ageing_damage import Scatter
from plant.friction import StribeckFriction
from plant.motion import ClosedLoop
from plant.recording import Recording
from plant.scenario import Scenario, loaded
from tests.monitor.studies.pool import FAMILIES, Family, Restless, restless, scenario_of
from tests.reference.machine import Torque, run
from tests.reference.parameters import ReferencePlant

START = dt.datetime(2026, 1, 1, 3, tzinfo=dt.UTC)
INTERVAL = 11.0  # h from burst to burst: passes through all hours of the day
STEP = 1e-3  # s, of the independent simulator: errors below its sensor's resolution, ten times as fast as its usual one
LOST, CUT, ANEW = 0.02, 0.01, 0.01  # shares of bursts: a block is lost, the burst breaks off, its publisher starts anew


@dataclass(frozen=True, slots=True)
class Machine:
    """One axis and what is known about it that the daemon is not told.

    Attributes:
        name: of the axis.
        seed: of everything about it.
        family: how it is driven.
        scenario: its year.
        loads: payloads: first day, last day, mass. [d], [d], [kg]
        reports: which of temperature and load it sends.
        pauses: days without a burst: first and last. [d]
        independent: marched by tests/reference.
    """

    name: str
    seed: int
    family: Family
    scenario: Scenario
    loads: tuple[tuple[float, float, float], ...]
    reports: tuple[str, ...]
    pauses: tuple[tuple[float, float], ...]
    independent: bool

    def sends(self, number: int) -> bool:
        """Whether burst `number` happens."""
        day = number * INTERVAL / 24.0
        return not any(first <= day < last for first, last in self.pauses)

    def mishap(self, number: int) -> tuple[bool, bool, bool]:
        """Of burst `number`: a block is lost; it breaks off; the publisher starts anew before it."""
        lost, cut, anew = np.random.default_rng([12, self.seed, number]).random(3)
        return bool(lost < LOST), bool(cut < CUT), bool(anew < ANEW)

    def condition(self, number: int) -> Condition:
        """What the machine is in at burst `number`."""
        return self.scenario.ageing.condition(self.scenario.moment(self.scenario.bursts.time(number)))

    def burst(self, number: int) -> Recording:
        """What it sends in burst `number`."""
        scenario, condition = self.scenario, self.condition(number)
        law = condition.friction(scenario.friction)
        rng = np.random.default_rng([11, self.seed, number])
        gain = scenario.axis.mechanics.gain
        extra = restless(scenario, self.family.dirt, rng) / gain if self.family.dirt else None
        if self.independent:
            true = self._reference(condition, law, extra)
        else:
            moved = scenario
            if extra is not None:
                moved = dataclasses.replace(scenario, drive=Restless(scenario.drive, extra))
            true = moved._run(condition, law, f"{self.name}, burst {number}")
            if extra is not None:
                true = dataclasses.replace(true, force=true.force - gain * extra)
        return scenario.sensors.apply(true, gain, scenario.axis.drive.rated_force, rng)

    def _reference(self, condition: Condition, law: StribeckFriction, extra: Any) -> Recording:
        """The burst by the other simulator: same equations, other author, other integrator."""
        scenario = self.scenario
        m = loaded(scenario.axis, condition.load).mechanics
        machine = ReferencePlant(
            M=m.M, J=m.J, Rc=m.Rc, force_per_torque=m.gain, g=m.g, orientation=m.orientation.value,
            **dataclasses.asdict(law),
        )  # fmt: skip
        n = scenario.bursts.samples
        t = scenario.sample_time * np.arange(n)
        torque = scenario.drive.torque(t)
        acting = torque if extra is None else torque + extra
        what = run(machine, Torque(t, acting), position0=scenario.start_position, step=STEP)
        return Recording(
            t=t,
            force=m.gain * torque,
            position=what["position"],
            sample_time=scenario.sample_time,
            hold=scenario.axis.stream.hold,
            temperature=np.full(n, condition.temperature) if scenario.sensors.report_temperature else None,
            load=np.full(n, condition.load) if scenario.sensors.report_load else None,
            source=f"{self.name}, independent",
        )

    def told(self) -> dict[str, Any]:
        """For the report."""
        simulator = "tests/reference" if self.independent else "plant"
        return {
            "axis": self.name, "kind": self.family.name, "simulator": simulator, "reports": list(self.reports),
            "payloads": [list(one) for one in self.loads], "pauses": [list(one) for one in self.pauses],
        }  # fmt: skip


def draw(seed: int, days: float) -> Machine:
    """Machine number `seed`, over so many days."""
    rng = np.random.default_rng([10, seed])
    family = FAMILIES[seed % len(FAMILIES)]
    scenario = scenario_of(family)
    spans = [(float(rng.uniform(0, days)), float(rng.uniform(3, 30))) for _ in range(int(rng.integers(2, 6)))]
    loads = tuple((first, first + length, float(rng.uniform(0.3, 3.0))) for first, length in spans)
    chance = rng.random(3)
    if chance[0] < 0.4:  # the same payload all year
        loads = ()
    reports = (("temperature",) if chance[1] < 0.8 else ()) + (("load",) if loads and chance[2] < 0.5 else ())
    pauses = tuple((first, first + float(rng.uniform(3, 20))) for first in rng.uniform(0.1 * days, days, 2))
    grease = float(rng.uniform(0.015, 0.03))
    stages = (
        Ambient(
            21.0, daily=rng.uniform(0.5, 3.0), yearly=rng.uniform(2.0, 6.0), warmest_day=rng.uniform(0, 365),
            weather=rng.uniform(0.5, 2.0), seed=seed,
        ),
        WarmUp(rise=rng.uniform(2.0, 8.0), time_constant=rng.uniform(1800.0, 7200.0)),
        Viscosity(grease, reference=23.0),
        *(Load(mass, first, last, friction_per_kilogram=1.5) for first, last, mass in loads),
        Scatter(
            coulomb=rng.uniform(0.005, 0.02), static=0.02, stribeck=0.03, viscous=rng.uniform(0.005, 0.02),
            wandering=rng.uniform(0.0, 0.01), wandering_days=rng.uniform(3.0, 30.0), seed=seed,
        ),
    )  # fmt: skip
    name = f"axis-{seed:04d}"
    sensors = dataclasses.replace(
        scenario.sensors, report_temperature="temperature" in reports, report_load="load" in reports
    )
    scenario = dataclasses.replace(
        scenario, name=name, axis=dataclasses.replace(scenario.axis, name=name), ageing=Ageing(stages), seed=seed,
        sensors=sensors, bursts=dataclasses.replace(scenario.bursts, start=START, interval_hours=INTERVAL, days=days),
    )  # fmt: skip
    closed = isinstance(scenario.drive, ClosedLoop)
    return Machine(name, seed, family, scenario, loads, reports, pauses, not closed and (seed + seed // 6) % 2 == 1)
