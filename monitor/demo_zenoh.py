"""The demo's ear: parameters, alerts and status of one axis, as a subscriber far away would get them."""

from __future__ import annotations

import json
import queue
import time
from types import TracebackType
from typing import Any, Self

import zenoh
import zenoh.ext

from monitor.link_zenoh import is_alive
from plant import keys
from plant.errors import ReachError
from plant.zenoh_session import open_session

HEARD = ("parameters", "alerts", "status")


class Ear:
    """Listens to the daemon at `endpoint`; a context manager. Messages wait in `messages` as (what, content)."""

    def __init__(self, endpoint: str, site: str, axis: str, timeout: float) -> None:
        """Connect, and wait for the daemon's liveliness, for at most `timeout` seconds.

        Raises:
            ReachError: it did not come.
        """
        self.messages: queue.SimpleQueue[tuple[str, dict[str, Any]]] = queue.SimpleQueue()
        self._session = open_session("client", connect=[endpoint], timeout=timeout)
        try:
            history = zenoh.ext.HistoryConfig(detect_late_publishers=True)  # the first words may come before the link
            self._subscribers = [
                zenoh.ext.declare_advanced_subscriber(
                    self._session, keys.output_key(site, axis, what), self._hearer(what), history=history
                )
                for what in HEARD
            ]
            deadline = time.monotonic() + timeout
            while not is_alive(self._session, site, keys.PREFIX):
                if time.monotonic() > deadline:
                    raise ReachError(f"the daemon at {endpoint} does not show its liveliness; its log says why")
                time.sleep(0.05)
        except BaseException:
            self._session.close()  # type: ignore[no-untyped-call]
            raise

    def _hearer(self, what: str) -> Any:
        return lambda sample: self.messages.put((what, json.loads(sample.payload.to_bytes())))

    def __enter__(self) -> Self:
        """Return the ear."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """Close the session."""
        self._session.close()  # type: ignore[no-untyped-call]
