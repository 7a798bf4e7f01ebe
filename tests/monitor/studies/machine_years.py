"""The machines of `daemon_years`, many of them, at the level of estimates. `make machine-years`.

Seasons, shifts, payloads nobody told, temperatures nobody told, friction that wanders for up to a month: the truth is
that of `tests/scenarios/years_machines.py`, and so is the judgement of what is raised; what identification adds comes
from the pool of real answers, of windows with a similar payload. Seconds a year instead of a minute: what the daemon
does end to end in a dozen years can be looked at in hundreds. Seeds from 20 000 on judge, those below are for choosing.
"""

from __future__ import annotations

import argparse
import collections
import time
from collections.abc import Iterator

import numpy as np

from monitor.estimate import Estimate
from plant.axis import Orientation
from tests.monitor.studies.axis_years import JUDGING, SETTINGS, told
from tests.monitor.studies.pool import FAMILIES
from tests.monitor.studies.synthetic import Pool, answer
from tests.scenarios.years_judging import raised
from tests.scenarios.years_machines import LOST, Machine, draw

DAYS = 365.0
NEAREST = 12  # windows of the pool with the payload most like it, among which chance takes one


def answers(machine: Machine, pool: Pool) -> Iterator[Estimate]:
    """What identification would have said of every burst of `machine`."""
    family, scenario = FAMILIES.index(machine.family), machine.scenario
    rng = np.random.default_rng([14, machine.seed])
    vertical = scenario.axis.mechanics.orientation is Orientation.VERTICAL
    for number in range(len(scenario)):
        if not machine.sends(number) or rng.random() < 1.5 * LOST:
            continue
        true = machine.condition(number)
        row = pool.alike(family, true.load, rng, NEAREST)
        sent = {"temperature": true.temperature, "load": true.load}
        conditions = {name: sent[name] for name in machine.reports}
        untold = {"payload": true.load - conditions.get("load", 0.0)}
        law, begin_ns = true.friction(scenario.friction), scenario.begin_ns(number)
        yield answer(pool, row, law, number, begin_ns, conditions, vertical, untold)


def main(machines: int, first: int, rates: tuple[float, ...], listed: bool) -> None:
    pool, begin, years = Pool(), time.process_time(), 0.0
    kinds = {rate: collections.Counter() for rate in rates}
    blind = {rate: collections.Counter() for rate in rates}
    blind_years = 0.0
    for seed in range(first, first + machines):
        machine = draw(seed, DAYS)
        seen = list(answers(machine, pool))
        year = (seen[-1].window.end_ns - seen[20].window.end_ns) / 86_400e9 / 365.25
        years += year
        knows = "temperature" in machine.reports
        blind_years += 0.0 if knows else year
        for rate in rates:
            for one in raised(machine, seen, rate):
                evidence = one["evidence"]
                if one["judged"] == "false":
                    kinds[rate][f"{one['kind']}, {one['why'].split(' ')[0]}"] += 1
                    blind[rate][knows] += 1
                if listed and one["judged"] == "false":
                    print(f"{rate:g}/a {machine.name} {'' if knows else 'blind '}{machine.family.name} day "
                          f"{one['day']:.0f} {one['kind']} ({one['why']}) {evidence.get('indicator')} "
                          f"{evidence.get('cause')} {evidence.get('relative')}")  # fmt: skip
    spent = time.process_time() - begin
    print(f"{machines} machines from seed {first}, {years:.0f} axis-years, {blind_years:.0f} of them without "
          f"temperature, {len(pool)} real answers, {spent:.0f} s of CPU")  # fmt: skip
    for rate in rates:
        knowing, without = blind[rate][True], blind[rate][False]
        print(f"  setting {rate:g}/a: {told(knowing + without, years)}; temperature told "
              f"{told(knowing, years - blind_years)}, not told {told(without, max(blind_years, 1e-9))}; "
              f"{dict(kinds[rate].most_common())}", flush=True)  # fmt: skip


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--machines", type=int, default=300)
    parser.add_argument("--first", type=int, default=JUDGING)
    parser.add_argument("--rates", type=float, nargs="+", default=sorted(SETTINGS))
    parser.add_argument("--list", action="store_true", help="every false alarm")
    given = parser.parse_args()
    main(given.machines, given.first, tuple(given.rates), given.list)
