"""What arrived and waits for the supervising thread: a bounded queue that never blocks the one who puts."""

from __future__ import annotations

import collections
import threading
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Message:
    """A payload as it arrived: key, encoding, bytes, and when, on the monotonic clock. [s]"""

    key: str
    encoding: str
    payload: bytes
    arrived: float


class Inbox:
    """A bounded queue that also wakes its one consumer for other reasons. What does not fit is counted per key."""

    def __init__(self, capacity: int) -> None:
        """Hold at most `capacity` messages."""
        self._capacity = capacity
        self._messages: collections.deque[Message] = collections.deque()
        self._dropped: collections.Counter[str] = collections.Counter()
        self._lock = threading.Lock()
        self._event = threading.Event()

    def put(self, message: Message) -> None:
        """Take a message, or count it as dropped."""
        with self._lock:
            if len(self._messages) < self._capacity:
                self._messages.append(message)
            elif len(self._dropped) < self._capacity:
                self._dropped[message.key] += 1
        self._event.set()

    def wake(self) -> None:
        """Let `take` return at once."""
        self._event.set()

    def take(self, most: int, timeout: float) -> tuple[list[Message], dict[str, int]]:
        """Wait at most `timeout` [s] for something; return up to `most` messages, and the drops by key since then."""
        self._event.wait(timeout)
        with self._lock:
            messages = [self._messages.popleft() for _ in range(min(most, len(self._messages)))]
            dropped, self._dropped = dict(self._dropped), collections.Counter()
            if not self._messages:
                self._event.clear()
        return messages, dropped

    def __len__(self) -> int:
        """Messages waiting."""
        return len(self._messages)
