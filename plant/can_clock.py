"""Time from the SYNC count: samples are as regular as the master's quartz, however late their frames arrive. Pure.

All drives latch at SYNC, so sample k is at `anchor + k * period`. Arrival stamps of a computer jitter by milliseconds;
they only anchor the count and watch it: the least delay within a second tells the offset, and the step is stretched by
at most 200 ppm to keep it small. An offset that is too large for that re-anchors, which ends a segment, and is counted.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass

NANOSECONDS = 1_000_000_000
WATCH = 1.0  # s over which the least delay is taken
SMOOTH = 60.0  # s over which an offset is worked off
SLEW = 200e-6  # longest stretch of the step; quartzes differ by less
PAUSE = 1.0  # s without SYNC, and ten periods, after which the count starts anew
CHECK = 2.0  # s after which the period that was seen is compared with the one that was said
WRONG = 0.2  # relative; a stall of the host changes the mean by less
LATE = 0.7  # periods of offset that without a counter mean lost SYNCs


class Origin(enum.StrEnum):
    """What anchors the count to Unix time: the host's clock at arrival, or the master's TIME object (100h)."""

    HOST = "host"
    TIME_OBJECT = "time_object"


@dataclass(frozen=True, slots=True)
class Tick:
    """One SYNC.

    Attributes:
        index: number of the sample, counting lost SYNCs.
        t_ns: its time, Unix. [ns]
        segment: grows where the count was re-anchored.
    """

    index: int
    t_ns: int
    segment: int


@dataclass(slots=True)
class ClockCounters:
    """What was seen of the clock.

    Attributes:
        syncs: SYNCs counted.
        syncs_lost: missing by the SYNC counter, or by arrival where there is none.
        syncs_repeated: the same counter twice.
        pauses: silences that started the count anew.
        steps: re-anchored because the offset was too large, or because TIME told another time.
        offset: of arrival against the count, least delay of the last second. [s]
        drift: of the master's quartz against the host's, since the last anchor. [1]
    """

    syncs: int = 0
    syncs_lost: int = 0
    syncs_repeated: int = 0
    pauses: int = 0
    steps: int = 0
    offset: float = 0.0
    drift: float = 0.0


class SyncClock:
    """Turns SYNCs, as they arrive, into ticks.

    Attributes:
        counters: what was seen.
        judged: the period has been compared with what arrives.
        misfit: why the period cannot be right, None when all is well.
    """

    def __init__(
        self, period: float, *, overflow: int = 240, origin: Origin = Origin.HOST, max_offset: float = 0.1
    ) -> None:
        """Start without an anchor.

        Args:
            period: of SYNC. [s] > 0
            overflow: highest value of the SYNC counter, after which it is 1 again (1019h). 2 ... 240
            origin: see `Origin`.
            max_offset: beyond it the count is re-anchored. [s] > 0
        """
        self.period = round(period * NANOSECONDS)
        self.counters = ClockCounters()
        self._overflow, self._origin = overflow, origin
        self._max_offset = round(max_offset * NANOSECONDS)
        self._pause = max(round(PAUSE * NANOSECONDS), 10 * self.period)
        self._longest = max(1, int(self.period * SLEW))
        self._watch_ticks = max(20, round(WATCH * NANOSECONDS / self.period))
        self._tick: Tick | None = None
        self._counter: int | None = None
        self._arrival = 0
        self._step = self.period
        self._told: int | None = None  # by a TIME object, for the next SYNC
        self._seen, self._least = 0, 0
        self._anchor = (0, 0)  # index and least arrival of the first watch since the anchor
        self.judged = origin is Origin.TIME_OBJECT  # a time-lapse comes at any rate
        self.misfit: str | None = None
        self._born, self._periods = 0, 0  # arrival of the first SYNC, periods since

    def tell_time(self, unix_ns: int) -> None:
        """A TIME object: the master's own time, good for the next SYNC."""
        self._told = unix_ns

    def tick(self, arrival: int, counter: int | None = None) -> Tick | None:
        """Take one SYNC that arrived at `arrival` [ns]; None for a repeated one."""
        last = self._tick
        if last is None:
            self.counters.syncs += 1
            self._born = arrival
            return self._anchor_at(self._told if self._told is not None else arrival, arrival, counter, 0, 0)
        paused = abs(arrival - self._arrival) > self._pause
        steps = 1 if paused or counter is None or self._counter is None else (counter - self._counter) % self._overflow
        if steps == 0:
            self.counters.syncs_repeated += 1
            return None
        self.counters.syncs += 1
        if not paused:
            self.counters.syncs_lost += steps - 1
        if paused and self.misfit is not None:  # the master may have another period now
            self.judged, self.misfit = False, None
        if not self.judged:
            self._judge(arrival, steps, paused)
        due = last.t_ns + steps * self._step
        index, told = last.index + steps, self._told
        if self._origin is Origin.TIME_OBJECT:
            self._told = None
            if told is not None and abs(told - due) > max(self._max_offset, 3 * self.period // 2):
                self.counters.steps += 1
                return self._anchor_at(told, arrival, counter, index, last.segment + 1)
            if paused:
                due = last.t_ns + max(self.period, arrival - self._arrival)
        elif paused:
            self.counters.pauses += 1
            return self._anchor_at(arrival, arrival, counter, index, last.segment + 1)
        elif (again := self._watch(arrival, due, index, counter)) is not None:
            return again
        self._tick = Tick(index, due, last.segment + (1 if paused else 0))
        self._arrival, self._counter = arrival, counter
        return self._tick

    def _anchor_at(self, t_ns: int, arrival: int, counter: int | None, index: int, segment: int) -> Tick:
        self._tick = Tick(index, t_ns, segment)
        self._arrival, self._counter, self._told = arrival, counter, None
        self._step, self._seen, self._anchor = self.period, 0, (0, 0)
        return self._tick

    def _judge(self, arrival: int, steps: int, paused: bool) -> None:
        """Compare the period with the mean of what arrives."""
        if paused:
            self._born, self._periods = arrival, 0
            return
        self._periods += steps
        span = arrival - self._born
        if span < CHECK * NANOSECONDS:
            return
        self.judged = True
        seen = span / self._periods
        if abs(seen / self.period - 1.0) > WRONG:
            self.misfit = (
                f"SYNC comes every {seen / NANOSECONDS:.3g} s, but [time] period is {self.period / NANOSECONDS:g} s"
            )

    def _watch(self, arrival: int, due: int, index: int, counter: int | None) -> Tick | None:
        """Keep the least delay; once a watch is over, correct the step, or re-anchor."""
        delay = arrival - due
        self._least = delay if self._seen == 0 else min(self._least, delay)
        self._seen += 1
        if self._seen < (20 if counter is None else self._watch_ticks):
            return None
        least, self._seen = self._least, 0
        self.counters.offset = least / NANOSECONDS
        segment = self._tick.segment + 1 if self._tick is not None else 0
        lost = round(least / self.period) if counter is None and least > LATE * self.period else 0
        if 0 < lost * self.period <= self._max_offset:
            self.counters.syncs_lost += lost
            return self._anchor_at(due + lost * self.period, arrival, counter, index + lost, segment)
        if abs(least) > self._max_offset:
            self.counters.steps += 1
            return self._anchor_at(arrival, arrival, counter, index, segment)
        self._measure_drift(index, due + least)
        wanted = round(least * self.period / (SMOOTH * NANOSECONDS))
        self._step = self.period + max(-self._longest, min(self._longest, wanted))
        return None

    def _measure_drift(self, index: int, least_arrival: int) -> None:
        if self._anchor == (0, 0):
            self._anchor = (index, least_arrival)
        elif index > self._anchor[0]:
            nominal = (index - self._anchor[0]) * self.period
            self.counters.drift = (least_arrival - self._anchor[1] - nominal) / nominal
