"""Healthy axis-years end to end: many machines stream into one real daemon in time-lapse. `make daemon-years`.

Process, Zenoh, SQLite, workers and commands are real. Every thirty days the daemon is stopped or killed in the middle
of its work and started again; blocks get lost, bursts break off, publishers start anew, machines pause. An operator
acknowledges what stands every five days. Whatever is raised is judged by `years_judging`. Interrupt it at any time: the
next run goes on where it was.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import shutil
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import zenoh

from monitor.command_zenoh import send_command
from monitor.commands import Command
from monitor.errors import QueryError
from plant import keys
from plant.axis_file import write_axis
from plant.errors import ReachError
from plant.publisher import SamplePublisher
from plant.scenario import Burst
from plant.simulator import burst_blocks
from tests.scenarios.harness import ROOT, SITE, Plant, wait_for
from tests.scenarios.years_judging import report
from tests.scenarios.years_machines import INTERVAL, Machine, draw

FOLDER = ROOT / "var" / "daemon-years"
SETTINGS = """
[window]
hop = 2000
[identification]
workers = 2
[intake]
stale_after = 864000.0
[alarms]
false_alarms_per_axis_year = {rate}
"""  # time-lapse says nothing about silence: a stale alarm goes by the wall clock
AHEAD = 3  # bursts per axis that may be on their way
PATIENCE = 1800.0  # s for the windows on their way
RESTART, ROUND = 30.0, 5.0  # d between restarts, and between the operator's rounds


class Fleet:
    """The machines, their publishers, and what the daemon says of them."""

    def __init__(self, plant: Plant, machines: list[Machine], session: zenoh.Session) -> None:
        self.plant, self.machines, self.session = plant, machines, session
        self.status: dict[str, dict[str, Any]] = {}
        self.publishers = {one.name: SamplePublisher(session, SITE, one.name) for one in machines}
        self._ear = session.declare_subscriber(f"{keys.PREFIX}/{SITE}/*/status", self._hear)

    def _hear(self, sample: zenoh.Sample) -> None:
        told = json.loads(sample.payload.to_bytes())
        self.status[told["axis"]] = told

    def send(self, machine: Machine, number: int) -> None:
        """Burst `number`, with its mishaps."""
        if not machine.sends(number):
            return
        lost, cut, anew = machine.mishap(number)
        scenario = machine.scenario
        if anew:
            self.publishers[machine.name].__exit__(None, None, None)
            self.publishers[machine.name] = SamplePublisher(self.session, SITE, machine.name)
        publisher = self.publishers[machine.name]
        time_s = scenario.bursts.time(number)
        condition, begin_ns = machine.condition(number), scenario.begin_ns(number)
        burst = Burst(number, time_s, begin_ns, machine.burst(number), scenario.friction, condition)
        gain = scenario.axis.mechanics.gain
        blocks = list(burst_blocks(burst, machine.name, gain, publisher.epoch, publisher.next_seq))
        for place, block in enumerate(blocks):
            if cut and place >= len(blocks) // 2:
                break
            if lost and place == 1:
                publisher.next_seq = block.seq + len(block)
                continue
            publisher.put(block)

    def waiting(self) -> int:
        """Bursts that are not acknowledged and windows that are not answered."""
        on_the_way = 0
        for name, publisher in self.publishers.items():
            told = self.status.get(name) or {}
            committed = told.get("committed") or {}
            seq = committed["seq"] if committed.get("epoch") == publisher.epoch else -1
            on_the_way += -(-(publisher.next_seq - 1 - seq) // 2000) + told.get("pending_windows", 0)
        return on_the_way

    def wait(self, most: int) -> None:
        """Until no more than `most` are waiting."""

        def settled() -> bool:
            if self.plant.process.poll() is not None:
                raise AssertionError(
                    f"the daemon ended with {self.plant.process.returncode}:\n{self.plant.log[-3000:]}"
                )
            return self.waiting() <= most

        wait_for(settled, PATIENCE, f"{self.waiting()} bursts on the way, at most {most} wanted")

    def acknowledge(self) -> None:
        """An operator's round: what stands is acknowledged."""
        for name, told in self.status.items():
            for kind, state in told["alarms"].items():
                if "unacknowledged" in state:
                    # Somebody else did, it returned meanwhile, or nobody answers in time: the next round tries again.
                    with contextlib.suppress(QueryError, ReachError):
                        order = Command("acknowledge", name, {"kind": kind}, "operator")
                        send_command(self.session, SITE, keys.PREFIX, order)

    def close(self) -> None:
        self._ear.undeclare()
        for publisher in self.publishers.values():
            publisher.__exit__(None, None, None)


def live(folder: Path, machines: list[Machine], days: float, rate: float) -> None:
    """Let the machines live their days, from where the last run ended."""
    names = tuple(one.name for one in machines)
    with Plant(folder, axes=names, settings=SETTINGS.format(rate=rate)) as plant:
        for one in machines:
            write_axis(one.scenario.axis, folder / f"{one.name}.toml")
        mark, rows = folder / "progress.json", int(days * 24 / INTERVAL)
        first = json.loads(mark.read_text())["row"] if mark.exists() else 0
        plant.start(180.0)
        with plant.session() as session:
            fleet, begun = Fleet(plant, machines, session), time.monotonic()
            for row in range(first, rows):
                _every(RESTART, row, lambda row=row: _restart(plant, row))
                for one in machines:
                    fleet.send(one, row)
                mark.write_text(json.dumps({"row": row + 1}))
                fleet.wait(AHEAD * len(machines))
                _every(ROUND, row, fleet.acknowledge)
                _show(row + 1 - first, rows - first, time.monotonic() - begun, row)
            fleet.wait(0)
            fleet.acknowledge()
            fleet.close()
        plant.terminate()


def _every(days: float, row: int, what: Any) -> None:
    rows = round(days * 24 / INTERVAL)
    if row and row % rows == 0:
        what()


def _restart(plant: Plant, row: int) -> None:
    """Stop it, or kill it, with windows on the way; start it again."""
    if (row * INTERVAL / 24) % (2 * RESTART) < RESTART:
        plant.terminate()
    else:
        plant.kill()
    plant.start(180.0)


def _show(done: int, of: int, seconds: float, row: int) -> None:
    left = seconds / done * (of - done) / 60
    day = (row + 1) * INTERVAL / 24
    print(f"\rday {day:6.1f}  {done / of:4.0%}  {left:5.1f} min left ", end="", file=sys.stderr, flush=True)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--axes", type=int, default=20)
    options.add_argument("--days", type=float, default=365.0)
    options.add_argument("--first", type=int, default=0, help="seed of the first machine")
    options.add_argument("--rate", type=float, default=1.0, help="the setting: false alarms per axis-year")
    options.add_argument("--fresh", action="store_true", help="begin anew instead of going on")
    options.add_argument("--judge", action="store_true", help="only judge what the last run left")
    chosen = options.parse_args()
    folder = FOLDER / f"{chosen.first}-{chosen.axes}-{chosen.days:g}-{chosen.rate:g}"
    if chosen.fresh:
        shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True, exist_ok=True)
    machines = [draw(seed, chosen.days) for seed in range(chosen.first, chosen.first + chosen.axes)]
    if not chosen.judge:
        live(folder, machines, chosen.days, chosen.rate)
    told = report(folder, machines, chosen.rate)
    (folder / "result.json").write_text(json.dumps(told, indent=1))
    print(json.dumps({name: one for name, one in told.items() if name not in ("alarms", "machines")}, indent=1))
    for one in told["alarms"]:
        print(f"{one['axis']} day {one['day']:.1f} {one['kind']}: {one['judged']} ({one['why']})  {one['text']}")
    print(f"all of it: {(folder / 'result.json').relative_to(ROOT)}; {np.round(told['axis_years'], 1)} axis-years")


if __name__ == "__main__":
    main()
