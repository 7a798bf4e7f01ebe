"""The watchdog's beat: given only when the corridor turns, the database answers and no worker hangs. No I/O of its own.

A beat from a timer would say that a thread lives; this one says that samples are taken, kept and identified. It is
given from the supervising loop, so a loop that stands still gives none.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import structlog

from monitor.errors import DatabaseError
from monitor.notify_systemd import Notifier

log = structlog.get_logger()
HANG_FACTOR = 2.0  # times the worker's own limit, after which its replacement has failed too
STATUS_SECONDS = 10.0


class Pulse:
    """Beats for systemd while intake, database and workers make progress."""

    def __init__(
        self,
        notifier: Notifier,
        *,
        database: Callable[[], None],
        oldest_job: Callable[[], float],
        job_limit: float,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Watch.

        Args:
            notifier: whom to tell.
            database: raises DatabaseError when the database does not answer.
            oldest_job: how long the oldest job of the workers has run, or how long they have been starting. [s]
            job_limit: after which a hung worker is replaced. [s]
            clock: monotonic. [s]
        """
        self._notifier, self._database, self._oldest_job = notifier, database, oldest_job
        self._job_limit, self._clock = job_limit, clock
        self._period = (notifier.watchdog_seconds or 2 * STATUS_SECONDS) / 2
        self._last = -float("inf")
        self.ailing: str | None = None

    def beat(self, summary: Callable[[], str]) -> None:
        """Tell that we live, when it is time and true; say once what is wrong, and once that it is well again.

        `summary` gives the line for `systemctl status`.
        """
        now = self._clock()
        if now - self._last < self._period:
            return
        self._last = now
        if found := self._examine():
            self.fail(found)
            return
        if self.ailing:
            log.info("well again", was=self.ailing)
            self.ailing = None
        self._notifier.tell(WATCHDOG=1, STATUS=summary())

    def endure(self, why: str) -> None:
        """The database is out of reach and we try again and again: a restart would not mend that, so this is a beat."""
        self.fail(why)
        self._notifier.tell(WATCHDOG=1)

    def fail(self, why: str) -> None:
        """Say once what is wrong; no beat until it is well again."""
        if why != self.ailing:
            log.error("nothing is watched while this lasts; nothing acknowledged is lost", why=why)
        self.ailing = why
        self._notifier.tell(STATUS=f"ailing: {why}")

    def _examine(self) -> str | None:
        try:
            self._database()
        except DatabaseError as error:
            return str(error)
        oldest = self._oldest_job()
        if oldest > HANG_FACTOR * self._job_limit:
            return f"workers have given no answer for {oldest:.0f} s; their limit is {self._job_limit:g} s"
        return None
