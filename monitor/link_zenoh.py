"""Questions to the network for `tribowatch doctor`: is the daemon alive, would anybody take these samples?"""

from __future__ import annotations

import time
from typing import Any

import zenoh

from plant import keys

MATCHING_TIMEOUT = 1.0  # s; a subscriber is known some milliseconds after the link


def is_alive(session: zenoh.Session, site: str, prefix: str, who: str = "daemon") -> bool:
    """Whether the liveliness token of `who` is there."""
    return any(reply.ok for reply in session.liveliness().get(keys.alive_key(site, who, prefix), timeout=1.0))


def is_matched(session: zenoh.Session, site: str, axis: str, prefix: str) -> bool:
    """Whether somebody subscribes to the samples of `axis`; nothing is published to find out."""
    publisher = session.declare_publisher(keys.samples_key(site, axis, prefix))
    deadline = time.monotonic() + MATCHING_TIMEOUT
    try:
        while not _matching(publisher):
            if time.monotonic() > deadline:
                return False
            time.sleep(0.01)
        return True
    finally:
        publisher.undeclare()  # type: ignore[no-untyped-call]


def _matching(publisher: zenoh.Publisher) -> bool:
    status: Any = publisher.matching_status  # its stub says bool, it is an object
    return bool(status.matching)
