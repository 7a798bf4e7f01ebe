"""How often one address may ask: token buckets, bounded in number. Pure; time comes in as an argument."""

from __future__ import annotations

from collections import OrderedDict

MOST = 4096  # addresses remembered; the one that was silent longest is forgotten


class RateLimit:
    """A bucket of `burst` requests per address that fills again at `per_minute`."""

    def __init__(self, per_minute: float, burst: float) -> None:
        """Start with full buckets."""
        self._rate, self._burst = per_minute / 60.0, burst
        self._buckets: OrderedDict[str, tuple[float, float]] = OrderedDict()

    def wait(self, address: str, now: float) -> float:
        """Take one request of `address` at monotonic time `now` [s]; gives the seconds to wait, 0 = go on. [s]"""
        level, then = self._buckets.pop(address, (self._burst, now))
        level = min(self._burst, level + (now - then) * self._rate)
        allowed = level >= 1.0
        self._buckets[address] = (level - 1.0 if allowed else level, now)
        if len(self._buckets) > MOST:
            self._buckets.popitem(last=False)
        return 0.0 if allowed else (1.0 - level) / self._rate

    def spent(self, address: str, now: float) -> bool:
        """Whether the bucket of `address` is empty, without taking anything."""
        level, then = self._buckets.get(address, (self._burst, now))
        return min(self._burst, level + (now - then) * self._rate) < 1.0
