"""Commands from people and programs to the daemon: whoever takes one puts it here, the supervising thread executes it.

Command line, Zenoh and HTTP all come through this box, so that there is one way to do a thing. No I/O.
"""

from __future__ import annotations

import collections
import threading
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field
from typing import Any

from monitor.errors import QueryError

WAITING = 100  # commands; more are refused, so that nobody can pile them up


@dataclass(frozen=True, slots=True)
class Command:
    """Something to be done.

    Attributes:
        action: a key of `operate.ACTIONS`.
        axis: name of the axis it is for.
        arguments: of the action, JSON values as they came; the action checks them.
        author: who wants it; goes into the audit.
    """

    action: str
    axis: str
    arguments: dict[str, Any] = field(default_factory=dict)
    author: str = ""


Answer = Future[dict[str, Any]]


class CommandBox:
    """Commands on their way to the supervising thread. Safe for threads."""

    def __init__(self, wake: Callable[[], None] = lambda: None) -> None:
        """`wake` is called after every submission, to rouse the one who takes."""
        self._wake = wake
        self._lock = threading.Lock()
        self._waiting: collections.deque[tuple[Command, Answer]] = collections.deque()
        self._closed = False

    def submit(self, command: Command) -> Answer:
        """Hand in a command; its answer comes as the future's result, a refusal as its exception (`QueryError`)."""
        answer: Answer = Future()
        with self._lock:
            refusal = "the daemon is stopping" if self._closed else ""
            if len(self._waiting) >= WAITING:
                refusal = f"busy: {WAITING} commands are waiting; try again"
            if not refusal:
                self._waiting.append((command, answer))
        if refusal:
            answer.set_exception(QueryError(refusal))
        self._wake()
        return answer

    def take(self) -> list[tuple[Command, Answer]]:
        """Everything that was handed in since the last call, in order; each answer must be given."""
        with self._lock:
            taken = list(self._waiting)
            self._waiting.clear()
        return [(command, answer) for command, answer in taken if answer.set_running_or_notify_cancel()]

    def close(self) -> None:
        """Refuse what is waiting and what comes later."""
        with self._lock:
            self._closed = True
        for _, answer in self.take():
            answer.set_exception(QueryError("the daemon is stopping"))
