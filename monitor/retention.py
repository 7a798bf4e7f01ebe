"""What the settings say is old goes: answers become roll-ups, evidence and delivered letters are deleted."""

from __future__ import annotations

from collections.abc import Callable

from monitor.config_sections import HistorySection
from monitor.fleet import Fleet
from monitor.store import Store

SECONDS = 1.0  # between two turns
ANSWERS = 500  # of one axis a turn, so that the stream never waits long
LETTER_DAYS = 30  # d: delivered letters are kept that long, to see what receivers were told
DAY_NS = 86_400 * 10**9


class Retention:
    """One axis a turn. Belongs to the supervising thread; `wall` is Unix time. [ns]"""

    def __init__(self, settings: HistorySection, fleet: Fleet, store: Store, wall: Callable[[], int]) -> None:
        """Keep `fleet` within `settings`."""
        self._settings, self._fleet, self._store, self._wall = settings, fleet, store, wall
        self._latest = -SECONDS
        self._turn = 0

    def turn(self, now: float) -> None:
        """Do the next axis, when it is time; `now` is monotonic. [s]"""
        if now - self._latest < SECONDS or not self._fleet.runs:
            return
        self._latest = now
        self._turn += 1
        record = list(self._fleet)[self._turn % len(self._fleet.runs)].record
        if self._turn % 1000 == 1:
            self._store.thin_out_letters(self._wall() - LETTER_DAYS * DAY_NS)
        if record.last_ns is None:
            return
        if days := self._settings.keep_days:
            self._store.thin_out(record.id, record.last_ns - round(days * DAY_NS), ANSWERS)
        if days := self._settings.keep_evidence_days:
            self._store.thin_out_evidence(record.id, record.last_ns - round(days * DAY_NS))
