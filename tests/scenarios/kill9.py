"""Kill the daemon at random moments while a publisher goes on; then account for every sample and every window.

`python -m tests.scenarios.kill9 [KILLS] [SEED]` prints the account as JSON; exit code 1 where something is wrong.
"""

import itertools
import json
import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy as np
from sqlalchemy import text

from monitor.database import make_engine
from plant.presets import paper_axis
from plant.publisher import SamplePublisher
from tests.scenarios.harness import SITE, START_NS, STEP_NS, Ear, Plant, blocks_of, burst, wait_for

SAMPLES, HOP = 1000, 800
SETTINGS = f"""
[window]
samples = {SAMPLES}
hop = {HOP}
[intake]
reorder_seconds = 1.0
[history]
keep_raw_windows = 1000000
[identification]
workers = 2
"""
RATE = 1000.0  # samples per second


def run(folder: Path, kills: int, seed: int, cache_blocks: int = 40, database: str = "") -> dict:
    """Kill `kills` times; return the account. A cache of 40 blocks holds 4 s, so longer outages leave gaps."""
    rng = np.random.default_rng(seed)
    stop, sent = threading.Event(), [0]
    torque, position = burst(paper_axis(), samples=2000)
    promises = []
    settings = SETTINGS.replace("[history]", f'[history]\ndatabase = "{database}"') if database else SETTINGS
    with Plant(folder, settings=settings) as plant:
        plant.url = database or plant.url
        plant.start()
        with (
            plant.session() as session,
            SamplePublisher(session, SITE, "axis-1", cache_blocks=cache_blocks) as publisher,
        ):
            ear = Ear(session)
            thread = threading.Thread(target=_publish, args=(publisher, torque, position, stop, sent))
            thread.start()
            try:
                for _ in range(kills):
                    before = ear.committed()
                    if rng.random() < 0.7:  # in the midst of its work, else perhaps before the stream is back
                        wait_for(lambda before=before: ear.committed() > before, 60, "something acknowledged")
                    time.sleep(float(rng.uniform(0.0, 1.5)))  # the random moment is the point
                    plant.kill()
                    promises.append(_promise(plant, publisher.epoch, ear.committed()))
                    time.sleep(float(rng.choice([0.0, 0.5, 2.5])))
                    plant.start()
            finally:
                stop.set()
                thread.join()
            last = sent[0] - 1
            wait_for(lambda: ear.committed() >= last, 60, f"last sample {last} acknowledged, {ear.committed()} is")
            wait_for(lambda: ear.heard["status"][-1]["pending_windows"] == 0, 240, "all windows answered")
            ear.close()
        seconds = plant.terminate()
        return account(plant, publisher.epoch, sent[0], promises) | {"kills": kills, "stop_seconds": seconds}


def _publish(publisher, torque, position, stop, sent):
    """Send bursts of 2000 samples, each a day after the other in event time, at `RATE`."""
    number, begun = 0, time.monotonic()
    while not stop.is_set():
        start = START_NS + number * 86_400 * 10**9
        for block in blocks_of("axis-1", publisher.epoch, publisher.next_seq, start, torque, position):
            publisher.put(block)
            sent[0] = publisher.next_seq
            stop.wait(max(0.0, begun + sent[0] / RATE - time.monotonic()))
        number += 1


def _query(plant, sql, **values):
    engine = make_engine(plant.url)
    try:
        with engine.connect() as connection:
            return connection.execute(text(sql), values).fetchall()
    finally:
        engine.dispose()


def _received(plant, epoch):
    """Numbers of the samples in the journal; fails where one is there twice."""
    rows = _query(plant, "select seq, n from block where epoch = :epoch order by seq", epoch=epoch)
    parts = [np.arange(seq, seq + n) for seq, n in rows]
    numbers = np.concatenate(parts) if parts else np.zeros(0, dtype=int)
    assert len(np.unique(numbers)) == len(numbers), "a sample is in the journal twice"
    return numbers


def _promise(plant, epoch, acknowledged):
    """What was acknowledged before this kill, and which samples up to there the journal holds."""
    numbers = _received(plant, epoch)
    return acknowledged, numbers[numbers <= acknowledged]


def account(plant, epoch, sent, promises):
    """Compare journal, gaps and windows with what was sent and acknowledged."""
    numbers = _received(plant, epoch)
    gaps = _query(plant, "select from_seq, to_seq, missing from gap where epoch = :epoch and missing > 0", epoch=epoch)
    missing = np.concatenate([np.arange(first, end) for first, end, _ in gaps]) if gaps else np.zeros(0, dtype=int)
    lost = sum(len(np.setdiff1d(promised, numbers)) for _, promised in promises)
    broken = sum(int(np.isin(missing, promised).sum()) for _, promised in promises)
    expected = _expected_windows(plant, epoch, numbers)
    windows = [
        tuple(row) for row in _query(plant, 'select first_seq, samples from "window" where epoch = :epoch', epoch=epoch)
    ]
    answers = _query(plant, "select count(*), count(distinct window_id) from estimate")[0]
    return {
        "sent": sent,
        "received": len(numbers),
        "missing_reported": len(missing),
        "unaccounted": sent - len(np.union1d(numbers, missing)),
        "both_received_and_missing": len(np.intersect1d(numbers, missing)),
        "acknowledged_and_lost": lost + broken,
        "windows": len(windows),
        "windows_twice": len(windows) - len(set(windows)),
        "windows_wrong": len(set(windows) ^ {(first, SAMPLES) for first in expected}),
        "answers": answers[0],
        "answers_missing": len(windows) - answers[1],
        "integrity": "ok" if "postgresql" in plant.url else _query(plant, "pragma integrity_check")[0][0],
    }


def _expected_windows(plant, epoch, numbers):
    """First samples of the windows that the received samples make, from the journal alone."""
    rows = _query(plant, "select seq, t_ns from block where epoch = :epoch order by seq", epoch=epoch)
    stamps = np.concatenate([np.frombuffer(t_ns, "<i8") for _, t_ns in rows])
    broken = (np.diff(numbers) != 1) | (np.diff(stamps) > 1.5 * STEP_NS)
    edges = np.concatenate(([0], np.flatnonzero(broken) + 1, [len(numbers)]))
    starts = []
    for first, end in itertools.pairwise(edges):
        starts += [int(numbers[k]) for k in range(first, end - SAMPLES + 1, HOP)]
    return starts


WRONG = ("unaccounted", "both_received_and_missing", "acknowledged_and_lost", "windows_twice", "windows_wrong",
         "answers_missing")  # fmt: skip


def main() -> int:
    words = sys.argv[1:]
    kills, seed = int(words[0]) if words else 20, int(words[1]) if len(words) > 1 else 0
    with tempfile.TemporaryDirectory() as folder:
        report = run(Path(folder), kills, seed)
    sys.stdout.write(json.dumps(report, indent=1) + "\n")
    return 1 if any(report[name] for name in WRONG) or report["integrity"] != "ok" else 0


if __name__ == "__main__":
    sys.exit(main())
