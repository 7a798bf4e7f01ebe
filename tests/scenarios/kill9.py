"""Kill daemon, worker processes, publisher and database server at random moments; then account for everything.

`make kills ARGS="--kills 1000 --plants 4"` (or `python -m tests.scenarios.kill9`) prints the account as JSON; exit code
1 where something is wrong. Most of a kill is waiting: several plants side by side, each with daemon, publisher and
database of its own, share the kills and the samples per second, and their accounts are added up. `--minutes` ends it
early, with a full account of what was done by then.
"""

import argparse
import collections
import concurrent.futures
import contextlib
import json
import multiprocessing
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from monitor.command_zenoh import send_command
from monitor.commands import Command
from plant import keys
from plant.errors import TribowatchError
from plant.presets import paper_axis
from tests.postgres import Server
from tests.scenarios.harness import ROOT, SITE, Ear, Plant, burst, wait_for
from tests.scenarios.kill9_account import WRONG, Database, account, promise
from tests.scenarios.kill9_publisher import AXIS, BURSTS, RATE, read_ledger

SETTINGS = """
[window]
samples = 1000
hop = 800
[intake]
reorder_seconds = 1.0
stale_after = 2.0
[history]
keep_raw_windows = 1000000
[identification]
workers = 2
[drift]
baseline_windows = 6
baseline_span = 0.0
"""
PATIENCE = 180.0  # s, for a computer that does much else


class Publisher:
    """The publisher's process; killed with what waits in it."""

    def __init__(self, plant: Plant, cache_blocks: int, rate: float) -> None:
        self._plant, self._words = plant, (str(cache_blocks), str(rate))
        self.process, self._before = None, 0

    def start(self):
        self._before = len(read_ledger(self._plant.folder))
        command = [sys.executable, "-m", "tests.scenarios.kill9_publisher", self._plant.endpoint]
        with (self._plant.folder / "publisher.log").open("ab") as log:
            self.process = subprocess.Popen(
                [*command, str(self._plant.folder), *self._words], stdin=subprocess.PIPE, stderr=log, cwd=ROOT
            )

    def kill(self):
        self.process.kill()
        self.process.wait(10)
        self.process.stdin.close()

    def stop_sending(self):
        """It stays, with its cache; what it has sent stands in the ledger once that no longer grows."""
        wait_for(lambda: len(read_ledger(self._plant.folder)) > self._before, PATIENCE, "the publisher sends")
        self.process.stdin.write(b"stop\n")
        self.process.stdin.flush()


def workers_of(pid: int) -> list[int]:
    """Grandchildren of the daemon: what its fork server has forked."""
    parents = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            parents[int(stat.parent.name)] = int(stat.read_text().rpartition(")")[2].split()[1])
    return [child for child, parent in parents.items() if parents.get(parent) == pid]


class Hunt:
    """One run: who is killed when, and what had been promised by then."""

    def __init__(self, plant, publisher, session, server, rng):
        self.plant, self.publisher, self.server, self._rng = plant, publisher, server, rng
        self.session, self.database = session, Database(plant.url)
        self.ear, self.promises, self.commands = Ear(session), [], 0
        self.killed = collections.Counter()
        self._said = (0, -1)

    def acknowledged(self) -> tuple[int, int]:
        """(epoch, number) of the last sample that the daemon has acknowledged."""
        heard = self.ear.heard["status"]
        while heard:
            if one := heard.pop(0)["committed"]:
                self._said = max(self._said, (one["epoch"], one["seq"]))
        return self._said

    def strike(self, victim: str) -> None:
        """Wait for a random moment, mostly in the midst of work; kill; start again after a while."""
        before = self.acknowledged()
        if self._rng.random() < 0.7:
            wait_for(lambda: self.acknowledged() > before, PATIENCE, "something acknowledged")
            self._acknowledge()
        time.sleep(float(self._rng.uniform(0.0, 1.5)))  # the random moment is the point
        pause = float(self._rng.choice([0.0, 0.5, 2.5]))
        getattr(self, f"_{victim}")(pause)
        self.killed[victim] += 1

    def _daemon(self, pause):
        self.plant.kill()
        self.promises.append(promise(self.database, self.acknowledged()))
        time.sleep(pause)
        self.plant.start(PATIENCE)

    def _worker(self, _pause):
        found = wait_for(lambda: workers_of(self.plant.process.pid), PATIENCE, "a worker process")
        self.promises.append(promise(self.database, self.acknowledged()))
        with contextlib.suppress(ProcessLookupError):  # it was just replaced; that is a break too
            os.kill(int(self._rng.choice(found)), signal.SIGKILL)

    def _publisher(self, pause):
        self.publisher.kill()
        self.promises.append(promise(self.database, self.acknowledged()))
        time.sleep(pause)
        self.publisher.start()

    def _server(self, pause):
        said = self.acknowledged()
        self.server.crash(hard=bool(self._rng.random() < 0.5))
        time.sleep(pause)
        self._start_server()
        self.promises.append(promise(self.database, said))

    def _start_server(self):
        """It refuses while children of the dead one still hold its memory."""
        deadline = time.monotonic() + PATIENCE
        while True:
            try:
                return self.server.start()
            except subprocess.CalledProcessError:
                if time.monotonic() > deadline:
                    raise
                time.sleep(0.5)

    def _acknowledge(self):
        """What an operator does with an alarm that stands; counted when the daemon says it is done."""
        stands = [kind for kind, state in self.database.query("select kind, state from alarm") if "un" in state]
        for kind in stands[:1]:
            with contextlib.suppress(TribowatchError):  # it went by itself meanwhile, or the daemon is just away
                send_command(self.session, SITE, keys.PREFIX, Command("acknowledge", AXIS, {"kind": kind}, "hunter"))
                self.commands += 1

    def settle(self) -> None:
        """Let everything be answered that was sent."""
        self.publisher.stop_sending()
        ledger = read_ledger(self.plant.folder)
        while (later := _after_a_second(self.plant.folder)) != ledger:
            ledger = later
        epoch, last = max(ledger), ledger[max(ledger)][0] - 1
        wait_for(lambda: self.acknowledged() >= (epoch, last), PATIENCE, f"{last} of {epoch}: {self.acknowledged()}")
        waits = 'select count(*) from "window" where not done'
        wait_for(lambda: self.database.query(waits) == [(0,)], 10 * PATIENCE, "all windows answered")


def _after_a_second(folder):
    time.sleep(1.0)
    return read_ledger(folder)


def run(folder: Path, kills: int, seed: int, *, server: Server | None = None, victims=(), cache_blocks: int = 150,
        minutes: float = 1e9, rate: float = RATE) -> dict:  # fmt: skip
    """Kill `kills` times, each of `victims` as often; the account. 150 blocks hold 15 s, longer outages leave gaps.

    The publisher sends `rate` samples per second.
    """
    rng, begun = np.random.default_rng(seed), time.monotonic()
    victims = victims or (("daemon", "worker", "publisher") + (("server",) if server else ()))
    url = server.database() if server else ""
    settings = SETTINGS.replace("[history]", f'[history]\ndatabase = "{url}"') if server else SETTINGS
    bursts = {"healthy": burst(paper_axis(), samples=2000), "worn": burst(paper_axis(), 1.3, samples=2000)}
    parts = {f"{kind}_{what}": one[k] for kind, one in bursts.items() for k, what in enumerate(("torque", "position"))}
    np.savez(folder / BURSTS, **parts)
    with Plant(folder, axes=(AXIS,), settings=settings) as plant, contextlib.ExitStack() as stack:
        plant.url = url or plant.url
        plant.start(PATIENCE)
        publisher = Publisher(plant, cache_blocks, rate)
        publisher.start()
        stack.callback(publisher.kill)
        hunt = Hunt(plant, publisher, stack.enter_context(plant.session()), server, rng)
        wait_for(lambda: hunt.acknowledged()[1] >= 0, PATIENCE, "the first acknowledgement")
        deck: list[str] = []
        for _ in range(kills):
            if time.monotonic() - begun > 60 * minutes:
                break
            deck = deck or list(rng.permutation(victims))
            hunt.strike(str(deck.pop()))
        hunt.settle()
        hunt.ear.close()
        report = {"kills": hunt.killed.total(), **{f"kills_of_{name}": n for name, n in sorted(hunt.killed.items())}}
        stop_seconds = plant.terminate()
        report |= account(hunt.database, read_ledger(folder), hunt.promises, hunt.commands)
        return report | {"seconds": round(time.monotonic() - begun), "stop_seconds": round(stop_seconds, 1)}


def run_beside(chosen: argparse.Namespace, number: int) -> dict:
    """The part of plant `number` in a run of several, in a scratch folder."""
    kills = len(range(number, chosen.kills, chosen.plants))
    with contextlib.ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        server = stack.enter_context(contextlib.closing(Server())) if chosen.database == "postgresql" else None
        return run(
            folder, kills, 1000 * chosen.seed + number, server=server, cache_blocks=chosen.cache,
            minutes=chosen.minutes, rate=RATE / chosen.plants,
        )  # fmt: skip


def add_up(reports: list[dict]) -> dict:
    """One account of several: sums; of what is no number, of each plant; the longest time."""
    total: dict = {"plants": len(reports)}
    for name in dict.fromkeys(name for report in reports for name in report):
        values = [report.get(name, 0) for report in reports]
        worst = [value for value in values if value != "ok"]
        if name == "integrity":
            total[name] = "; ".join(worst) or "ok"
        else:
            total[name] = max(values) if name.endswith("seconds") else sum(values)
    return total


def is_good(report: dict) -> bool:
    return report["integrity"] == "ok" and not any(report[name] for name in WRONG)


def main(words: list[str] | None = None) -> int:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--kills", type=int, default=100)
    options.add_argument("--plants", type=int, default=1, help="side by side")
    options.add_argument("--seed", type=int, default=0)
    options.add_argument("--cache", type=int, default=400, help="blocks of 100 samples that the publisher keeps")
    options.add_argument("--database", choices=("sqlite", "postgresql"), default="sqlite")
    options.add_argument("--minutes", type=float, default=1e9, help="end after that, however many kills it was")
    chosen = options.parse_args(words)
    spawn = multiprocessing.get_context("spawn")
    with concurrent.futures.ProcessPoolExecutor(chosen.plants, mp_context=spawn) as pool:
        parts = [pool.submit(run_beside, chosen, number) for number in range(chosen.plants)]
        report = add_up([part.result() for part in parts])
    sys.stdout.write(json.dumps(report, indent=1) + "\n")
    return 0 if is_good(report) else 1


if __name__ == "__main__":
    sys.exit(main())
