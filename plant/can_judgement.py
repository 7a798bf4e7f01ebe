"""Holds the first samples of an axis back until its layout is judged; judges anew when the drive may change. Pure."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant.can_counters import AxisCounters
from plant.can_layout import Signal
from plant.can_widths import ENOUGH, Raw, misfit

if TYPE_CHECKING:
    from plant.can_axis import Piece

RETRY = 30.0  # s after which statuswords that made no sense are looked at again: they need no motion to tell


class Judgement:
    """Whether the samples of one axis may go out. A refusal stands until another look at the drive finds no reason."""

    def __init__(self, counters: AxisCounters, enabled: bool, period: float) -> None:
        """Count in `counters`; `period` [s] of a sample. Without `enabled` only the clock's verdict counts."""
        self._counters, self._enabled = counters, enabled
        self._retry = max(1, round(RETRY / period))
        self._open = enabled  # samples are being looked at
        self._opening = False  # from the next batch on: this one may hold what came before the change
        self._clock_known, self._by_clock = True, False
        self._clock_misfit: str | None = None
        self._by_states = False
        self._early: list[Piece] = []
        self._raw: list[dict[str, tuple[Signal, Raw]]] = []
        self._since = 0  # samples refused since the latest look

    def note_clock(self, known: bool, reason: str | None) -> None:
        """The SYNC period has been compared with what was said, and `reason` says why it cannot be right."""
        self._clock_known, self._clock_misfit = known, reason
        if reason is not None and self._counters.refused is None:
            self._counters.refused, self._by_clock = reason, True
        elif self._by_clock and not known:
            self.anew()

    def anew(self) -> None:
        """The drive, or the master, may have changed: a refused axis gets another look."""
        if self._counters.refused is not None and not self._open:
            self._opening = True

    def watch(self, raw: dict[str, tuple[Signal, Raw]]) -> None:
        """Keep counts for the judgement."""
        if self._open:
            self._raw.append(raw)

    def pass_on(self, pieces: list[Piece]) -> list[Piece]:
        """The samples that may go out now; while they are looked at, none."""
        if not self._open and self._counters.refused is None:
            return pieces
        self._early += pieces
        if self._opening:
            self._refuse()
            self._open, self._opening, self._by_clock, self._raw = True, False, False, []
            return []
        if self._open and (sum(map(len, self._early)) < ENOUGH or not self._clock_known):
            return []
        return self.finish()

    def finish(self) -> list[Piece]:
        """Judge on what there is; the samples that were held back, or none."""
        if self._open and self._raw:
            self._open, self._since = False, 0
            joined = {
                name: (self._raw[0][name][0], np.concatenate([one[name][1] for one in self._raw]))
                for name in self._raw[0]
            }
            self._raw = []
            found = misfit(joined) if self._enabled else None
            self._by_clock, self._by_states = self._clock_misfit is not None, "statusword" in (found or "")
            self._counters.refused = self._clock_misfit or found
        if self._counters.refused is not None:
            self._refuse()
            return []
        kept, self._early = self._early, []
        return kept

    def _refuse(self) -> None:
        refused, self._early = sum(map(len, self._early)), []
        self._counters.refused_samples += refused
        self._since += refused
        if self._by_states and self._since >= self._retry:
            self._since = 0
            self.anew()
