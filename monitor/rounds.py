"""What is due for every axis now and then: silence, complaints, status, tidying up, and how far identification lags.

The axes take turns, a few per call, so that a thousand of them never hold up the intake.
"""

from __future__ import annotations

import collections
import math
from collections.abc import Callable

import structlog

from monitor.alarm_desk import AlarmDesk, Publish
from monitor.axis_run import AxisRun
from monitor.config import Config
from monitor.dispatch import Dispatch
from monitor.fleet import Fleet
from monitor.pacing import Load, Pacer, lag_of
from monitor.payloads import status_payload
from monitor.room import Room
from monitor.store import Store

log = structlog.get_logger()

STATUS_SECONDS = 1.0
PRUNE_SECONDS = 5.0
VISITS = 100  # axes per call
TOLD_PER_SECOND = 250  # statuses; with more axes than that each is told the less often


class Rounds:
    """Looks after all axes in turn. Belongs to the supervising thread."""

    def __init__(
        self,
        config: Config,
        fleet: Fleet,
        store: Store,
        alarms: AlarmDesk,
        publish: Publish,
        room: Room,
        clock: Callable[[], float],
        wall: Callable[[], int],
    ) -> None:
        """`clock` in s, `wall` in ns."""
        self._config, self._fleet, self._store, self._alarms = config, fleet, store, alarms
        self._publish, self._room, self._clock, self._wall = publish, room, clock, wall
        self._started = self._looked = clock()
        self._turns: collections.deque[AxisRun] = collections.deque()
        self._pacer = Pacer(config.identification.max_lag_seconds)
        self._counted = (0.0, 0)

    def turn(self, now: float) -> None:
        """Visit the axes whose turn has come at monotonic time `now` [s]."""
        if len(self._turns) != len(self._fleet.runs):
            for run in self._fleet:
                run.visited = now if run.visited == -math.inf else run.visited
            self._turns = collections.deque(sorted(self._fleet, key=lambda run: run.visited))
        for _ in range(min(VISITS, len(self._turns))):
            if now - self._turns[0].visited < self._period:
                break
            run = self._turns.popleft()
            self._turns.append(run)
            self._visit(run, now)

    def all_at_once(self) -> None:
        """Tell the status of every axis, before the end."""
        for run in self._fleet:
            self.tell(run)

    def _visit(self, run: AxisRun, now: float) -> None:
        run.visited = now
        self._alarms.tick(run)
        self._alarms.watch_silence(run, now - (self._started if run.heard is None else run.heard))
        self._alarms.watch_quality(run)
        if run.untidy and now - run.pruned >= PRUNE_SECONDS:
            run.untidy, run.pruned = False, now
            keep = 0 if self._room.scarce else self._config.history.keep_raw_windows
            made_of = () if self._room.scarce else run.drift.windows_kept
            self._store.prune(run.record.id, run.record.stream.needed_from(), keep, made_of)
        if now - run.told >= self._period / 2:
            self.tell(run)

    @property
    def _period(self) -> float:
        """From one status of an axis to the next. [s]"""
        return max(STATUS_SECONDS, len(self._turns) / TOLD_PER_SECOND)

    def acknowledge(self, run: AxisRun) -> None:
        """Its samples were committed: tell it at once, with many axes not after every commit."""
        if self._clock() - run.told >= len(self._turns) / TOLD_PER_SECOND:
            self.tell(run)

    def tell(self, run: AxisRun) -> None:
        """Publish the status of an axis."""
        run.told = self._clock()
        content = status_payload(self._config, run, run.told, self._wall(), kept=not self._room.scarce)
        self._publish("status", run.record.name, content)

    def pace(self, dispatch: Dispatch, now: float) -> None:
        """Once a second: stretch the hop of all live axes alike where identification falls behind; say so."""
        if now - self._looked < STATUS_SECONDS:
            return
        self._looked = now
        usual, answered = self._fleet.usual - self._counted[0], dispatch.answered - self._counted[1]
        self._counted = self._fleet.usual, dispatch.answered
        lag, backlog, before = lag_of(self._fleet, now), self._fleet.backlog, self._pacer.factor
        factor = self._pacer.look(Load(usual, answered, lag, backlog), now)
        self._fleet.stretch(factor)
        left_out = self._fleet.thin(factor) if factor > before else {}
        if left_out:
            self._store.leave_out(left_out)
        if factor != before:
            log.warning(
                "identification cannot keep up, the hop is stretched" if factor > before else "the hop shrinks again",
                every=factor, before=before, lag_seconds=round(lag, 1), backlog=backlog,
                left_out=sum(map(len, left_out.values())),
                windows_coming_per_second=round(self._pacer.coming, 2), answered_per_second=round(self._pacer.going, 2),
            )  # fmt: skip
