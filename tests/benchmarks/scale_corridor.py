"""What the daemon's corridor costs per axis, in processor time alone: so that a busy machine does not count.

Everything is the daemon's own (queue, checks, journal, status as JSON) but for the wire and the workers.
"""

import dataclasses
import json
import struct
import time
from pathlib import Path

import structlog

from monitor.config import Config
from monitor.inbox import Inbox, Message
from monitor.pipeline import Pipeline
from monitor.store import Store
from plant.presets import paper_axis, paper_friction
from tests.benchmarks.scale_streams import SIZE, motion, templates

TURNS = 50  # of the corridor a second, as when messages come all the time


class NoWorkers:
    """Windows stay waiting: this is about the intake."""

    free = busy = 0

    def collect(self):
        return []


def cost(folder: Path, count: int, seconds: int) -> float:
    """Processor time per axis and second of stream, at 100 samples a second in one block. [s]"""
    structlog.configure(wrapper_class=structlog.make_filtering_bound_logger(50))
    names = [f"axis-{k:04d}" for k in range(count)]
    wave = motion(paper_friction())
    payloads = {name: templates(name, 1, *wave) for name in names}
    now = [1000.0]
    store, inbox = Store(f"sqlite:///{folder / f'corridor-{count}.db'}"), Inbox(20000)
    pipeline = Pipeline(
        Config(site="s", state_dir=folder), {name: dataclasses.replace(paper_axis(), name=name) for name in names},
        store, NoWorkers(), inbox, lambda what, axis, content: json.dumps(content, allow_nan=False),
        clock=lambda: now[0], wall=lambda: int(now[0] * 1e9),
    )  # fmt: skip
    begun = time.process_time()
    try:
        for second in range(seconds):
            for turn in range(TURNS):
                for name in names[turn::TURNS]:
                    payload, at_seq, at_t0 = payloads[name][second % len(payloads[name])]
                    struct.pack_into(">Q", payload, at_seq, second * SIZE)
                    struct.pack_into(">Q", payload, at_t0, 1000 * 10**9 + second * 10**9)
                    inbox.put(Message(f"tribowatch/s/{name}/samples", "application/cbor", bytes(payload), now[0]))
                now[0] += 1 / TURNS
                pipeline.step(0.0)
        return (time.process_time() - begun) / seconds / count
    finally:
        store.close()
        structlog.reset_defaults()
