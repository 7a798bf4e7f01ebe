"""Server-sent events: what the daemon says, boiled down for pages that stay open. Belongs to the event loop's thread.

A page needs to know *that* an axis has news, then it asks for what it shows. So changes are collected and sent at most
twice a second as one event, whatever the number of axes; only changes of alarms go out whole, and at once.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from typing import Any

EVERY = 0.5  # s between two events about changes
KEEP_ALIVE = 15.0  # s of silence after which a comment is sent, so that proxies keep the line open
QUEUE = 200  # events a slow reader may lag behind; then it is told to ask anew


class Hub:
    """Passes news on to every open page."""

    def __init__(self, most: int) -> None:
        """Serve `most` pages at the same time."""
        self._most = most
        self._loop: asyncio.AbstractEventLoop | None = None
        self._queues: set[asyncio.Queue[bytes | None]] = set()
        self._news: dict[str, set[str]] = {}
        self._due = False

    def start(self, loop: asyncio.AbstractEventLoop) -> None:
        """Work on `loop` from now on."""
        self._loop = loop

    @property
    def viewers(self) -> int:
        """Pages listening."""
        return len(self._queues)

    @property
    def full(self) -> bool:
        """Whether no further page is taken."""
        return len(self._queues) >= self._most

    # --- from the supervising thread ------------------------------------------------------------------------

    def hear(self, what: str, axis: str, content: dict[str, Any]) -> None:
        """News of `axis`; callable from any thread, never waits."""
        if self._loop is None or self._loop.is_closed():
            return
        try:
            self._loop.call_soon_threadsafe(self._take, what, axis, content if what == "alerts" else None)
        except RuntimeError:  # the loop was closed in between
            return

    # --- on the loop --------------------------------------------------------------------------------------------

    def _take(self, what: str, axis: str, content: dict[str, Any] | None) -> None:
        if not self._queues:
            return
        if content is not None:
            self._send(event("alert", content, content.get("number")))
        self._news.setdefault(axis, set()).add(what)
        if not self._due:
            self._due = True
            asyncio.get_running_loop().call_later(EVERY, self._tell)

    def _tell(self) -> None:
        self._due = False
        news, self._news = self._news, {}
        self._send(event("change", {"axes": {axis: sorted(what) for axis, what in sorted(news.items())}}))

    def _send(self, data: bytes) -> None:
        for queue in self._queues:
            if queue.qsize() >= QUEUE:
                while not queue.empty():
                    queue.get_nowait()
                data = event("lost", {"reason": "this page was too slow; it should ask for everything anew"})
            queue.put_nowait(data)

    def close(self) -> None:
        """End every stream."""
        for queue in self._queues:
            queue.put_nowait(None)

    async def stream(self, first: list[bytes]) -> AsyncIterator[bytes]:
        """Events for one page, `first` ones first, until it leaves or the daemon stops."""
        queue: asyncio.Queue[bytes | None] = asyncio.Queue()
        self._queues.add(queue)
        try:
            for one in first:
                yield one
            while True:
                try:
                    data = await asyncio.wait_for(queue.get(), KEEP_ALIVE)
                except TimeoutError:
                    data = b": still here\n\n"
                if data is None:
                    return
                yield data
        finally:
            self._queues.discard(queue)


def event(name: str, content: dict[str, Any], number: int | None = None) -> bytes:
    """One event as it goes over the line; `number` comes back as Last-Event-ID when the page reconnects."""
    text = json.dumps({"schema_version": 1, **content}, allow_nan=False, separators=(",", ":"))
    head = f"id: {number}\n" if number is not None else ""
    return f"{head}event: {name}\ndata: {text}\n\n".encode()
