"""What arrived and waits for the supervising thread: a bounded queue.

Who puts waits for room only while the consumer is at work: after a restart the publishers' caches come all at once, and
what Zenoh still holds is not lost. A consumer that hangs delays nobody: then messages are dropped and counted.
"""

from __future__ import annotations

import collections
import threading
import time
from dataclasses import dataclass

PATIENCE = 3.0  # s that one put waits for room; below Zenoh's leases (5 s), and once only between two takes


@dataclass(frozen=True, slots=True)
class Message:
    """A payload as it arrived: key, encoding, bytes, and when, on the monotonic clock. [s]

    `fetched`: we asked a cache for all it holds. `complete` marks the end of that; there is no payload then, and always
    room, for who waits for it would wait for ever.
    """

    key: str
    encoding: str
    payload: bytes
    arrived: float
    fetched: bool = False
    complete: bool = False


class Inbox:
    """A bounded queue that also wakes its one consumer for other reasons. What does not fit is counted per key."""

    def __init__(self, capacity: int, most_bytes: int = 200_000_000) -> None:
        """Hold at most `capacity` messages, and payloads of `most_bytes` together."""
        self._capacity, self._room = capacity, most_bytes
        self._messages: collections.deque[Message] = collections.deque()
        self._dropped: collections.Counter[str] = collections.Counter()
        self._lock = threading.Condition()
        self._event = threading.Event()
        self._taken = time.monotonic()  # when the consumer took last; at first it is about to. [s]
        self._patient = True

    def put(self, message: Message) -> None:
        """Take a message, wait a moment for room if need be, or count it as dropped."""
        with self._lock:
            if not self._fits(message) and self._patient and time.monotonic() - self._taken < PATIENCE:
                self._patient = self._lock.wait_for(lambda: self._fits(message), PATIENCE)
            if self._fits(message):
                self._messages.append(message)
                self._room -= len(message.payload)
            elif message.key in self._dropped or len(self._dropped) < self._capacity:
                self._dropped[message.key] += 1
        self._event.set()

    def _fits(self, message: Message) -> bool:
        if message.complete:
            return True
        return len(self._messages) < self._capacity and len(message.payload) <= self._room

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
            self._taken, self._patient = time.monotonic(), True
            self._lock.notify_all()
            if not self._messages:
                self._event.clear()
        return messages, dropped

    def __len__(self) -> int:
        """Messages waiting."""
        return len(self._messages)
