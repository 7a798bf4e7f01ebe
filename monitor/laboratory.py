"""Long work of low priority, one piece at a time: diagnoses and re-identifications. Owns a thread and a process.

The process is started for the work and ends with it: its memory goes back, a crash or a timeout costs one piece. With a
cluster the work is done there instead, and a timeout or a lost scheduler costs one piece too.
"""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from concurrent.futures import Executor
from typing import Any

import structlog

from monitor.workers import end_pool, local_pool

log = structlog.get_logger()

NICENESS = 5  # windows go first


def _low_priority(workers: int) -> Executor:
    """Processes of this machine that let the windows go first."""
    return local_pool(workers, NICENESS)


class Laboratory:
    """Runs functions in a process of their own; answers come out of `collect`. Its methods never wait."""

    def __init__(
        self,
        timeout: float,
        wake: Callable[[], None] = lambda: None,
        start_pool: Callable[[int], Executor] = _low_priority,
    ) -> None:
        """`timeout` [s]: how long a piece of work may take; `wake` is called from another thread when one ends."""
        self._timeout, self._wake, self._start_pool = timeout, wake, start_pool
        self._waiting: queue.SimpleQueue[tuple[str, Callable[..., Any], tuple[Any, ...]] | None] = queue.SimpleQueue()
        self._done: queue.SimpleQueue[tuple[str, Any]] = queue.SimpleQueue()
        self._keys: set[str] = set()
        self._pool: Executor | None = None
        self._thread: threading.Thread | None = None
        self._closed = False

    def submit(self, key: str, function: Callable[..., Any], *arguments: Any) -> bool:
        """Have `function(*arguments)` run; False where work of that `key` is on its way already."""
        if key in self._keys or self._closed:
            return False
        self._keys.add(key)
        self._waiting.put((key, function, arguments))
        if self._thread is None:
            self._thread = threading.Thread(target=self._work, name="laboratory", daemon=True)
            self._thread.start()
        return True

    def busy(self, key: str) -> bool:
        """Whether work of that key is on its way."""
        return key in self._keys

    def collect(self) -> list[tuple[str, Any]]:
        """Key and result of what has ended since the last call; an exception in place of a result where it failed."""
        ended = []
        while not self._done.empty():
            ended.append(self._done.get())
            self._keys.discard(ended[-1][0])
        return ended

    def _work(self) -> None:
        while (task := self._waiting.get()) is not None:
            key, function, arguments = task
            try:
                self._pool = self._start_pool(1)
                result: Any = self._pool.submit(function, *arguments).result(self._timeout)
            except Exception as error:
                if self._closed:
                    return
                log.warning("work in the laboratory failed", what=key, error=f"{type(error).__name__}: {error}")
                result = error
            self._stop()
            self._done.put((key, result))
            self._wake()

    def _stop(self) -> None:
        """End the process, at once."""
        pool, self._pool = self._pool, None
        if pool is not None:
            end_pool(pool)

    def close(self) -> None:
        """Stop at once; what was on its way is asked again after a restart."""
        self._closed = True
        self._waiting.put(None)
        self._stop()
