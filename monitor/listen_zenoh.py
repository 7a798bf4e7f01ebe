"""Listening to an axis' stream for a while: what came, as a recording in SI, and what was refused."""

from __future__ import annotations

import queue
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import zenoh

from plant import keys
from plant.axis import Axis
from plant.errors import PayloadError
from plant.recording import Recording
from plant.wire import Block, decode_block

MOST_BLOCKS = 10_000


@dataclass(slots=True)
class Heard:
    """What came: blocks that could be read, and the reasons of those that could not."""

    blocks: list[Block] = field(default_factory=list)
    refused: Counter[str] = field(default_factory=Counter)
    dropped: int = 0


def listen(
    session: zenoh.Session,
    site: str,
    axis_name: str,
    seconds: float,
    *,
    prefix: str = keys.PREFIX,
    progress: Callable[[float], None] | None = None,
) -> Heard:
    """Receive the blocks of one axis for `seconds` of wall time; `progress` is told the seconds that passed."""
    heard, waiting = Heard(), queue.Queue[tuple[bytes, str]](MOST_BLOCKS)

    def keep(sample: zenoh.Sample) -> None:
        try:
            waiting.put_nowait((sample.payload.to_bytes(), str(sample.encoding)))
        except queue.Full:
            heard.dropped += 1

    began = time.monotonic()
    with session.declare_subscriber(keys.samples_key(site, axis_name, prefix), keep):
        while (passed := time.monotonic() - began) < seconds:
            if progress:
                progress(passed)
            time.sleep(min(0.1, seconds - passed))
    while not waiting.empty():
        try:
            block = decode_block(*waiting.get_nowait())
        except PayloadError as error:
            heard.refused[error.reason] += 1
            continue
        if block.axis == axis_name:
            heard.blocks.append(block)
        else:
            heard.refused["wrong_axis"] += 1
    return heard


def as_recording(heard: Heard, axis: Axis) -> Recording | None:
    """The samples of the epoch with most of them, in order, as force at the belt; None for none."""
    if not heard.blocks:
        return None
    counts: Counter[int] = Counter()
    for block in heard.blocks:
        counts[block.epoch] += len(block)
    epoch = max(counts, key=lambda one: (counts[one], one))
    ordered = sorted((block for block in heard.blocks if block.epoch == epoch), key=lambda block: block.seq)
    first, *rest = ordered
    kept = [first]
    for block in rest:
        if block.seq >= kept[-1].seq + len(kept[-1]) and block.channels() == first.channels():
            kept.append(block)

    def joined(name: str) -> np.ndarray[tuple[int], np.dtype[np.float64]] | None:
        if getattr(first, name) is None:
            return None
        return np.concatenate([np.asarray(getattr(block, name), dtype=np.float64) for block in kept])

    torque, force, position = joined("torque"), joined("force"), joined("position")
    stamps = np.concatenate([block.t_ns for block in kept])
    drive = force if torque is None else torque * axis.mechanics.gain
    if drive is None or position is None:  # a decoded block always has both
        return None
    return Recording(
        t=(stamps - stamps[0]) * 1e-9,
        force=drive,
        position=position,
        velocity=joined("velocity"),
        temperature=joined("temperature"),
        load=joined("load"),
        sample_time=axis.stream.sample_time,
        hold=axis.stream.hold,
        source=f"stream of {axis.name}, epoch {epoch}",
    )
