"""The publisher that `kill9` kills: a process of its own that writes down what it is about to send before it sends it.

`python -m tests.scenarios.kill9_publisher ENDPOINT FOLDER CACHE_BLOCKS RATE`; any line on stdin ends the sending, the
end of stdin ends the process.
"""

import os
import sys
import threading
import time
from pathlib import Path

import numpy as np

from plant.publisher import SamplePublisher
from plant.zenoh_session import open_session
from tests.scenarios.harness import SITE, START_NS, blocks_of

AXIS = "axis-1"
RATE = 1000.0  # samples per second, of all plants together
DAY_NS = 86_400 * 10**9
HEALTHY_DAYS = 20  # bursts before the friction rises
BURSTS, LEDGER = "bursts.npz", "ledger.txt"


def read_ledger(folder: Path) -> dict[int, tuple[int, int]]:
    """By epoch, oldest first: (samples that were perhaps handed over, number of the day after the last one)."""
    path, found = folder / LEDGER, {}
    for line in path.read_text().splitlines() if path.exists() else []:
        epoch, end, day = map(int, line.split())
        found[epoch] = (end, day + 1)
    return found


def main() -> None:
    endpoint, folder, cache_blocks, rate = sys.argv[1], Path(sys.argv[2]), int(sys.argv[3]), float(sys.argv[4])
    stop, left = threading.Event(), threading.Event()
    threading.Thread(target=_obey, args=(stop, left), daemon=True).start()
    bursts = np.load(folder / BURSTS)
    day = max((after for _, after in read_ledger(folder).values()), default=0)
    ledger = os.open(folder / LEDGER, os.O_WRONLY | os.O_APPEND | os.O_CREAT)
    with (
        open_session("client", connect=[endpoint], timeout=120.0) as session,
        SamplePublisher(session, SITE, AXIS, cache_blocks=cache_blocks) as publisher,
    ):
        begun = time.monotonic()
        while not stop.is_set():
            kind = "healthy" if day < HEALTHY_DAYS else "worn"
            torque, position = bursts[f"{kind}_torque"], bursts[f"{kind}_position"]
            start = START_NS + day * DAY_NS
            for block in blocks_of(AXIS, publisher.epoch, publisher.next_seq, start, torque, position):
                os.write(ledger, f"{publisher.epoch} {block.seq + len(block)} {day}\n".encode())
                publisher.put(block)
                stop.wait(max(0.0, begun + publisher.next_seq / rate - time.monotonic()))
            day += 1
        left.wait()  # what was missed is recovered from the cache


def _obey(stop: threading.Event, left: threading.Event) -> None:
    sys.stdin.readline()
    stop.set()
    sys.stdin.read()
    left.set()


if __name__ == "__main__":
    main()
