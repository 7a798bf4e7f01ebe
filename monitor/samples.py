"""What the windows of a stream are made of: samples, gaps, windows, and what must survive a restart. Pure."""

from __future__ import annotations

import dataclasses
import enum
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from plant.recording import Floats

Stamps = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """Consecutive samples as the machine sent them; a slice of a block.

    Attributes:
        epoch: grows when the publisher starts anew.
        seq: number of the first sample in its epoch.
        t_ns: Unix time, UTC. [ns] (n,)
        drive: torque [N·m], or force [N] where `is_force`. (n,)
        position: [m or rad] (n,)
        velocity: [m/s or rad/s] (n,) or None
        temperature: [degC] (n,) or None
        load: [kg or 1] (n,) or None
    """

    epoch: int
    seq: int
    t_ns: Stamps
    drive: Floats
    position: Floats
    is_force: bool = False
    velocity: Floats | None = None
    temperature: Floats | None = None
    load: Floats | None = None

    def __len__(self) -> int:
        """Count the samples."""
        return len(self.t_ns)

    @property
    def end(self) -> int:
        """Number of the sample after the last."""
        return self.seq + len(self)

    def cut(self, first: int, end: int) -> Samples:
        """Samples numbered `first` to `end` (exclusive)."""
        part = slice(first - self.seq, end - self.seq)
        names = ("t_ns", "drive", "position", "velocity", "temperature", "load")
        cuts = {name: values[part] for name in names if (values := getattr(self, name)) is not None}
        return dataclasses.replace(self, seq=first, **cuts)


class GapKind(enum.StrEnum):
    """Why a segment ended before its successor began."""

    MISSING = "missing"  # sent, never received
    JOINED_LATE = "joined_late"  # sent in this epoch before anything was received
    PAUSE = "pause"  # nothing missing by number, but the stamps jump: the machine sends in bursts
    EPOCH = "epoch"  # the publisher started anew; what it did in between is unknown


@dataclass(frozen=True, slots=True)
class Gap:
    """A break in the stream: samples `from_seq` to `to_seq` (exclusive) were not received.

    `from_ns` is the last stamp before the break (None if there was none), `to_ns` the first after it. [ns]
    For `EPOCH`, `epoch` and `from_seq` tell where the old epoch ended; how many were lost is unknown.
    """

    kind: GapKind
    epoch: int
    from_seq: int
    to_seq: int
    from_ns: int | None
    to_ns: int

    @property
    def missing(self) -> int:
        """Samples known to be missing."""
        return self.to_seq - self.from_seq


@dataclass(frozen=True, slots=True, order=True)
class WindowId:
    """Which samples of an axis make a window: `samples` raw samples of `epoch` from number `first_seq` on."""

    epoch: int
    first_seq: int
    samples: int


@dataclass(frozen=True, slots=True)
class Window:
    """A complete window: its identity and the stamps of its first and last sample. [ns]"""

    id: WindowId
    start_ns: int
    end_ns: int


@dataclass(frozen=True, slots=True)
class WindowRule:
    """How one axis is cut.

    Attributes:
        samples: raw samples of a window.
        hop: raw samples from one window's start to the next.
        sample_time_ns: nominal; 0 = take each block's own median step. [ns]
        patience: how long blocks wait for missing ones before them, since the last that came in order.
            [s, on the caller's clock]
        held_blocks, held_samples: what may wait at once; more, and the gap is declared.
        silence: of the current epoch, before an earlier one is believed; and how long a stray waits for a second
            message that bears it out. [s, on the same clock]
    """

    samples: int
    hop: int
    sample_time_ns: int = 0
    patience: float = 2.0
    held_blocks: int = 256
    held_samples: int = 200_000
    silence: float = 10.0


@dataclass(frozen=True, slots=True)
class StreamState:
    """What must survive a restart for the windows to come out the same.

    Attributes:
        epoch: current epoch; -1 before the first block.
        next_seq: number of the first sample not yet settled; -1 while the epoch's start is still open.
        last_ns: stamp of the last received sample, None before the first. [ns]
        segment_seq: first sample of the current segment.
        starts: (number, stamp [ns]) of the windows begun in this segment and not complete.
        sure: more than one message of the epoch was received.
        former: (epoch, next number) of epochs that were current before, any of which may yet go on.
        floor: the latest epoch that may not, nor any before it.
    """

    epoch: int = -1
    next_seq: int = -1
    last_ns: int | None = None
    segment_seq: int = 0
    starts: tuple[tuple[int, int], ...] = ()
    sure: bool = True
    former: tuple[tuple[int, int], ...] = ()
    floor: int = -1

    def needed_from(self) -> tuple[int, int]:
        """(epoch, number) of the oldest received sample that a future window may need."""
        return self.epoch, self.starts[0][0] if self.starts else self.next_seq


@dataclass(slots=True)
class Outcome:
    """What one call decided; the caller stores and counts it.

    Samples that were not taken are counted as `duplicates`, `late` (of a gap already declared), `old_epoch`,
    `stray_epoch` (a later epoch that never came to more than one message) and `stray_seq` (a message whose number and
    stamps contradict each other, and which no other continues); `splinters` are pauses after fewer than `SPLINTER`.
    """

    accepted: list[Samples] = field(default_factory=list)
    windows: list[Window] = field(default_factory=list)
    gaps: list[Gap] = field(default_factory=list)
    duplicates: int = 0
    late: int = 0
    old_epoch: int = 0
    stray_epoch: int = 0
    stray_seq: int = 0
    splinters: int = 0
