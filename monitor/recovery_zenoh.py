"""Asks publishers' caches for what is missing of one axis. Does I/O.

Zenoh's own recovery gives up as soon as one of its queries comes back without the missing message, which happens when
the computer is busy and several are under way; what it skipped is still in the cache of the publisher.
"""

from __future__ import annotations

import threading
import time

import structlog
import zenoh

from monitor.inbox import Inbox, Message
from monitor.intake_zenoh import HISTORY_BLOCKS

log = structlog.get_logger()

AT_ONCE = 4  # axes; a cache may hold megabytes
TIMEOUT = 10.0  # s


class Recovery:
    """Fetches caches into the queue of the stream, where those who know sort out what they have already."""

    def __init__(self, session: zenoh.Session, inbox: Inbox) -> None:
        """Nothing is asked yet."""
        self._session, self._inbox = session, inbox
        self._lock = threading.Lock()
        self._asked = 0

    def fetch(self, key: str) -> bool:
        """Ask for what the caches hold of `key`; a message that says `complete` follows the last. False: ask later."""
        with self._lock:
            if self._asked >= AT_ONCE:
                return False
            self._asked += 1
        try:
            self._session.get(
                f"{key}/@adv/**?_max={HISTORY_BLOCKS}",
                zenoh.handlers.Callback(self._take, drop=lambda: self._end(key)),
                target=zenoh.QueryTarget.ALL,
                consolidation=zenoh.ConsolidationMode.NONE,
                accept_replies=zenoh.ReplyKeyExpr.ANY,
                timeout=TIMEOUT,
            )
        except zenoh.ZError as error:
            log.warning("cannot ask for what is missing", key=key, error=str(error))
            self._end(key)
        return True

    def _take(self, reply: zenoh.Reply) -> None:
        if (sample := reply.ok) is None:
            return
        try:
            payload, now = sample.payload.to_bytes(), time.monotonic()
            self._inbox.put(Message(str(sample.key_expr), str(sample.encoding), payload, now, fetched=True))
        except Exception as error:  # Zenoh would print it and forget it
            log.error("cannot take a message", error=f"{type(error).__name__}: {error}")

    def _end(self, key: str) -> None:
        with self._lock:
            self._asked -= 1
        self._inbox.put(Message(key, "", b"", time.monotonic(), complete=True))
