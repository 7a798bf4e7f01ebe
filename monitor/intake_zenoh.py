"""The stream's way in: a Zenoh subscription that only puts what arrives into a bounded queue."""

from __future__ import annotations

import time
from typing import Any

import structlog
import zenoh
import zenoh.ext

from monitor.inbox import Inbox, Message
from plant import keys

log = structlog.get_logger()
HISTORY_BLOCKS = 600  # per publisher, asked for when we (re)join


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
