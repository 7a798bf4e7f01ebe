"""What the daemon last said and how it is doing, for the threads that show it. Safe for threads; no I/O."""

from __future__ import annotations

import collections
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

BOUNDS = (0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0)  # s, of the histogram of identification times


@dataclass(frozen=True, slots=True)
class Beat:
    """The supervising thread's own numbers at its latest turn.

    Attributes:
        at: monotonic time. [s]
        inbox: blocks received and not yet looked at. [1]
        backlog: windows without an answer. [1]
        busy: windows in the workers. [1]
    """

    at: float
    inbox: int = 0
    backlog: int = 0
    busy: int = 0


@dataclass(slots=True)
class Durations:
    """A histogram of how long identification took; the last bucket has no upper bound."""

    buckets: list[int] = field(default_factory=lambda: [0] * (len(BOUNDS) + 1))
    total: float = 0.0

    def add(self, seconds: float) -> None:
        """Count one."""
        self.buckets[next((i for i, bound in enumerate(BOUNDS) if seconds <= bound), len(BOUNDS))] += 1
        self.total += seconds


class Board:
    """Written by the supervising thread, read by the page's."""

    def __init__(self, clock: Callable[[], float]) -> None:
        """`clock` is monotonic. [s]"""
        self._clock, self._lock = clock, threading.Lock()
        self._status: dict[str, dict[str, Any]] = {}
        self._verdicts: collections.Counter[str] = collections.Counter()
        self._durations = Durations()
        self._transitions: collections.Counter[tuple[str, str]] = collections.Counter()
        self.started = clock()
        self.beat = Beat(self.started)

    def hear(self, what: str, axis: str, content: dict[str, Any]) -> None:
        """Note what is published about `axis`."""
        with self._lock:
            match what:
                case "status":
                    self._status[axis] = content
                case "parameters":
                    self._verdicts[str(content.get("verdict"))] += 1
                    self._durations.add(float(content.get("seconds") or 0.0))
                case "alerts":
                    self._transitions[str(content.get("kind")), str(content["transition"]["after"])] += 1

    def turn(self, inbox: int, backlog: int, busy: int) -> None:
        """The supervising thread has come round once more."""
        self.beat = Beat(self._clock(), inbox, backlog, busy)

    @property
    def uptime(self) -> float:
        """Since the start. [s]"""
        return self._clock() - self.started

    @property
    def silence(self) -> float:
        """Since the supervising thread's latest turn. [s]"""
        return self._clock() - self.beat.at

    def statuses(self) -> dict[str, dict[str, Any]]:
        """Latest `.../status` by axis."""
        with self._lock:
            return dict(self._status)

    def answers(self) -> tuple[dict[str, int], Durations]:
        """Answers since the start by verdict, and how long they took."""
        with self._lock:
            return dict(self._verdicts), Durations(list(self._durations.buckets), self._durations.total)

    def transitions(self) -> dict[tuple[str, str], int]:
        """Changes of alarms since the start by kind and new state."""
        with self._lock:
            return dict(self._transitions)
