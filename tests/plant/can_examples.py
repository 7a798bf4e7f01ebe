"""Frames of a CiA 402 drive, made by the standard library alone: no code of ours encodes them."""

import struct

import numpy as np

from plant.can_batch import DATA, batch
from plant.cia402 import DEFAULT_TPDO1, Scaling, layout

MS = 1_000_000
START = 1_767_225_600 * 10**9
SCALING = Scaling(counts_per_unit=1e6, rated_torque=8.0)
ENABLED = 0x0637


def drive(axis="axis-1", node=1, pdos=((0, DEFAULT_TPDO1),), scaling=SCALING):
    return layout(axis, node, pdos, scaling)


def sync(at, counter=None):
    return DATA, 0x80, at, b"" if counter is None else bytes([counter])


def pdo(at, position, torque, node=1, status=0x0627):
    """TPDO1: statusword, position in counts, torque in per mille."""
    return DATA, 0x180 + node, at, struct.pack("<Hih", status, position, torque)


def cycle(number, period=10 * MS, counter=True, nodes=(1,), start=START, jitter=0):
    """SYNC `number` and what the drives answer."""
    at = start + number * period + jitter
    yield sync(at, number % 240 + 1 if counter else None)
    for node in nodes:
        yield pdo(at + node * MS // 4, 1000 * node + number, number % 100 - 50, node)


def cycles(numbers, **more):
    return [frame for number in numbers for frame in cycle(number, **more)]


def collect(assembler, frames, size=None):
    """All samples of all axes when the frames come in batches of `size`; as (seq, t_ns, channels) by axis."""
    frames, size = list(frames), size or max(1, len(frames))
    pieces = []
    for first in range(0, len(frames), size):
        pieces += assembler.take(batch(frames[first : first + size]))
    pieces += assembler.finish()
    found = {}
    for name in assembler.axes:
        mine = [piece for axis, piece in pieces if axis == name]
        if not mine:
            continue
        seq = np.concatenate([piece.seq + np.arange(len(piece)) for piece in mine])
        stamps = np.concatenate([piece.t_ns for piece in mine])
        channels = {k: np.concatenate([piece.channels[k] for piece in mine]) for k in mine[0].channels}
        found[name] = seq, stamps, channels
    return found
