"""From frames to samples: which frames belong to which SYNC, and what is counted on the way. Pure.

A drive latches at SYNC and sends what it latched until the next one, so the frames between two SYNCs are one sample,
stamped with the first of the two. Without SYNC on the bus (`Clock.ARRIVAL`) the frame that carries the position opens a
sample, and its arrival is the time.
"""

from __future__ import annotations

import enum
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from plant import cia402
from plant.can_axis import AxisAssembly, GapRule, Marks, Piece
from plant.can_batch import BUS_OFF, DATA, ERROR, REMOTE, Frames, batch, join
from plant.can_clock import Origin, SyncClock, Tick
from plant.can_counters import FrameCounters
from plant.can_layout import AxisLayout, show_id

HELD_FRAMES = 20_000  # that may wait for the next SYNC; two seconds of a full bus


class Clock(enum.StrEnum):
    """What makes a sample: a SYNC, or the arrival of the frame with the position."""

    SYNC = "sync"
    ARRIVAL = "arrival"


@dataclass(frozen=True, slots=True)
class TimeRule:
    """How time is told.

    Attributes:
        clock: see `Clock`.
        sync_key: of the SYNC frame.
        period: of SYNC. [s] > 0
        overflow: highest value of the SYNC counter.
        origin: what anchors the count.
        max_offset: of the count against its anchor, beyond which it is re-anchored. [s]
    """

    clock: Clock = Clock.SYNC
    sync_key: int = cia402.SYNC
    period: float = 0.01
    overflow: int = 240
    origin: Origin = Origin.HOST
    max_offset: float = 0.1


class Assembler:
    """All axes of one bus.

    Attributes:
        frames: counters of the bus.
        axes: by axis name.
        clock: the SYNC count.
    """

    def __init__(
        self, layouts: Sequence[AxisLayout], time: TimeRule | None = None, gaps: GapRule | None = None
    ) -> None:
        """Nothing seen yet; every axis has its own frames."""
        self._time = time or TimeRule()
        rule = gaps or GapRule()
        self.frames = FrameCounters()
        self.axes = {layout.axis: AxisAssembly(layout, self._time.period, rule) for layout in layouts}
        self.clock = SyncClock(
            self._time.period,
            overflow=self._time.overflow,
            origin=self._time.origin,
            max_offset=self._time.max_offset,
        )
        self._layouts = {frame.key: frame for layout in layouts for frame in layout.frames}
        self._lengths = {key: frame.length for key, frame in self._layouts.items()}
        self._heartbeats = {cia402.HEARTBEAT + axis.node: axis for axis in self.axes.values() if axis.node}
        self._emergencies = {cia402.EMCY + axis.node: axis for axis in self.axes.values() if axis.node}
        self._waiting = batch([])
        self._waiting_tick: Tick | None = None
        self._arrived = 0  # latest arrival, for stamps by arrival
        self._segment = 0

    def take(self, frames: Frames) -> list[tuple[str, Piece]]:
        """Take the next frames; give the samples that they complete, by axis."""
        wanted = self._sort(frames)
        if self._time.clock is Clock.ARRIVAL:
            return self._by_arrival(wanted)
        return self._by_sync(wanted, last=False)

    def finish(self) -> list[tuple[str, Piece]]:
        """What is left when no frame comes any more: the last sample."""
        pieces = self._by_sync(batch([]), last=True) if self._time.clock is Clock.SYNC else []
        return [*pieces, *((name, piece) for name, axis in self.axes.items() for piece in axis.judgement.finish())]

    def refused(self, axis: str) -> str | None:
        """Why nothing is sent of `axis`: the layout does not fit what the drive sends; None when all is well."""
        assembly = self.axes[axis]
        if assembly.counters.refused is not None or assembly.counters.samples:
            return assembly.counters.refused
        for (key, length), times in self.frames.wrong_length.most_common():
            frame = self._layouts[key]
            if frame in assembly.layout.frames:
                said = f"{frame.name} ({show_id(key)}): {times} frames of {length} bytes, the layout has {frame.length}"
                others = cia402.other_mappings(frame.objects, length) if frame.objects else []
                return said + (f" ({' + '.join(frame.objects)}); {' or '.join(others)} would fit" if others else "")
        return None

    # --- sorting and counting -----------------------------------------------------------------------------------

    def _sort(self, frames: Frames) -> Frames:
        """Count every frame once; keep SYNC, TIME and those with samples."""
        count = self.frames
        count.frames += len(frames)
        errors = frames.kinds == ERROR
        if errors.any():
            count.errors += int(errors.sum())
            count.bus_off += int(np.sum(frames.keys[errors] & BUS_OFF != 0))
        count.remote += int(np.sum(frames.kinds == REMOTE))
        keep = np.zeros(len(frames), dtype=bool)
        data = frames.kinds == DATA
        for key in np.unique(frames.keys[data]).tolist():
            here = data & (frames.keys == key)
            if key in self._lengths:
                keep |= self._right_length(frames, key, here)
            elif key in (self._time.sync_key, cia402.TIME):
                count.sync += int(here.sum())
                keep |= here
            elif key in self._heartbeats:
                count.status += int(here.sum())
                self._heartbeats[key].beat(frames.data[here, 0], frames.lengths[here])
            elif key in self._emergencies:
                count.status += int(here.sum())
                self._emergencies[key].alarm(frames.data[here], frames.lengths[here])
            else:
                count.unknown[key] += int(here.sum())
        return frames.take(keep)

    def _right_length(self, frames: Frames, key: int, here: NDArray[np.bool_]) -> NDArray[np.bool_]:
        right: NDArray[np.bool_] = here & (frames.lengths == self._lengths[key])
        self.frames.used += int(right.sum())
        if (wrong := here & ~right).any():
            for length, times in zip(*np.unique(frames.lengths[wrong], return_counts=True), strict=True):
                self.frames.wrong_length[key, int(length)] += int(times)
        return right

    # --- grouping -----------------------------------------------------------------------------------------------

    def _by_sync(self, fresh: Frames, last: bool) -> list[tuple[str, Piece]]:
        held = len(self._waiting)
        frames = join(self._waiting, fresh)
        marks: list[int] = []
        ticks: list[Tick] = []
        if self._waiting_tick is not None:
            marks.append(0)
            ticks.append(self._waiting_tick)
        times = np.flatnonzero((frames.keys == self._time.sync_key) | (frames.keys == cia402.TIME))
        for at in times[times >= held].tolist():
            if frames.keys[at] == cia402.TIME:
                if frames.lengths[at] >= 6:
                    self.clock.tell_time(cia402.time_of_day_ns(frames.data[at, :6].tobytes()))
                continue
            counter = int(frames.data[at, 0]) if frames.lengths[at] == 1 else None
            if (tick := self.clock.tick(int(frames.t_ns[at]), counter)) is not None:
                marks.append(at)
                ticks.append(tick)
        if not marks:
            self.frames.early += len(frames) - len(times)
            return []
        if self._waiting_tick is None:
            self.frames.early += int(np.sum(~np.isin(np.arange(marks[0]), times)))
        if last:
            self._waiting, self._waiting_tick = batch([]), None
            return self._assemble(frames, Marks.of([*marks, len(frames)], ticks))
        self._waiting, self._waiting_tick = frames.take(slice(marks[-1], None)), ticks[-1]
        if len(self._waiting) > HELD_FRAMES:  # SYNC has died, the drives have not
            self.frames.early += len(self._waiting) - 1
            self._waiting = self._waiting.take(slice(0, 1))
        return self._assemble(frames, Marks.of(marks, ticks[:-1])) if len(marks) > 1 else []

    def _assemble(self, frames: Frames, marks: Marks) -> list[tuple[str, Piece]]:
        for axis in self.axes.values():
            axis.judgement.note_clock(self.clock.judged, self.clock.misfit)
        return [(name, piece) for name, axis in self.axes.items() for piece in axis.take(frames, marks)]

    def _by_arrival(self, fresh: Frames) -> list[tuple[str, Piece]]:
        """Every axis by its own clock: the frame with the position opens a sample."""
        pieces: list[tuple[str, Piece]] = []
        for name, axis in self.axes.items():
            pieces += [(name, piece) for piece in axis.take_by_arrival(fresh)]
        return pieces
