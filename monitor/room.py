"""Room on the disk: below a reserve the daemon goes on watching and stops keeping answers, until there is room again.

What it needs to watch (the samples of open windows, the state of drift and alarms) takes the place of what it does not
need any more, so the file hardly grows. What it does not keep meanwhile is counted. Asks the file system, nothing else.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import structlog

log = structlog.get_logger()
AGAIN = 1.2  # of the reserve: room enough to keep answers again
LOOK_SECONDS = 2.0
MEGABYTE = 1 << 20


class Room:
    """Whether answers may be kept. Belongs to the supervising thread."""

    def __init__(
        self,
        folder: Path | None,
        reserve_mb: float,
        clock: Callable[[], float],
        free: Callable[[Path], int] = lambda folder: shutil.disk_usage(folder).free,
    ) -> None:
        """Watch the disk that `folder` is on; None (a database server) means there is always room."""
        self._folder, self._reserve, self._clock, self._free = folder, reserve_mb * MEGABYTE, clock, free
        self._last = -float("inf")
        self.scarce = False
        self.not_kept = 0

    @classmethod
    def of_database(cls, url: str, reserve_mb: float, clock: Callable[[], float]) -> Room:
        """The room of an SQLite file's disk; a server looks after its own."""
        path = url.removeprefix("sqlite:///")
        return cls(None if path == url else Path(path).parent, reserve_mb, clock)

    def keeps(self) -> bool:
        """Whether the next answer is to be kept; counts those that are not."""
        self._look()
        self.not_kept += self.scarce
        return not self.scarce

    def _look(self) -> None:
        now = self._clock()
        if self._folder is None or now - self._last < LOOK_SECONDS:
            return
        self._last = now
        try:
            free = self._free(self._folder)
        except OSError:
            return  # whatever is wrong with the disk, the database says it better
        scarce = free < self._reserve * (AGAIN if self.scarce else 1.0)
        if scarce and not self.scarce:
            log.error(
                "the disk is almost full: watching goes on, answers are not kept; make room",
                folder=str(self._folder), free_mb=free // MEGABYTE, reserve_mb=int(self._reserve // MEGABYTE),
            )  # fmt: skip
        elif self.scarce and not scarce:
            log.info("room on the disk again: answers are kept", free_mb=free // MEGABYTE, not_kept=self.not_kept)
        self.scarce = scarce
