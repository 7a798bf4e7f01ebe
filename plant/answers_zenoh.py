"""What a simulated machine reads from `…/parameters`: up to which moment the daemon has answered its stream.

A real machine never waits. One in time-lapse would run months ahead of what a busy computer can identify.
"""

from __future__ import annotations

import json
import threading
from types import TracebackType
from typing import Self

import zenoh

from plant import keys


def answered_until(payload: bytes) -> int | None:
    """End of the window that a parameters message (JSON) answers, in Unix time [ns]; None where it says none."""
    try:
        message = json.loads(payload)
    except (ValueError, RecursionError):
        return None
    window = message.get("window") if isinstance(message, dict) else None
    end = window.get("end_ns") if isinstance(window, dict) else None
    return end if type(end) is int else None


class Answers:
    """Listens to the answers for one axis and lets whoever sends wait for them. A context manager."""

    def __init__(self, session: zenoh.Session, site: str, axis_name: str, prefix: str = keys.PREFIX) -> None:
        """Subscribe to the axis' parameters."""
        self._news = threading.Condition()
        self._until_ns = 0
        self._subscriber = session.declare_subscriber(keys.parameters_key(site, axis_name, prefix), self._hear)

    def __enter__(self) -> Self:
        """Return the listener."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """Stop listening."""
        self._subscriber.undeclare()  # type: ignore[no-untyped-call]  # zenoh's stub

    def _hear(self, sample: zenoh.Sample) -> None:
        end = answered_until(sample.payload.to_bytes())
        if end is not None:
            with self._news:
                self._until_ns = max(self._until_ns, end)
                self._news.notify_all()

    @property
    def until_ns(self) -> int:
        """End of the latest window that was answered, in Unix time; 0 before the first. [ns]."""
        return self._until_ns

    def wait_beyond(self, moment_ns: int, timeout: float) -> int:
        """Wait until a later window than `moment_ns` is answered, at most `timeout` [s]; return `until_ns`."""
        with self._news:
            self._news.wait_for(lambda: self._until_ns > moment_ns, timeout)
            return self._until_ns
