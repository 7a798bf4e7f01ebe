"""Hostile payloads by the million through the daemon's intake: none trips it, each is counted, neighbours are served.

`python -m tests.scenarios.fuzz [COUNT] [SEED]` (`make fuzz`) prints what became of them as JSON; exit code 1 where
something is wrong. The pipeline is the daemon's own, with database and journal; only the wire is left out, so that a
million payloads take minutes.
"""

import collections
import dataclasses
import json
import struct
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import structlog

from monitor.config import Config
from monitor.inbox import Inbox, Message
from monitor.pipeline import Pipeline
from monitor.store import Store
from plant.presets import paper_axis
from plant.wire import CBOR, JSON, REASONS, encode_block
from tests.scenarios.harness import START_NS, blocks_of, burst

KINDS = ("flipped bytes", "truncated", "spliced", "garbage", "wrong tag", "huge length", "deep nesting", "flipped text",
         "json nonsense", "numbers beyond", "wrong axis", "old epoch", "replayed", "far ahead", "unknown encoding",
         "too large", "valid with NaN")  # fmt: skip
TURN = 100  # payloads between two turns of the pipeline


class NoWorkers:
    """Windows stay waiting: this is about the intake."""

    free = busy = 0

    def collect(self):
        return []


class Attacker:
    """Makes payloads of every kind from good ones."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        torque, position = burst(paper_axis(), samples=400)
        self.blocks = list(blocks_of("victim", 5, 0, START_NS, torque, position, size=20))
        self.cbor = [encode_block(block) for block in self.blocks]
        self.text = [encode_block(block, JSON) for block in self.blocks]

    def make(self, kind: str) -> tuple[str, bytes]:
        """An encoding and a payload."""
        rng = self.rng
        good = self.cbor[int(rng.integers(len(self.cbor)))]
        text = self.text[int(rng.integers(len(self.text)))]
        at = int(rng.integers(1, len(good)))
        match kind:
            case "flipped bytes":
                return CBOR, self._flip(good)
            case "flipped text":
                return JSON, self._flip(text)
            case "truncated":
                return (CBOR, good[:at]) if rng.random() < 0.5 else (JSON, text[:at])
            case "spliced":
                other = self.cbor[int(rng.integers(len(self.cbor)))]
                return CBOR, good[:at] + other[int(rng.integers(len(other))) :]
            case "garbage":
                return (CBOR, JSON)[int(rng.integers(2))], rng.bytes(int(rng.integers(0, 400)))
            case "wrong tag":
                return CBOR, good.replace(b"\xd8\x56", b"\xd8" + rng.bytes(1), 1)
            case "huge length":
                size = struct.pack(">Q", int(rng.integers(2**20, 2**63)))
                return CBOR, good.replace(b"\xd8\x56\x58", b"\xd8\x56\x5b" + size, 1)
            case "deep nesting":
                return (CBOR, b"\x81" * 5000) if rng.random() < 0.5 else (JSON, b"[" * 5000)
            case "json nonsense":
                return JSON, text.replace(b":1,", (b":NaN,", b":1e999,", b":{},", b":-0,")[int(rng.integers(4))], 1)
            case "numbers beyond":
                changed = {**json.loads(text), "epoch": 5, "seq": int(rng.choice([-1, 2**63, 2**64, 2**62]))}
                return JSON, json.dumps(changed).encode()
            case "wrong axis":
                return CBOR, good.replace(b"victim", b"beside")
            case "old epoch":
                return JSON, text.replace(b'"epoch":5', b'"epoch":4')
            case "replayed":
                return CBOR, good
            case "far ahead":
                changed = {**json.loads(text), "seq": int(rng.integers(1000, 10**12))}
                return JSON, json.dumps(changed).encode()
            case "unknown encoding":
                return "application/" + "x" * int(rng.integers(0, 200)), good
            case "too large":
                return CBOR, bytes(1_000_001)
        content = json.loads(text)
        content["position"] = [None] * len(content["position"])
        return JSON, json.dumps(content).encode()

    def _flip(self, good: bytes) -> bytes:
        payload = bytearray(good)
        for at in self.rng.integers(0, len(payload), int(self.rng.integers(1, 8))):
            payload[at] = int(self.rng.integers(256))
        return bytes(payload)


def resident() -> float:
    """Memory of this process. [MB]"""
    words = Path("/proc/self/statm").read_text().split()
    return int(words[1]) * 4096 / 2**20


def run(folder: Path, count: int, seed: int = 0) -> dict:
    """Send `count` hostile payloads to one axis and good ones to its neighbour."""
    structlog.configure(wrapper_class=structlog.make_filtering_bound_logger(50))
    now = [1000.0]
    store, inbox = Store(f"sqlite:///{folder / 'fuzz.db'}"), Inbox(20000)
    axes = {name: dataclasses.replace(paper_axis(), name=name) for name in ("victim", "beside")}
    config = Config(site="s", state_dir=folder, history={"keep_raw_windows": 0})
    pipeline = Pipeline(config, axes, store, NoWorkers(), inbox, lambda *_: None,
                        clock=lambda: now[0], wall=lambda: START_NS + int(now[0] * 1e9))  # fmt: skip
    attacker, sent = Attacker(seed), collections.Counter()
    torque, position = burst(paper_axis(), samples=2000)
    beside = memory = 0
    begun, key = time.process_time(), "tribowatch/s/{}/samples".format
    try:
        for number in range(count):
            kind = KINDS[number % len(KINDS)]
            inbox.put(Message(key("victim"), *attacker.make(kind), now[0]))
            sent[kind] += 1
            if number % TURN == TURN - 1:
                for block in blocks_of("beside", 1, beside, START_NS + beside * 10**7, torque[:20], position[:20], 20):
                    inbox.put(Message(key("beside"), CBOR, encode_block(block), now[0]))
                    beside += 20
                now[0] += 0.1
                pipeline.step(0.0)
                pipeline.fleet.runs["victim"].waiting.clear()  # nobody answers here
            if number == count // 5:
                memory = resident()
        now[0] += 10.0
        pipeline.step(0.0)
        pipeline.drain()
        victim, neighbour = pipeline.runs["victim"].record, pipeline.runs["beside"].record
        payloads = sum(victim.rejected.get(reason, 0) for reason in (*REASONS, "wrong_axis"))
        return {
            "sent": count,
            "kinds": dict(sent),
            "refused_payloads": payloads,
            "rejected": dict(sorted(victim.rejected.items())),
            "internal_errors": victim.rejected.get("internal_error", 0) + neighbour.rejected.get("internal_error", 0),
            "taken_samples": victim.samples,
            "neighbour_sent": beside,
            "neighbour_received": neighbour.samples,
            "neighbour_missing": neighbour.missing,
            "neighbour_rejected": neighbour.rejected,
            "memory_mb": round(resident(), 1),
            "memory_grown_mb": round(resident() - memory, 1),
            "microseconds_each": round(1e6 * (time.process_time() - begun) / count, 1),
        }
    finally:
        store.close()
        structlog.reset_defaults()


def wrong(row: dict, grown_mb: float) -> list[str]:
    """What is not as it must be."""
    checks = {
        "internal errors": row["internal_errors"] == 0,
        "neighbour": row["neighbour_received"] == row["neighbour_sent"] and not row["neighbour_rejected"],
        "memory": row["memory_grown_mb"] < grown_mb,
        "counted": row["refused_payloads"] >= 0.6 * row["sent"],
        "old epochs": row["rejected"].get("old_epoch", 0) >= 20 * (row["kinds"]["old epoch"] - 10),
    }
    return [name for name, good in checks.items() if not good]


def main() -> int:
    words = sys.argv[1:]
    count, seed = int(words[0]) if words else 1_000_000, int(words[1]) if len(words) > 1 else 0
    with tempfile.TemporaryDirectory() as folder:
        row = run(Path(folder), count, seed)
    row["wrong"] = wrong(row, 30.0)
    sys.stdout.write(json.dumps(row, indent=1) + "\n")
    return 1 if row["wrong"] else 0


if __name__ == "__main__":
    sys.exit(main())
