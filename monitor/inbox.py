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

    def __init__(self, capacity: int, most_bytes: int = 200_000_000) -> None:
        """Hold at most `capacity` messages, and payloads of `most_bytes` together."""
        self._capacity, self._room = capacity, most_bytes
        self._messages: collections.deque[Message] = collections.deque()
        self._dropped: collections.Counter[str] = collections.Counter()
        self._lock = threading.Lock()
        self._event = threading.Event()

    def put(self, message: Message) -> None:
        """Take a message, or count it as dropped."""
        with self._lock:
            if len(self._messages) < self._capacity and len(message.payload) <= self._room:
                self._messages.append(message)
                self._room -= len(message.payload)
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
            self._room += sum(len(message.payload) for message in messages)
            dropped, self._dropped = dict(self._dropped), collections.Counter()
            if not self._messages:
                self._event.clear()
        return messages, dropped

    def __len__(self) -> int:
        """Messages waiting."""
        return len(self._messages)
