"""Readers of the history for the page's threads: one each, a bounded number of questions at once."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

from monitor.query_page import PageReader
from plant.errors import ReachError

THREADS = 2
WAITING = 64  # questions; more are refused, so that nobody can pile them up
FRESH = 1.0  # s an answer about the whole fleet is shared between those who ask

T = TypeVar("T")


class BusyError(ReachError):
    """Too many questions at once."""


class Readers:
    """Runs questions in threads of its own, so that the event loop never waits for the database."""

    def __init__(self, url: str) -> None:
        """Read the history at `url`."""
        self._url = url
        self._pool = ThreadPoolExecutor(THREADS, thread_name_prefix="page-reader")
        self._local = threading.local()
        self._open: list[PageReader] = []
        self._waiting = 0
        self._shared: dict[str, tuple[float, asyncio.Future[Any]]] = {}

    async def ask(self, question: Callable[[PageReader], T]) -> T:
        """The answer to `question`.

        Raises:
            BusyError: too many are waiting.
        """
        if self._waiting >= WAITING:
            raise BusyError("busy: too many questions at once; ask again in a moment")
        self._waiting += 1
        try:
            return await asyncio.get_running_loop().run_in_executor(self._pool, self._run, question)
        finally:
            self._waiting -= 1

    async def share(self, name: str, question: Callable[[PageReader], T]) -> T:
        """The same, asked once for all who want it within `FRESH`: for what does not depend on who asks."""
        known, now = self._shared.get(name), time.monotonic()
        if known is None or now - known[0] > FRESH:
            task = asyncio.ensure_future(self.ask(question))
            known = self._shared[name] = (now, task)
            task.add_done_callback(lambda done: self._forget(name, done))
        answer: T = await asyncio.shield(known[1])
        return answer

    def _forget(self, name: str, done: asyncio.Future[Any]) -> None:
        """Errors are not shared."""
        if done.cancelled() or done.exception() is not None:
            self._shared.pop(name, None)

    def _run(self, question: Callable[[PageReader], T]) -> T:
        reader: PageReader | None = getattr(self._local, "reader", None)
        if reader is None:
            reader = self._local.reader = PageReader(self._url)
            self._open.append(reader)
        return question(reader)

    def close(self) -> None:
        """Finish what runs, close every connection."""
        self._pool.shutdown(wait=True, cancel_futures=True)
        for reader in self._open:
            reader.close()
