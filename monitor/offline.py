"""Commands while no daemon runs: the same actions on the same history, under the daemon's own lock."""

from __future__ import annotations

import time
from typing import Any

from monitor.alarm_desk import AlarmDesk
from monitor.commands import Command
from monitor.config import Config, read_axes
from monitor.fleet import Fleet
from monitor.operate import Floor, operate
from monitor.service import own
from monitor.store import Store


def operate_offline(config: Config, command: Command) -> dict[str, Any]:
    """Execute `command` on the history of `config`; the daemon tells subscribers of it at its next start.

    Raises:
        AlreadyRunningError: a daemon runs there: ask it instead.
        QueryError: the command cannot be executed.
        DatabaseError: the history is out of reach.
    """
    with own(config.state_dir):
        axes = read_axes(config)
        store = Store(config.database_url, synchronous=config.history.synchronous, receivers=config.receivers)
        try:
            desk = AlarmDesk(config, store, None, time.time_ns)
            fleet = Fleet(config, axes, store, time.monotonic())
            return operate(Floor(config, store, fleet, desk, time.time_ns), command)
        finally:
            store.close()
