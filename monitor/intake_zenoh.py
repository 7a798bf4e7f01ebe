"""The stream's way in: a Zenoh subscription that only puts what arrives into a bounded queue."""

from __future__ import annotations

import collections
import threading
import time
from dataclasses import dataclass
from typing import Any

import structlog
import zenoh
import zenoh.ext

from plant import keys

log = structlog.get_logger()
HISTORY_BLOCKS = 600  # per publisher, asked for when we (re)join


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


class Intake:
    """The subscription to all axes of a site, with history of late joiners and recovery of lost samples."""

    def __init__(self, session: zenoh.Session, site: str, prefix: str, inbox: Inbox) -> None:
        """Subscribe; messages go to `inbox` from Zenoh's threads."""
        self._inbox = inbox
        self._missed = 0
        self._subscriber = zenoh.ext.declare_advanced_subscriber(
            session,
            keys.samples_pattern(site, prefix),
            self._receive,
            history=zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=HISTORY_BLOCKS),
            recovery=zenoh.ext.RecoveryConfig(periodic_queries=None, heartbeat=True),
        )
        self._listener: Any = self._subscriber.sample_miss_listener(self._miss)

    def _receive(self, sample: zenoh.Sample) -> None:
        try:
            if sample.kind == zenoh.SampleKind.PUT:
                payload = sample.payload.to_bytes()
                self._inbox.put(Message(str(sample.key_expr), str(sample.encoding), payload, time.monotonic()))
        except Exception as error:  # Zenoh would print it and forget it
            log.error("cannot take a message", error=f"{type(error).__name__}: {error}")

    def _miss(self, miss: Any) -> None:
        self._missed += int(miss.nb)
        log.warning("messages lost on the way", count=int(miss.nb), total=self._missed)

    def close(self) -> None:
        """Unsubscribe, in reverse order."""
        self._listener.undeclare()
        self._subscriber.undeclare()  # type: ignore[no-untyped-call]
