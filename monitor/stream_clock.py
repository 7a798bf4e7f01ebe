"""The stamps of a stream against their arrival: whose clock is off, by how much, and how fast it runs. Pure.

Stamps are event time and may be of any year: a replay is no fault. What is told here is told in the status.
"""

from __future__ import annotations

import collections
import itertools
from dataclasses import dataclass, field

import numpy as np

from plant.wire import Block

KEPT = 8  # blocks looked back upon
SPACING = 0.5  # s of arrival between the blocks that a rate is taken from
ANCHORS = 32  # of those are kept
LONG_ENOUGH = 2.0  # s of arrival, below which a rate is mostly the network's
LIVE = (0.5, 1.5)  # event time per wall time of a stream that is sent as it is measured
AHEAD = 60.0  # s; stamps further in the future than this are no network delay


@dataclass(frozen=True, slots=True)
class _Arrival:
    arrived_ns: int
    first_ns: int
    last_ns: int
    epoch: int
    seq: int
    n: int


@dataclass(slots=True)
class StreamClock:
    """The latest blocks of one axis, as (arrival, stamps)."""

    _latest: collections.deque[_Arrival] = field(default_factory=lambda: collections.deque(maxlen=KEPT))
    _anchors: collections.deque[_Arrival] = field(default_factory=lambda: collections.deque(maxlen=ANCHORS))

    def note(self, block: Block, arrived_ns: int) -> None:
        """Take a block that arrived at Unix time `arrived_ns` [ns] on our clock."""
        first, last = int(block.t_ns[0]), int(block.t_ns[-1])
        if self._latest and self._latest[-1].epoch != block.epoch:
            self._latest.clear()
            self._anchors.clear()
        arrival = _Arrival(arrived_ns, first, last, block.epoch, block.seq, len(block))
        self._latest.append(arrival)
        if not self._anchors or arrived_ns - self._anchors[-1].arrived_ns >= SPACING * 1e9:
            self._anchors.append(arrival)

    @property
    def skew(self) -> float | None:
        """Least time from a block's last stamp to its arrival: our clock minus theirs, plus the way. [s]"""
        if not self._latest:
            return None
        return min(one.arrived_ns - one.last_ns for one in self._latest) / 1e9

    @property
    def rate(self) -> float | None:
        """Event time per time of arrival; 1 = live, more = a replay or blocks that were held up. [1]"""
        if not self._anchors:
            return None
        first, last = self._anchors[0], self._latest[-1]
        arrived = (last.arrived_ns - first.arrived_ns) / 1e9
        return (last.last_ns - first.last_ns) / 1e9 / arrived if arrived >= LONG_ENOUGH else None

    @property
    def live(self) -> bool:
        """Whether it is sent about as fast as it is measured."""
        return self.rate is not None and LIVE[0] <= self.rate <= LIVE[1]

    @property
    def waits(self) -> bool:
        """Whether it has time to wait: a replay (more event time than wall time), or nothing is known yet."""
        return self.rate is None or self.rate > LIVE[1]

    @property
    def steps(self) -> tuple[float, float] | None:
        """Sample time within the blocks, and from block to block per sample. [s]"""
        pairs = [
            (before, after)
            for before, after in itertools.pairwise(self._latest)
            if after.seq == before.seq + before.n and before.n > 1
        ]
        if len(pairs) < 3:
            return None
        inside = float(np.median([(one.last_ns - one.first_ns) / (one.n - 1) for one, _ in pairs]))
        between = float(np.median([(after.first_ns - one.first_ns) / one.n for one, after in pairs]))
        return inside / 1e9, between / 1e9

    @property
    def note_text(self) -> str | None:
        """What is odd about the stamps, in words; None where nothing is."""
        skew, rate = self.skew, self.rate
        if skew is not None and skew < -AHEAD and (rate is None or rate <= LIVE[1]):
            return f"stamps are {-skew:.0f} s ahead of our clock: local time taken for UTC, or a clock that is not set"
        if rate is not None and rate < LIVE[0] / 5:
            return f"stamps run {1 / rate if rate > 0 else float('inf'):.3g} times slower than they arrive: check dt_ns"
        return None

    def to_dict(self) -> dict[str, float | str | None]:
        """For the status."""
        skew, rate = self.skew, self.rate
        return {
            "skew_seconds": None if skew is None else round(skew, 3),
            "rate": None if rate is None else round(rate, 3),
            "note": self.note_text,
        }
