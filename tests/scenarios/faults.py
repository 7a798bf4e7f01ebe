"""The fault table: what is done to a stream, what must come of it, what came of it; lost = reported, to the sample.

`python -m tests.scenarios.faults [NAME ...]` (`make faults`) prints a row per fault and ends with 1 where one is not as
expected. Every fault runs against a real daemon in its own process, over Zenoh on loopback.
"""

import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import zenoh

from plant import keys
from plant.presets import paper_axis
from plant.publisher import SamplePublisher
from plant.wire import CBOR, encode_block
from plant.zenoh_session import open_session
from tests.scenarios.harness import ROOT, SITE, START_NS, STEP_NS, Ear, Plant, blocks_of, burst, free_port, wait_for
from tests.scenarios.kill9_account import Database

SETTINGS = """
[window]
samples = 1000
hop = 1000
[intake]
reorder_seconds = 1.5
[history]
keep_raw_windows = 1000000
"""
DAY_NS = 86_400 * 10**9
KEY = keys.samples_key(SITE, "axis-1")


@dataclass
class Account:
    """What became of every sample of one epoch."""

    sent: int
    received: int
    missing: int
    unaccounted: int
    twice: int

    @property
    def exact(self) -> bool:
        return self.unaccounted == 0 and self.twice == 0 and self.received + self.missing == self.sent


def together(*accounts: Account) -> Account:
    """The sum over several epochs."""
    return Account(*(sum(values) for values in zip(*(vars(one).values() for one in accounts), strict=True)))


def account(plant: Plant, epoch: int, sent: int) -> Account:
    """From the database alone: journal and gaps against the numbers that were sent."""
    rows = Database(plant.url).query("select seq, n from block where epoch = :epoch order by seq", epoch=epoch)
    numbers = np.concatenate([np.arange(seq, seq + n) for seq, n in rows] or [np.zeros(0, dtype=int)])
    gaps = Database(plant.url).query(
        "select from_seq, to_seq from gap where epoch = :epoch and missing > 0", epoch=epoch
    )
    lost = np.concatenate([np.arange(first, end) for first, end in gaps] or [np.zeros(0, dtype=int)])
    told = np.union1d(numbers, lost)
    doubled = len(numbers) - len(np.unique(numbers)) + len(np.intersect1d(numbers, lost))
    return Account(sent, len(np.unique(numbers)), len(lost), len(np.setdiff1d(np.arange(sent), told)), doubled)


class Source:
    """A machine that sends bursts of 2000 samples, each a day after the other in event time, at a given pace."""

    def __init__(self, put, epoch: int, size: int = 100) -> None:
        self.put, self.epoch, self.size = put, epoch, size
        self.sent = 0
        self._torque, self._position = burst(paper_axis(), samples=2000)

    def blocks(self, bursts: int):
        first = self.sent // 2000
        for number in range(first, first + bursts):
            yield from blocks_of("axis-1", self.epoch, 2000 * number, START_NS + number * DAY_NS, self._torque,
                                 self._position, self.size)  # fmt: skip

    def send(self, bursts: int, rate: float = 0.0) -> float:
        """Send; `rate` in blocks per second, 0 = as fast as it goes. The longest time a put took. [s]"""
        worst, begun = 0.0, time.monotonic()
        for k, block in enumerate(self.blocks(bursts)):
            if rate:
                time.sleep(max(0.0, begun + k / rate - time.monotonic()))
            before = time.monotonic()
            self.put(block)
            worst = max(worst, time.monotonic() - before)
            self.sent = block.seq + len(block)
        return worst


@contextlib.contextmanager
def background(source: Source, bursts: int, rate: float):
    """Send in a thread; joined at the end."""
    thread = threading.Thread(target=source.send, args=(bursts, rate))
    thread.start()
    try:
        yield
    finally:
        thread.join()


def settled(ear: Ear, epoch: int, last: int, timeout: float = 90.0) -> dict:
    """Wait until everything up to sample `last` is stored or reported; the status then."""

    def there():
        shown = [one for one in ear.heard["status"] if one["committed"] and one["committed"]["epoch"] == epoch]
        return shown[-1] if shown and shown[-1]["committed"]["seq"] >= last else None

    return wait_for(there, timeout, f"sample {last} of epoch {epoch} settled")


@contextlib.contextmanager
def stage(folder: Path, through=None, queue: int = 20000, **publisher):
    """Daemon, session (through another endpoint if given), advanced publisher, ear."""
    with (
        bare_stage(folder, through, queue) as (plant, session, ear),
        SamplePublisher(session, SITE, "axis-1", **publisher) as samples,
    ):
        yield plant, session, samples, ear


@contextlib.contextmanager
def bare_stage(folder: Path, through=None, queue: int = 20000):
    """Daemon, session and ear."""
    settings = SETTINGS.replace("[intake]", f"[intake]\nqueue_blocks = {queue}")
    with Plant(folder, settings=settings) as plant:
        plant.start()
        endpoint = through(plant) if through else plant.endpoint
        with open_session("client", connect=[endpoint], timeout=20.0) as session, plant.session() as listening:
            ear = Ear(listening)
            yield plant, session, ear
            ear.close()


# --- the faults: each returns (what came of it, as expected?) ---------------------------------------------------


def daemon_killed(folder: Path):
    with stage(folder) as (plant, _, publisher, ear):
        source = Source(publisher.put, publisher.epoch)
        with background(source, 12, 25.0):
            wait_for(lambda: ear.committed() > 1000, 60, "something acknowledged")
            promised = ear.committed()
            plant.kill()
            plant.start()
        status = settled(ear, publisher.epoch, source.sent - 1)
        found = account(plant, publisher.epoch, source.sent)
        return (
            f"{promised + 1} were acknowledged at the kill; {status['rejected'].get('duplicates', 0)} repeated",
            found,
        )


def caches_beyond_the_queue(folder: Path):
    with stage(folder, queue=200) as (plant, _, publisher, ear):
        source = Source(publisher.put, publisher.epoch)
        source.send(1)
        settled(ear, publisher.epoch, 1999)
        plant.kill()
        source.send(28)  # 560 blocks into its cache
        plant.start()
        status = settled(ear, publisher.epoch, source.sent - 1)
        assert "queue_full" not in status["rejected"], status["rejected"]
        return "560 blocks came at once, the queue holds 200", account(plant, publisher.epoch, source.sent)


def publisher_restarted(folder: Path):
    with bare_stage(folder) as (plant, session, ear):
        for _ in range(2):
            with SamplePublisher(session, SITE, "axis-1") as publisher:
                Source(publisher.put, publisher.epoch).send(2)
                status = settled(ear, publisher.epoch, 3999)
        epochs = [epoch for (epoch,) in Database(plant.url).query("select distinct epoch from block order by epoch")]
        first, second = (account(plant, epoch, 4000) for epoch in epochs)
        assert status["gaps"]["epoch"] == 1, status["gaps"]
        return "two epochs, one break between them", together(first, second)


def clock_set_back(folder: Path):
    with bare_stage(folder) as (plant, session, ear):
        found = []
        for epoch in (2 * 10**18, 10**18):
            with SamplePublisher(session, SITE, "axis-1", epoch=epoch) as publisher:
                begun = time.monotonic()
                Source(publisher.put, epoch).send(1)
                status = settled(ear, epoch, 1999)
                found.append(account(plant, epoch, 2000))
        assert not status["rejected"], status["rejected"]
        return f"believed after {time.monotonic() - begun:.0f} s of silence of the later one", together(*found)


def ended_epoch_replayed(folder: Path):
    with bare_stage(folder) as (plant, session, ear):
        for epoch in (1, 2):
            source = Source(lambda block: session.put(KEY, encode_block(block), encoding=CBOR), epoch)
            source.send(1)
            settled(ear, epoch, 1999)
        Source(source.put, 1).send(1)
        wait_for(lambda: ear.heard["status"][-1]["rejected"].get("old_epoch") == 2000, 30, "2000 refused")
        alert = wait_for(lambda: ear.heard["alerts"], 30, "an alert")[-1]
        found = [account(plant, epoch, 2000) for epoch in (1, 2)]
        assert alert["kind"] == "data_quality"
        text = alert["alert"]["text"].split(": ")[-1][:60]
        return "2000 samples counted as old_epoch, data_quality: " + text, together(*found)


def stray_epoch(folder: Path):
    """One message of a far epoch amid the stream, then one while the machine pauses."""
    with bare_stage(folder) as (plant, session, ear):
        source = Source(lambda block: session.put(KEY, encode_block(block), encoding=CBOR), 1)
        stray = Source(source.put, 2**62, size=2000)
        with background(source, 2, 2.0):
            wait_for(lambda: ear.committed() > 500, 60, "a beginning")
            stray.send(1)
        status = settled(ear, 1, 3999)
        assert status["rejected"] == {"stray_epoch": 2000}, status["rejected"]
        Source(source.put, 2**62 + 1, size=2000).send(1)
        settled(ear, 2**62 + 1, 1999)
        source.send(2)
        settled(ear, 1, 7999)
        found = together(account(plant, 1, 8000), account(plant, 2**62 + 1, 2000))
        return "refused amid the stream, taken in the pause; the stream goes on", found


def link_cut(seconds: float, cache: int, rate: float, bursts: int):
    def run(folder: Path):
        from tests.scenarios.proxy import Proxy

        with contextlib.ExitStack() as stack:
            proxies = []

            def through(plant):
                proxies.append(stack.enter_context(Proxy(plant.port)))
                return proxies[0].endpoint

            with stage(folder, through, cache_blocks=cache) as (plant, _, publisher, ear):
                source = Source(publisher.put, publisher.epoch)
                with background(source, bursts, rate):
                    wait_for(lambda: ear.committed() > 500, 60, "a beginning")
                    proxies[0].cut()
                    time.sleep(seconds)  # the length of the cut is the point
                    proxies[0].mend()
                    back = time.monotonic()
                    before = ear.committed()
                    wait_for(lambda: ear.committed() > before, 60, "the stream is back")
                    back = time.monotonic() - back
                settled(ear, publisher.epoch, source.sent - 1)
                return f"back after {back:.1f} s", account(plant, publisher.epoch, source.sent)

    return run


FROZEN = """
import sys, time
from plant import keys
from plant.zenoh_session import open_session
with open_session("client", connect=[sys.argv[1]]) as session:
    with session.declare_subscriber(sys.argv[2], lambda sample: None):
        print("there", flush=True)
        time.sleep(600)
"""


def frozen_neighbour(folder: Path):
    with stage(folder) as (plant, _, publisher, ear):
        command = [sys.executable, "-c", FROZEN, plant.endpoint, KEY]
        other = subprocess.Popen(command, stdout=subprocess.PIPE, cwd=ROOT, env=os.environ)
        try:
            assert other.stdout.readline() == b"there\n"
            other.send_signal(signal.SIGSTOP)
            source = Source(publisher.put, publisher.epoch, size=2000)
            worst = source.send(60)  # 6 MB as fast as it goes
            settled(ear, publisher.epoch, source.sent - 1)
        finally:
            other.kill()
            other.wait(10)
            other.stdout.close()
        return f"longest put {1e3 * worst:.0f} ms", account(plant, publisher.epoch, source.sent)


def drop_overload(folder: Path):
    with bare_stage(folder) as (plant, session, ear):
        plain = session.declare_publisher(KEY, encoding=CBOR, congestion_control=zenoh.CongestionControl.DROP)
        epoch = time.time_ns()
        torque, position = burst(paper_axis(), samples=2000)
        payloads = [encode_block(block) for block in blocks_of("axis-1", epoch, 0, START_NS, torque, position, 100)]
        made = []
        for number in range(400):  # ready before, so that the flood is a flood
            made += [_renumbered(payload, epoch, 2000 * number + 100 * k, START_NS + number * DAY_NS + k * 10**9)
                     for k, payload in enumerate(payloads)]  # fmt: skip
        os.kill(plant.process.pid, signal.SIGSTOP)  # the daemon cannot take anything for a while
        for payload in made[:-20]:
            plain.put(payload)
        os.kill(plant.process.pid, signal.SIGCONT)
        time.sleep(1.0)
        for payload in made[-20:]:  # the last ones show where the end is
            plain.put(payload)
            time.sleep(0.02)
        settled(ear, epoch, 800_000 - 1)
        found = account(plant, epoch, 800_000)
        return f"{found.missing} of 800000 dropped on the way", found


def _renumbered(payload: bytes, epoch: int, seq: int, t0_ns: int) -> bytes:
    """The same samples under another number and time; by way of cbor2, since only the head changes."""
    import cbor2

    content = cbor2.loads(payload)
    return cbor2.dumps({**content, "seq": seq, "t0_ns": t0_ns})


ROUTER = """
import sys, time
from plant.zenoh_session import open_session
with open_session("router", listen=[sys.argv[1]]):
    print("there", flush=True)
    time.sleep(3600)
"""


def router_restarted(folder: Path):
    endpoint = f"tcp/127.0.0.1:{free_port()}"

    def router():
        made = subprocess.Popen([sys.executable, "-c", ROUTER, endpoint], stdout=subprocess.PIPE, cwd=ROOT)
        assert made.stdout.readline() == b"there\n"
        return made

    process = router()
    try:
        with Plant(folder, settings=SETTINGS) as plant:
            text = plant.config.read_text()
            words = f'mode = "client"\nlisten = []\nconnect = ["{endpoint}"]'
            plant.config.write_text(text.replace(f'listen = ["{plant.endpoint}"]', words))
            plant.start()
            with (
                open_session("client", connect=[endpoint], timeout=20.0) as session,
                SamplePublisher(session, SITE, "axis-1") as publisher,
            ):
                ear = Ear(session)
                source = Source(publisher.put, publisher.epoch)
                with background(source, 12, 25.0):
                    wait_for(lambda: ear.committed() > 500, 60, "a beginning")
                    process.kill()
                    process.wait(10)
                    process.stdout.close()
                    process = router()
                    before = ear.committed()
                    wait_for(lambda: ear.committed() > before, 60, "the stream is back")
                settled(ear, publisher.epoch, source.sent - 1)
                ear.close()
                return "router killed and started anew", account(plant, publisher.epoch, source.sent)
    finally:
        process.kill()
        process.wait(10)
        process.stdout.close()


def clock_steps(folder: Path):
    with stage(folder) as (plant, _, publisher, ear):
        torque, position = burst(paper_axis(), samples=2000)
        starts = (0, 3_600 * 10**9, -3_600 * 10**9)  # an hour ahead, then two back, each in the middle of a run
        sent = 0
        for number in range(3):
            begin = START_NS + number * 20 * 10**9
            for k, block in enumerate(blocks_of("axis-1", publisher.epoch, 2000 * number, begin, torque, position)):
                step = starts[number if k >= 10 else max(number - 1, 0)]
                stamps = block.t_ns + step
                publisher.put(type(block)(block.axis, block.epoch, block.seq, stamps, block.position, block.torque,
                                          dt_ns=STEP_NS))  # fmt: skip
                sent = block.seq + len(block)
        status = settled(ear, publisher.epoch, sent - 1)
        found = account(plant, publisher.epoch, sent)
        assert status["gaps"].get("pause", 0) == 2, status["gaps"]
        rows = Database(plant.url).query("select start_ns, end_ns from window")
        assert all(end - start == 999 * STEP_NS for start, end in rows)  # none spans a step
        return f"{len(rows)} windows, none across a step; gaps {status['gaps']}", found


def doubled_and_shuffled(folder: Path):
    with stage(folder) as (plant, session, publisher, ear):
        rng = np.random.default_rng(5)
        source = Source(None, publisher.epoch)
        blocks = [payload for block in source.blocks(4) for payload in [encode_block(block)] * int(rng.integers(1, 3))]
        order = np.argsort(np.arange(len(blocks)) + rng.uniform(0, 6, len(blocks)))
        for k in order:
            session.put(KEY, blocks[int(k)], encoding=CBOR, congestion_control=zenoh.CongestionControl.BLOCK)
        status = settled(ear, publisher.epoch, 7999)
        doubled = (len(blocks) - 80) * 100
        wait_for(lambda: ear.heard["status"][-1]["rejected"].get("duplicates", 0) >= doubled, 30, "duplicates counted")
        counted = ear.heard["status"][-1]["rejected"]["duplicates"]
        assert counted == doubled, (counted, doubled)
        assert status["missing"] == 0
        return f"{counted} duplicates counted of {doubled} sent", account(plant, publisher.epoch, 8000)


def half_a_block(folder: Path):
    with stage(folder) as (plant, session, publisher, ear):
        for k, block in enumerate(Source(None, publisher.epoch).blocks(2)):
            payload = encode_block(block)
            session.put(KEY, payload[: len(payload) // 2] if k == 7 else payload, encoding=CBOR,
                        congestion_control=zenoh.CongestionControl.BLOCK)  # fmt: skip
        status = settled(ear, publisher.epoch, 3999)
        found = account(plant, publisher.epoch, 4000)
        assert found.missing == 100
        assert status["rejected"] == {"bad_cbor": 1}, status["rejected"]
        return "1 payload refused as bad_cbor, its 100 samples a gap", found


def rate_changed(folder: Path):
    with stage(folder) as (plant, _, publisher, ear):
        torque, position = burst(paper_axis(), samples=2000)
        start, seq = START_NS, 0
        for step in (STEP_NS, STEP_NS // 10, STEP_NS * 2):
            for block in blocks_of("axis-1", publisher.epoch, seq, start, torque, position):
                stamps = start + (block.seq - seq + np.arange(100)) * step
                publisher.put(type(block)("axis-1", publisher.epoch, block.seq, stamps, block.position, block.torque,
                                          dt_ns=step))  # fmt: skip
            start, seq = start + 2000 * step, seq + 2000
        settled(ear, publisher.epoch, seq - 1)
        wait_for(lambda: ear.heard["status"][-1]["pending_windows"] == 0, 60, "answers")
        verdicts = [one["verdict"] for one in ear.heard["parameters"]]
        assert verdicts == ["identified"] * 2 + ["bad_data"] * 2, verdicts
        why = ear.heard["parameters"][-1]["reason"]
        assert "samples come every 0.001 s, the axis file says 0.01 s" in why, why
        gaps = ear.heard["status"][-1]["gaps"]
        return f"10 times faster: refused by the audit; half as fast: no windows, {gaps['pause']} pauses", account(
            plant, publisher.epoch, seq
        )


@dataclass(frozen=True)
class Fault:
    """What is expected, in words, the most samples that may be missing, and how it is done."""

    expected: str
    most_missing: int
    run: Callable[[Path], tuple[str, Account]]


FAULTS = {
    "daemon killed and restarted": Fault("all recovered from the publisher's cache", 0, daemon_killed),
    "restart, caches hold more than the queue": Fault("all recovered, nothing dropped", 0, caches_beyond_the_queue),
    "publisher restarted": Fault("new epoch, nothing of either lost", 0, publisher_restarted),
    "publisher restarted with an older epoch": Fault("believed when the later one is silent", 0, clock_set_back),
    "epoch that ended is replayed": Fault("refused, counted, data_quality", 0, ended_epoch_replayed),
    "one message of a far epoch": Fault("costs nothing but itself", 0, stray_epoch),
    "link cut 2 s": Fault("all recovered from the cache", 0, link_cut(2.0, 600, 25.0, 12)),
    "link cut 60 s, cache of 600 blocks": Fault(
        "the cache recovers the newest, the rest is reported", 2**62, link_cut(60.0, 600, 25.0, 120)
    ),
    "frozen subscriber beside": Fault("daemon loses nothing, puts stay short", 0, frozen_neighbour),
    "DROP overload": Fault("what is lost is reported, to the sample", 2**62, drop_overload),
    "router restarted": Fault("all recovered from the cache", 0, router_restarted),
    "clock steps +1 h, -2 h": Fault("nothing lost, no window across a step", 0, clock_steps),
    "doubled and reordered blocks": Fault("each sample once, duplicates counted", 0, doubled_and_shuffled),
    "half a block": Fault("refused with its reason, its samples a gap", 100, half_a_block),
    "sample rate changed on the fly": Fault("nothing lost, the wrong rate refused and told", 0, rate_changed),
}


def run_fault(name: str, folder: Path) -> dict:
    """Do it; a row of the table."""
    fault = FAULTS[name]
    outcome, found = fault.run(folder)
    good = found.exact and found.missing <= fault.most_missing
    return {"fault": name, "expected": fault.expected, "outcome": outcome, **vars(found), "as_expected": good}


def main() -> int:
    wrong = 0
    for name in sys.argv[1:] or FAULTS:
        with tempfile.TemporaryDirectory() as folder:
            try:
                row = run_fault(name, Path(folder))
            except AssertionError as error:
                row = {"fault": name, "as_expected": False, "outcome": str(error)}
        wrong += not row["as_expected"]
        sys.stdout.write(json.dumps(row) + "\n")
        sys.stdout.flush()
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
