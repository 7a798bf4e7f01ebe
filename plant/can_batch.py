"""Frames in batches: arrays of ids, stamps, lengths and bytes. Pure."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from plant.can_layout import Bytes

DATA, ERROR, REMOTE = 0, 1, 2  # kinds of frames
BUS_OFF = 0x40  # class bit in the id of an error frame, as Linux gives it

RawFrame = tuple[int, int, int, bytes | bytearray]
"""Kind, key (see `can_layout.frame_key`; the class bits of an error frame), arrival [ns], data."""


@dataclass(frozen=True, slots=True, eq=False)
class Frames:
    """A batch of n frames in the order of their arrival.

    Attributes:
        kinds: DATA, ERROR or REMOTE. (n,)
        keys: (n,)
        t_ns: arrival, Unix time. [ns] (n,)
        lengths: [bytes] (n,)
        data: zero beyond a frame's length. (n, widest)
    """

    kinds: NDArray[np.uint8]
    keys: NDArray[np.int64]
    t_ns: NDArray[np.int64]
    lengths: NDArray[np.int64]
    data: Bytes

    def __len__(self) -> int:
        """Count the frames."""
        return len(self.keys)

    def take(self, which: NDArray[np.bool_] | NDArray[np.intp] | slice) -> Frames:
        """Some of them."""
        return Frames(self.kinds[which], self.keys[which], self.t_ns[which], self.lengths[which], self.data[which])


def batch(frames: Iterable[RawFrame]) -> Frames:
    """Make a batch of single frames."""
    listed = list(frames)
    if not listed:
        none = np.zeros(0, dtype=np.int64)
        return Frames(np.zeros(0, dtype=np.uint8), none, none, none, np.zeros((0, 8), dtype=np.uint8))
    kinds, keys, stamps, data = zip(*listed, strict=True)
    lengths = np.fromiter(map(len, data), dtype=np.int64, count=len(data))
    width = max(8, int(lengths.max()))
    joined = b"".join([one.ljust(width, b"\0") for one in data])
    return Frames(
        np.array(kinds, dtype=np.uint8),
        np.array(keys, dtype=np.int64),
        np.array(stamps, dtype=np.int64),
        lengths,
        np.frombuffer(joined, dtype=np.uint8).reshape(len(data), width),
    )


def join(*parts: Frames) -> Frames:
    """One after the other."""
    filled = [part for part in parts if len(part)]
    if len(filled) < 2:
        return filled[0] if filled else batch([])
    width = max(part.data.shape[1] for part in filled)
    return Frames(
        np.concatenate([part.kinds for part in filled]),
        np.concatenate([part.keys for part in filled]),
        np.concatenate([part.t_ns for part in filled]),
        np.concatenate([part.lengths for part in filled]),
        np.concatenate([np.pad(part.data, ((0, 0), (0, width - part.data.shape[1]))) for part in filled]),
    )
