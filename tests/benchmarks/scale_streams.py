"""Many axes at 100 Hz from one process that costs next to nothing: ready payloads with two numbers patched in.

The motion repeats after 2000 samples and obeys eq. (5) with the paper's axis, so that windows can be identified.
"""

import struct
import threading
import time

import cbor2
import numpy as np
import zenoh

from plant import keys
from plant.friction import StribeckFriction
from plant.presets import paper_axis, paper_friction

STEP = 0.01
PERIOD, SIZE = 2000, 100
MARK_SEQ, MARK_T0 = 0x1122334455667788, 0x1122334455667799  # eight bytes in the head, found and patched


def motion(law: StribeckFriction, seed: int = 0):
    """Torque [N·m] and position [m] of one period: three sines, the force by the inverse model."""
    axis = paper_axis()
    t = STEP * np.arange(PERIOD)
    turn = 2 * np.pi * t / (PERIOD * STEP)
    waves = ((3, 0.25), (8, 0.06), (17, 0.02))
    y = 1.0 + sum(a * np.sin(k * turn) for k, a in waves)
    rate = 2 * np.pi / (PERIOD * STEP)
    v = sum(a * k * rate * np.cos(k * turn) for k, a in waves)
    acceleration = -sum(a * (k * rate) ** 2 * np.sin(k * turn) for k, a in waves)
    mechanics = axis.mechanics
    force = mechanics.moving_mass * acceleration + mechanics.weight + law.force(v)
    rng = np.random.default_rng(seed)
    return force / mechanics.gain, np.round((y + 1e-5 * rng.standard_normal(PERIOD)) / 1e-5) * 1e-5


def templates(name: str, epoch: int, torque, position) -> list[tuple[bytearray, int, int]]:
    """The payloads of one period, with the places of seq and t0."""
    made = []
    for first in range(0, PERIOD, SIZE):
        part = slice(first, first + SIZE)
        payload = bytearray(
            cbor2.dumps(
                {
                    "v": 1, "axis": name, "epoch": epoch, "seq": MARK_SEQ, "t0_ns": MARK_T0, "dt_ns": round(STEP * 1e9),
                    "torque": cbor2.CBORTag(85, torque[part].astype("<f4").tobytes()),
                    "position": cbor2.CBORTag(86, position[part].astype("<f8").tobytes()),
                }
            )
        )  # fmt: skip
        places = [payload.index(struct.pack(">Q", mark)) for mark in (MARK_SEQ, MARK_T0)]
        made.append((payload, *places))
    return made


class Stream:
    """One axis: its next block, ready to send."""

    def __init__(self, session: zenoh.Session, site: str, name: str, waves: list, epoch: int) -> None:
        self.publisher = session.declare_publisher(
            keys.samples_key(site, name), encoding="application/cbor",
            congestion_control=zenoh.CongestionControl.BLOCK,
        )  # fmt: skip
        self.kinds = [templates(name, epoch, *wave) for wave in waves]
        self.kind = self.seq = 0

    def send(self, last_ns: int) -> None:
        """Send the next block; its last sample was measured at `last_ns`."""
        payload, at_seq, at_t0 = self.kinds[self.kind][self.seq // SIZE % (PERIOD // SIZE)]
        struct.pack_into(">Q", payload, at_seq, self.seq)
        struct.pack_into(">Q", payload, at_t0, last_ns - (SIZE - 1) * round(STEP * 1e9))
        self.publisher.put(bytes(payload))
        self.seq += SIZE


class Generator(threading.Thread):
    """Sends a block a second of every axis, evenly spread over the second, on the axes' own true clock."""

    def __init__(self, session: zenoh.Session, site: str, names: list[str], worn_from: float, worn: int) -> None:
        super().__init__(daemon=True)
        law = paper_friction()
        more = StribeckFriction(1.8 * law.coulomb_force, 1.8 * law.static_force, law.stribeck_velocity,
                                law.viscous_coefficient)  # fmt: skip
        waves = [motion(law), motion(more)]
        epoch = time.time_ns()
        self.streams = [Stream(session, site, name, waves, epoch) for name in names]
        self.worn_from, self.worn = worn_from, worn
        self.stop = threading.Event()
        self.late = 0.0

    def run(self) -> None:
        begun, begun_ns = time.monotonic(), time.time_ns()
        turn = 0
        while not self.stop.is_set():
            for k, stream in enumerate(self.streams):
                due = turn + (k + 1) / len(self.streams)
                if (pause := begun + due - time.monotonic()) > 0:
                    time.sleep(pause)
                self.late = max(self.late, -pause)
                if k < self.worn and due > self.worn_from:
                    stream.kind = 1
                stream.send(begun_ns + round(due * 1e9))
            turn += 1
