"""The corridor: message -> journal -> window -> identification -> history -> drift -> alarm -> publication.

One supervising thread calls `step` again and again. It is the only one that writes the database; whatever is published
was stored before. The order of one axis' answers is the order of its windows, so results do not depend on the workers.
The stations are `reception.py`, `dispatch.py` and `conclusion.py`; the axes they serve are a `fleet.py`, looked after
in turn by `rounds.py`.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping

from monitor.alarm_desk import AlarmDesk, Publish
from monitor.axis_run import AxisRun
from monitor.commands import CommandBox
from monitor.conclusion import Conclusion
from monitor.config import Config
from monitor.dispatch import Dispatch
from monitor.fleet import Fleet
from monitor.inbox import Inbox
from monitor.laboratory import Laboratory
from monitor.loop import Loop
from monitor.operate import Floor, serve
from monitor.reception import Reception
from monitor.retention import Retention
from monitor.room import Room
from monitor.rounds import Rounds
from monitor.store import Store
from monitor.workers import Workers
from plant.axis import Axis

MESSAGES_PER_STEP = 500


class Pipeline:
    """All axes of one daemon. Time comes from `clock` (monotonic, s) and `wall` (Unix, ns)."""

    def __init__(
        self,
        config: Config,
        axes: Mapping[str, Axis],
        store: Store,
        workers: Workers,
        inbox: Inbox,
        publish: Publish,
        *,
        commands: CommandBox | None = None,
        laboratory: Laboratory | None = None,
        owns: Callable[[str], bool] = lambda _name: True,
        fetch: Callable[[str], bool] | None = None,
        clock: Callable[[], float] = time.monotonic,
        wall: Callable[[], int] = time.time_ns,
    ) -> None:
        """Take up every listed axis of ours where the history left it; `commands` are executed in every turn.

        Diagnoses are made in `laboratory`, by default one of our own; `fetch` is that of the reception.
        """
        self._config, self._store, self._inbox = config, store, inbox
        self._clock, self._last_commit = clock, clock()
        self.alarms = AlarmDesk(config, store, publish, wall)
        self.fleet = Fleet(config, axes, store, clock(), owns)
        self.floor = Floor(config, store, self.fleet, self.alarms, wall)
        self._commands = commands or CommandBox()
        self.room = Room.of_database(config.database_url, config.history.reserve_mb, clock)
        self._retention = Retention(config.history, self.fleet, store, wall)
        self.rounds = Rounds(config, self.fleet, store, self.alarms, publish, self.room, clock, wall)
        self.reception = Reception(self.fleet, store, self.rounds.acknowledge, clock, wall, fetch)
        laboratory = laboratory or Laboratory(config.diagnosis.timeout_seconds)
        self.loop = Loop(config, self.fleet, store, self.alarms, publish, laboratory)
        self.conclusion = Conclusion(config, store, self.alarms, publish, self.room, self.loop.consider)
        self.dispatch = Dispatch(config, self.fleet, store, workers, self.conclusion.conclude)

    def step(self, timeout: float = 0.05) -> None:
        """Receive, settle, commit, identify, judge, tell: whatever is due; wait at most `timeout` [s] for input."""
        self.reception.receive(*self._inbox.take(MESSAGES_PER_STEP, timeout))
        serve(self.floor, self._commands)
        now = self._clock()
        self.reception.settle(now)
        if now - self._last_commit >= self._config.intake.commit_seconds:
            self.commit()
        self.dispatch.collect()
        self.loop.turn()
        self.dispatch.submit()
        self.rounds.pace(self.dispatch, now)
        self.rounds.turn(now)
        self._retention.turn(now)

    def drain(self) -> None:
        """Take what has arrived and commit it; windows without an answer are done again after a restart."""
        while len(self._inbox):
            self.reception.receive(*self._inbox.take(MESSAGES_PER_STEP, 0.0))
        self.commit()
        self.dispatch.collect()
        self.rounds.all_at_once()

    def commit(self) -> None:
        """Write what was settled; after this, and only after this, it is acknowledged."""
        self._last_commit = self._clock()
        self.reception.commit()

    def tell_untold(self) -> None:
        """After a restart: publish the transitions that were stored but perhaps not told."""
        self.alarms.tell_untold({run.record.id: name for name, run in self.runs.items()})

    @property
    def runs(self) -> dict[str, AxisRun]:
        """The axes by name."""
        return self.fleet.runs

    @property
    def backlog(self) -> int:
        """Windows without a stored answer."""
        return self.fleet.backlog
