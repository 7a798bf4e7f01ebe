"""When identification cannot keep up: by how much every hop is stretched, evenly over all live axes. Pure.

Windows of a stretched hop are every k-th of the usual ones, so none is new, some are left out; of those that wait
already the same share goes, or working them off would take far longer than the overload. The factor follows from what
comes and what is answered; it grows when the oldest window waits for longer than allowed, and goes back as soon as the
answers would keep up with less. A replay (more event time than wall time) has time to wait and is never stretched.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from monitor.axis_run import AxisRun

MOST = 64  # times the hop; beyond it a machine of this size is no help
HEADROOM = 1.25  # answers per window that comes: a quarter of them works off what has piled up
CALM = 0.25  # of the allowed lag: below it the hop may shrink again
MEMORY = 0.9  # of the rates, per look; a look a second remembers about ten
GROWN = 1.1  # ratio of the lag now to that at the last step that asks for another step


@dataclass(frozen=True, slots=True)
class Load:
    """What has happened since the last look.

    Attributes:
        usual: windows that live axes would have completed with the usual hop. [1]
        answered: windows of any axis that were answered. [1]
        lag: how long the oldest window of a live axis has waited for its answer. [s]
        waiting: windows without an answer. [1]
    """

    usual: float
    answered: int
    lag: float
    waiting: int


@dataclass(slots=True)
class Pacer:
    """Decides the factor; `allowed` is the lag that is no reason to stretch. [s]

    Attributes:
        allowed: longest wait of a window that is still all right. [s]
        factor: windows of the usual hop per window that is made now. [1]
        coming: windows per look that would come with the usual hop. [1]
        going: answers per look while windows wait, what the workers can do. [1]
    """

    allowed: float
    factor: int = 1
    coming: float = 0.0
    going: float = 0.0
    _lag_then: float = 0.0
    _changed: float = -math.inf
    _looked: float = -math.inf

    def look(self, load: Load, now: float) -> int:
        """Take the load since the last look at monotonic time `now` [s]; return the factor from now on."""
        self._remember(load, now)
        long_ago = now - self._changed >= self.allowed / 2
        if load.lag > self.allowed and long_ago and (self.factor == 1 or load.lag > GROWN * self._lag_then):
            self._move(min(MOST, max(self.factor + 1, self._needed())), load.lag, now)
        elif self.factor > 1 and long_ago and load.lag < CALM * self.allowed and self._needed() < self.factor:
            self._move(max(self._needed(), self.factor // 2), load.lag, now)
        return self.factor

    def _remember(self, load: Load, now: float) -> None:
        seconds = min(max(now - self._looked, 0.1), 10.0) if math.isfinite(self._looked) else 1.0
        self._looked = now
        keep = MEMORY**seconds
        self.coming = keep * self.coming + (1 - keep) * load.usual / seconds
        if load.waiting > load.answered or load.answered / seconds > self.going:  # else they had not enough to do
            self.going = keep * self.going + (1 - keep) * load.answered / seconds

    def _needed(self) -> int:
        return max(1, math.ceil(HEADROOM * self.coming / self.going)) if self.going > 0 else MOST

    def _move(self, factor: int, lag: float, now: float) -> None:
        self.factor, self._lag_then, self._changed = factor, lag, now


def lag_of(runs: Iterable[AxisRun], now: float) -> float:
    """How long the oldest window of a live axis has waited. [s]"""
    return max((run.behind(now) for run in runs if not run.clock.waits), default=0.0)
