"""One axis of a CAN bus: its frames of each SYNC become numbered samples in SI, gaps are filled or counted. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from plant import cia402
from plant.can_batch import Frames, batch, join
from plant.can_clock import Tick
from plant.can_counters import AxisCounters
from plant.can_judgement import Judgement
from plant.can_layout import AxisLayout, Bytes, Frame, Signal, decode_signal, raw_values
from plant.recording import Floats
from plant.wire import Stamps
from plant.wire_rules import CHANNELS

Indices = NDArray[np.int64]
BACKWARDS = 10**9  # ns; a stamp that is so much earlier comes from a clock that was set back


@dataclass(frozen=True, slots=True)
class GapRule:
    """What becomes of samples that are missing while SYNC lives.

    Attributes:
        fill: so many in a row go out as NaN. [samples] >= 0
        absent: longer than this the drive was off: nothing is lost. [s]
        judge: look at the first samples before any is sent (see `can_widths`).
    """

    fill: int = 2
    absent: float = 10.0
    judge: bool = True


@dataclass(frozen=True, slots=True, eq=False)
class Marks:
    """Where samples begin: rows `at[k]` to `at[k+1]` of a batch are sample k. (k+1,), the rest (k,)"""

    at: NDArray[np.int64]
    index: Indices
    t_ns: Stamps
    segment: Indices

    @classmethod
    def of(cls, at: Sequence[int], ticks: Sequence[Tick]) -> Self:
        """Marks of ticks, one fewer than places."""
        columns = np.array([(tick.index, tick.t_ns, tick.segment) for tick in ticks], dtype=np.int64).reshape(-1, 3)
        return cls(np.array(at, dtype=np.int64), columns[:, 0], columns[:, 1], columns[:, 2])


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """Consecutive samples: number of the first, stamps [ns], channels in SI, and the segment they belong to."""

    seq: int
    t_ns: Stamps
    channels: dict[str, Floats]
    segment: int

    def __len__(self) -> int:
        """Count the samples."""
        return len(self.t_ns)


class AxisAssembly:
    """The state of one axis between two batches."""

    def __init__(self, layout: AxisLayout, period: float, rule: GapRule) -> None:
        """Nothing seen yet."""
        self.layout, self.node, self.counters = layout, layout.node, AxisCounters()
        self.next_seq = 0
        self.judgement = Judgement(self.counters, rule.judge, period)
        self._rule = rule
        self._absent = round(rule.absent / period)
        self._sent = tuple(name for name in layout.channels() if name in CHANNELS)
        self._held: dict[Frame, Bytes] = {}  # latest payload of frames that need not come with every sample
        self._last: tuple[int, int, int] | None = None  # index, stamp, segment of the last sample
        self._waiting = batch([])  # by arrival: frames of the sample that is not complete yet
        self._arrived = -(2**62)
        self._segment = 0
        self._number = 0

    # --- status -------------------------------------------------------------------------------------------------

    def beat(self, states: Bytes, lengths: Indices) -> None:
        """Take heartbeats."""
        good = states[lengths == 1] & 0x7F
        if len(good):
            self.counters.heartbeats += len(good)
            self.counters.boot_ups += int(np.sum(good == cia402.BOOT_UP))
            started = np.any(good != cia402.OPERATIONAL) or self.counters.nmt not in (None, cia402.NMT_STATES[5])
            if started:  # mapped anew?
                self.judgement.anew()
            self.counters.nmt = cia402.NMT_STATES.get(int(good[-1]), f"unknown ({int(good[-1])})")

    def alarm(self, data: Bytes, lengths: Indices) -> None:
        """Take emergencies."""
        codes = data[lengths == 8, 0].astype(np.int64) | data[lengths == 8, 1].astype(np.int64) << 8
        for code, times in zip(*np.unique(codes, return_counts=True), strict=True):
            self.counters.emergencies[int(code)] += int(times)
        if (faults := codes[codes != 0]).size:
            self.counters.last_emergency = int(faults[-1])

    # --- samples ------------------------------------------------------------------------------------------------

    def take(self, frames: Frames, marks: Marks) -> list[Piece]:
        """Give the samples between `marks`."""
        count = len(marks.index)
        present = np.ones(count, dtype=bool)
        payloads: dict[Frame, tuple[NDArray[np.bool_], Bytes]] = {}
        for frame in self.layout.frames:
            rows = _rows_of(frame, frames)
            rows = rows[(rows >= marks.at[0]) & (rows < marks.at[-1])]
            groups = np.searchsorted(marks.at, rows, side="right") - 1
            if frame.is_sampled:
                there, payload = self._once(frame, frames, rows, groups, count)
                present &= there
            else:
                there, payload = self._latest(frame, frames, rows, marks.at)
            payloads[frame] = there, payload
        values = self._decode(payloads, present)
        return self._number_samples(marks, present, values)

    def _once(
        self, frame: Frame, frames: Frames, rows: NDArray[np.intp], groups: NDArray[np.intp], count: int
    ) -> tuple[NDArray[np.bool_], Bytes]:
        """The first frame of each sample; more are duplicates."""
        found, first = np.unique(groups, return_index=True)
        self.counters.duplicates += len(groups) - len(found)
        there = np.zeros(count, dtype=bool)
        there[found] = True
        payload = np.zeros((count, frame.length), dtype=np.uint8)
        payload[found] = frames.data[rows[first], : frame.length]
        return there, payload

    def _latest(
        self, frame: Frame, frames: Frames, rows: NDArray[np.intp], at: Indices
    ) -> tuple[NDArray[np.bool_], Bytes]:
        """The latest frame up to the end of each sample."""
        held = self._held.get(frame)
        known = frames.data[rows, : frame.length]
        which = np.searchsorted(rows, at[1:], side="left") - 1
        if held is not None:
            known, which = np.concatenate([held, known]), which + 1
        if len(known):
            self._held[frame] = known[-1:].copy()
        there = which >= 0
        payload = np.zeros((len(which), frame.length), dtype=np.uint8)
        payload[there] = known[which[there]]
        return there, payload

    def _decode(
        self, payloads: dict[Frame, tuple[NDArray[np.bool_], Bytes]], present: NDArray[np.bool_]
    ) -> dict[str, Floats]:
        values: dict[str, Floats] = {}
        raw: dict[str, tuple[Signal, NDArray[np.int64] | Floats]] = {}
        for frame in self.layout.frames:
            there, payload = payloads[frame]
            for signal in frame.signals:
                if signal.channel in CHANNELS:
                    column = decode_signal(signal, payload)
                    values[signal.channel] = np.where(there & present & np.isfinite(column), column, np.nan)
                if signal.channel in ("statusword", "position", "torque", "force", "velocity"):
                    raw[signal.channel] = signal, raw_values(signal, payload)[present & there]
        self._watch(raw)
        return values

    def _watch(self, raw: dict[str, tuple[Signal, NDArray[np.int64] | Floats]]) -> None:
        """Keep the drive's state; keep the first counts for the judgement."""
        if "statusword" in raw and len(words := raw["statusword"][1].astype(np.int64)):
            self.counters.state = cia402.drive_state(int(words[-1])) or f"unknown (0x{int(words[-1]):04X})"
            self.counters.unknown_states += int(np.sum(~cia402.known_states(words)))
        self.judgement.watch(raw)

    def _number_samples(self, marks: Marks, present: NDArray[np.bool_], values: dict[str, Floats]) -> list[Piece]:
        """Number the complete samples, fill or count what is missing between them."""
        at = np.flatnonzero(present)
        pieces: list[Piece] = []
        begin = 0
        while begin < len(at):
            end = begin + 1
            segment = int(marks.segment[at[begin]])
            gap = self._gap_before(int(marks.index[at[begin]]), int(marks.t_ns[at[begin]]), segment)
            while (
                end < len(at)
                and marks.segment[at[end]] == segment
                and marks.index[at[end]] - marks.index[at[end - 1]] == 1
            ):
                end += 1
            rows = at[begin:end]
            pieces.append(
                self._piece(gap, marks.t_ns[rows], {name: values[name][rows] for name in self._sent}, segment)
            )
            self._last = int(marks.index[rows[-1]]), int(marks.t_ns[rows[-1]]), segment
            begin = end
        return self.judgement.pass_on(pieces)

    def _gap_before(self, index: int, t_ns: int, segment: int) -> Stamps:
        """Count what is missing before sample `index`; give the stamps of those that go out as NaN."""
        none = np.zeros(0, dtype=np.int64)
        if self._last is not None and t_ns - self._last[1] > self._rule.absent * 1e9:
            self.judgement.anew()
        if self._last is None or self._last[2] != segment:
            return none
        missing = index - self._last[0] - 1
        if missing <= self._rule.fill:
            self.counters.filled += missing
            step = (t_ns - self._last[1]) // (missing + 1)
            return self._last[1] + step * np.arange(1, missing + 1, dtype=np.int64)
        if missing > self._absent:
            self.counters.absent += missing
        else:
            self.counters.lost += missing
            self.next_seq += missing
        return none

    def _piece(self, filled: Stamps, t_ns: Stamps, channels: dict[str, Floats], segment: int) -> Piece:
        if len(filled):
            nothing = np.full(len(filled), np.nan)
            t_ns = np.concatenate([filled, t_ns])
            channels = {name: np.concatenate([nothing, column]) for name, column in channels.items()}
        self.counters.samples += len(t_ns) - len(filled)
        piece = Piece(self.next_seq, t_ns, channels, segment)
        self.next_seq += len(t_ns)
        return piece

    # --- without SYNC -------------------------------------------------------------------------------------------

    def take_by_arrival(self, fresh: Frames) -> list[Piece]:
        """Give the samples that the frames complete, stamped by the arrival of the frame with the position."""
        keys = [frame.key for frame in self.layout.frames]
        opener = next(
            frame for frame in self.layout.frames if any(signal.channel == "position" for signal in frame.signals)
        )
        mine = fresh.take(np.isin(fresh.keys, keys))
        frames = join(self._waiting, mine)
        at = _rows_of(opener, frames)
        if len(at) == 0:
            return []
        single = sum(frame.is_sampled for frame in self.layout.frames) == 1
        if single:  # complete at once: nothing to wait for
            self._waiting = batch([])
            at = np.append(at, len(frames))
        else:
            self._waiting = frames.take(slice(int(at[-1]), None))
        ticks = [self._arrival_tick(int(stamp)) for stamp in frames.t_ns[at[:-1]].tolist()]
        return self.take(frames, Marks.of(at.tolist(), ticks)) if ticks else []

    def _arrival_tick(self, t_ns: int) -> Tick:
        """Stamps rise: one that does not is a nanosecond after the one before, but for a clock that was set back."""
        if t_ns <= self._arrived - BACKWARDS:
            self._segment += 1
        elif t_ns <= self._arrived:
            t_ns = self._arrived + 1
        self._arrived = t_ns
        self._number += 1
        return Tick(self._number, t_ns, self._segment)


def _rows_of(frame: Frame, frames: Frames) -> NDArray[np.intp]:
    """Where in a batch frames of one kind are."""
    rows = np.flatnonzero(frames.keys == frame.key)
    return rows[frame.carries(frames.data[rows, : frame.length])] if frame.pages else rows
