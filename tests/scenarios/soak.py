"""Soak: the time-lapse plant against a real daemon, as fast as it goes, for a given wall time.

`make soak ARGS="--minutes 60"` (or `python -m tests.scenarios.soak`) prints a row every `--every` seconds as CSV, then
the judgement as JSON; exit code 1 where memory, handles, threads or lag still grow in the second half.
"""

import argparse
import collections
import contextlib
import csv
import dataclasses
import datetime as dt
import json
import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy as np

from plant.axis_file import write_axis
from plant.publisher import SamplePublisher
from plant.scenario_file import read_scenario
from plant.simulator import publish_scenario
from tests.scenarios.harness import SITE, Ear, Plant, wait_for

SETTINGS = """
[window]
samples = 2000
hop = {burst}
[identification]
workers = 1
"""
# From the third to the last quarter of the run the median may grow by so much; what leaks goes on beyond it.
BOUNDS = {
    "daemon_mb": 10.0,  # MB: what an allocator keeps back now and then
    "workers_mb": 10.0,
    "daemon_handles": 4.0,  # a connection to the database more or less, at both ends
    "workers_handles": 4.0,
    "threads": 2.0,
    "intake_seconds": 2.0,  # s
    "pending": 4.0,  # windows
}
AHEAD = 3  # bursts that may be sent before they are acknowledged


class Feeder(threading.Thread):
    """The machine: its scenario over and over, each time repaired and later by the scenario's length."""

    def __init__(self, scenario, publisher, ear, rate: float = 0.0) -> None:
        super().__init__(daemon=True)
        self._scenario, self._publisher, self._ear = scenario, publisher, ear
        self._rate, self._begun = rate, time.monotonic()
        self.halt, self.error = threading.Event(), None
        self.lives = 0

    def run(self) -> None:
        try:
            while not self.halt.is_set():
                shift = dt.timedelta(days=self._scenario.bursts.days) * self.lives
                bursts = dataclasses.replace(self._scenario.bursts, start=self._scenario.bursts.start + shift)
                life = dataclasses.replace(self._scenario, bursts=bursts, seed=self._scenario.seed + self.lives)
                publish_scenario(life, self._publisher, stop=self.halt, on_burst=self._follow)
                self.lives += 1
        except Exception as error:  # said by the main thread
            self.error = error

    def _follow(self, _burst) -> None:
        """As fast as the daemon acknowledges and answers, not faster; at most `rate` samples per second."""
        if self._rate:
            due = self._begun + self._publisher.next_seq / self._rate
            self.halt.wait(max(0.0, due - time.monotonic()))
        allowed = self._publisher.next_seq - AHEAD * self._scenario.bursts.samples
        while not self.halt.is_set():
            pending = self._ear.heard["status"][-1]["pending_windows"] if self._ear.heard["status"] else 0
            if self._ear.committed() >= allowed - 1 and pending <= AHEAD:
                return
            self.halt.wait(0.02)


class ShortEar(Ear):
    """Keeps only what it heard last: this process is not what is measured, but it need not grow."""

    def __init__(self, session, axis):
        self.count = collections.Counter()
        super().__init__(session, axis)

    def _listener(self, what):
        def hear(sample):
            self.count[what] += 1
            self.heard[what][:] = [json.loads(sample.payload.to_bytes())]

        return hear


def descendants(pid: int) -> list[int]:
    """Worker processes and their fork server."""
    children: dict[int, list[int]] = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            parent = int(stat.read_text().rpartition(")")[2].split()[1])
            children.setdefault(parent, []).append(int(stat.parent.name))
    found, queue = [], [pid]
    while queue:
        more = children.get(queue.pop(), [])
        found += more
        queue += more
    return found


def resident(pid: int) -> tuple[float, int, int]:
    """(resident memory [MB], open handles, threads) of a process."""
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    words = {name: value.split() for name, _, value in (line.partition(":") for line in lines)}
    return int(words["VmRSS"][0]) / 1024, len(list(Path(f"/proc/{pid}/fd").iterdir())), int(words["Threads"][0])


def look(plant: Plant, publisher, ear, begun: float) -> dict:
    """One row of the table."""
    status = ear.heard["status"][-1]
    memory, handles, threads = resident(plant.process.pid)
    workers = []
    for pid in descendants(plant.process.pid):
        with contextlib.suppress(OSError, KeyError):  # it ended under our eyes
            workers.append(resident(pid))
    return {
        "seconds": round(time.monotonic() - begun, 1),
        "samples": publisher.next_seq,
        "windows": ear.count["parameters"],
        "daemon_mb": round(memory, 1),
        "workers_mb": round(sum(one[0] for one in workers), 1),
        "daemon_handles": handles,
        "workers_handles": sum(one[1] for one in workers),
        "threads": threads,
        "intake_seconds": status["lag"]["intake_seconds"],
        "pending": status["pending_windows"],
        "missing": status["missing"],
        "rejected": sum(status["rejected"].values()),
        "database_mb": round(sum(file.stat().st_size for file in plant.folder.glob("var/*.db*")) / 1e6, 2),
    }


def judge(rows: list[dict]) -> dict:
    """Growth of the medians from the third quarter to the last, and whether it is within the bounds."""
    quarter = len(rows) // 4
    third, last = rows[2 * quarter : 3 * quarter], rows[3 * quarter :]
    growth = {
        name: round(float(np.median([row[name] for row in last]) - np.median([row[name] for row in third])), 3)
        for name in BOUNDS
    }
    beyond = sorted(name for name in BOUNDS if growth[name] > BOUNDS[name])
    return {"growth_in_second_half": growth, "bounds": BOUNDS, "beyond": beyond}


def run(folder: Path, minutes: float, every: float, samples: int, say=lambda _row: None, *, rate: float = 0.0) -> dict:
    """Soak for `minutes`, at most `rate` samples per second where it is not 0; last row and judgement."""
    scenario = read_scenario("wear")
    scenario = dataclasses.replace(scenario, bursts=dataclasses.replace(scenario.bursts, samples=samples))
    name = scenario.axis.name
    with Plant(folder, axes=(name,), settings=SETTINGS.format(burst=samples)) as plant:
        write_axis(scenario.axis, folder / f"{name}.toml")
        plant.start(180.0)
        with plant.session() as session, SamplePublisher(session, SITE, name) as publisher:
            ear = ShortEar(session, name)
            feeder = Feeder(scenario, publisher, ear, rate)
            feeder.start()
            wait_for(lambda: ear.heard["parameters"], 180, "the first answer")
            begun, rows = time.monotonic(), []
            while time.monotonic() - begun < 60 * minutes and feeder.error is None:
                time.sleep(every)
                rows.append(look(plant, publisher, ear, begun))
                say(rows[-1])
            feeder.halt.set()
            feeder.join()
            rejected = ear.heard["status"][-1]["rejected"]
            ear.close()
        if feeder.error is not None:
            raise feeder.error
        plant.terminate()
        return {"minutes": minutes, "lives": feeder.lives, "last": rows[-1], "rejected": rejected, **judge(rows)}


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--minutes", type=float, default=60.0)
    options.add_argument("--every", type=float, default=10.0, help="seconds between rows")
    options.add_argument("--samples", type=int, default=20_000, help="of a burst; one window of 2000 is made of each")
    options.add_argument("--rate", type=float, default=0.0, help="samples per second at most; 0 = as fast as it goes")
    chosen = options.parse_args()
    if 60 * chosen.minutes < 8 * chosen.every:
        options.error("at least eight rows are needed: more --minutes or a smaller --every")
    table = None

    def say(row):
        nonlocal table
        if table is None:
            table = csv.DictWriter(sys.stdout, row)
            table.writeheader()
        table.writerow(row)
        sys.stdout.flush()

    with tempfile.TemporaryDirectory() as folder:
        report = run(Path(folder), chosen.minutes, chosen.every, chosen.samples, say, rate=chosen.rate)
    sys.stdout.write(json.dumps(report, indent=1) + "\n")
    return 1 if report["beyond"] else 0


if __name__ == "__main__":
    sys.exit(main())
