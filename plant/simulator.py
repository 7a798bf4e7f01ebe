"""The machine on the wire: publishes a scenario in time-lapse. It holds the wall clock; all else is in `scenario`.

Stamps are those of the scenario (event time); the pace says when a block leaves: when its last sample has happened,
so that at speed 1 the stream is that of the machine.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from plant.errors import ParameterError
from plant.scenario import NANOSECONDS, Burst, Scenario
from plant.wire import Block

BLOCK_SAMPLES = 500  # 5 s at 100 Hz: a burst of the paper in four blocks of 12 kB


class BlockSink(Protocol):
    """Where blocks go: a `SamplePublisher`, or a list in a test.

    Attributes:
        epoch: of the stream.
        next_seq: index of the next sample in the epoch.
    """

    epoch: int
    next_seq: int

    def put(self, block: Block) -> object:
        """Send one block."""
        ...


@dataclass(frozen=True, slots=True)
class Published:
    """What was sent.

    Attributes:
        bursts: complete ones.
        blocks: of them.
        samples: of them.
        epoch: of the stream.
        seconds: of wall clock. [s]
        interrupted: True when `stop` was set before the end.
    """

    bursts: int
    blocks: int
    samples: int
    epoch: int
    seconds: float
    interrupted: bool


def burst_blocks(
    burst: Burst, axis: str, gain: float, epoch: int, seq: int, block_samples: int = BLOCK_SAMPLES
) -> Iterator[Block]:
    """Cut a burst into the blocks that a drive would send: torque at the motor, stamps in Unix time.

    Args:
        burst: as the scenario gives it.
        axis: its name.
        gain: `Mechanics.gain`. [N per N·m]
        epoch: of the stream.
        seq: index of the burst's first sample in the epoch.
        block_samples: longest block. [samples]
    """
    recording = burst.recording
    stamps = burst.begin_ns + np.round(recording.t * NANOSECONDS).astype(np.int64)
    for first in range(0, len(stamps), block_samples):
        rows = slice(first, first + block_samples)
        others = {name: getattr(recording, name)[rows] for name in recording.channels() if name not in ("t", "force")}
        yield Block(axis, epoch, seq + first, stamps[rows], torque=recording.force[rows] / gain, **others)


def bursts_per_second_as_speed(scenario: Scenario, bursts_per_second: float) -> float:
    """Speed that sends so many bursts in a second. [event seconds per second]"""
    if not bursts_per_second > 0:
        raise ParameterError("bursts per second", bursts_per_second, "> 0", "1/s")
    return bursts_per_second * scenario.bursts.interval_hours * 3600.0


def publish_scenario(
    scenario: Scenario,
    sink: BlockSink,
    *,
    speed: float | None = None,
    first: int = 0,
    last: int | None = None,
    stop: threading.Event | None = None,
    on_burst: Callable[[Burst], None] | None = None,
) -> Published:
    """Publish bursts `first` to `last` (excluded) of `scenario` in their order.

    Args:
        scenario: what happens.
        sink: takes the blocks; samples are numbered on from its `next_seq`.
        speed: event seconds per second of wall clock; None sends as fast as the sink takes. > 0
        first: number of the first burst.
        last: number after the last burst; None goes on to the end.
        stop: set by others to end early, after the block on its way.
        on_burst: called after each burst, which may wait until the receiver has caught up.

    Raises:
        ParameterError: speed not above 0.
    """
    if speed is not None and not speed > 0:
        raise ParameterError("speed", speed, "> 0", "event seconds per second")
    stop = stop or threading.Event()
    name, gain = scenario.axis.name, scenario.axis.mechanics.gain
    begin, bursts, blocks, samples = time.monotonic(), 0, 0, 0
    seq = sink.next_seq
    origin = scenario.begin_ns(first)
    for number in range(first, len(scenario) if last is None else min(last, len(scenario))):
        burst = scenario.burst(number)
        for block in burst_blocks(burst, name, gain, sink.epoch, seq + samples):
            due = 0.0 if speed is None else (int(block.t_ns[-1]) - origin) / NANOSECONDS / speed
            if stop.wait(max(0.0, begin + due - time.monotonic())):
                return Published(bursts, blocks, samples, sink.epoch, time.monotonic() - begin, True)
            sink.put(block)
            blocks += 1
            samples += len(block)
        bursts += 1
        if on_burst:
            on_burst(burst)
    return Published(bursts, blocks, samples, sink.epoch, time.monotonic() - begin, False)
