"""The way out: parameters, model, alerts and status as JSON on the documented keys, and a liveliness token."""

from __future__ import annotations

import json
from typing import Any

import zenoh
import zenoh.ext

from plant import keys

KEPT = {"alerts": 100}  # messages a late joiner gets; of the others the latest


class Publications:
    """Declares a publisher per axis and output when it is first needed; late joiners get the latest answers.

    Belongs to the supervising thread.
    """

    def __init__(self, session: zenoh.Session, site: str, prefix: str) -> None:
        """Publish on `session`."""
        self._session, self._site, self._prefix = session, site, prefix
        self._publishers: dict[tuple[str, str], zenoh.ext.AdvancedPublisher] = {}
        self._token: zenoh.LivelinessToken | None = None

    def alive(self, who: str) -> None:
        """Show that we are there; gone when the process is."""
        key = keys.alive_key(self._site, who, self._prefix)
        self._token = self._session.liveliness().declare_token(key)

    def publish(self, what: str, axis: str, content: dict[str, Any]) -> None:
        """Put `content` as JSON on `<prefix>/<site>/<axis>/<what>`."""
        publisher = self._publishers.get((what, axis))
        if publisher is None:
            publisher = zenoh.ext.declare_advanced_publisher(
                self._session,
                keys.output_key(self._site, axis, what, self._prefix),
                encoding=zenoh.Encoding.APPLICATION_JSON,
                cache=zenoh.ext.CacheConfig(max_samples=KEPT.get(what, 1)),
                publisher_detection=True,
                congestion_control=zenoh.CongestionControl.BLOCK_FIRST,
            )
            self._publishers[what, axis] = publisher
        publisher.put(json.dumps(content, allow_nan=False))

    def close(self) -> None:
        """Take everything back, the token first."""
        if self._token is not None:
            self._token.undeclare()  # type: ignore[no-untyped-call]
        for publisher in self._publishers.values():
            publisher.undeclare()  # type: ignore[no-untyped-call]
        self._publishers.clear()
