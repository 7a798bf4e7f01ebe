"""Seeing each other: a liveliness token per daemon that shares the axes, and an ear for those of the others."""

from __future__ import annotations

import zenoh

from monitor.sharing import TOKEN, Roster, token_of
from plant import keys


class Attendance:
    """Declares our token, and keeps `roster` up to date with the others'."""

    def __init__(self, session: zenoh.Session, site: str, prefix: str, roster: Roster) -> None:
        """Take part; those already there are noted before this returns, as far as the links are up."""
        self._roster = roster
        liveliness = session.liveliness()
        self._token = liveliness.declare_token(keys.alive_key(site, token_of(roster.member), prefix))
        pattern = keys.alive_pattern(site, prefix)
        for reply in liveliness.get(pattern, timeout=1.0):
            if reply.ok is not None:
                self._note(str(reply.ok.key_expr), alive=True)
        self._subscriber = liveliness.declare_subscriber(pattern, self._hear, history=True)

    def _hear(self, sample: zenoh.Sample) -> None:
        self._note(str(sample.key_expr), alive=sample.kind == zenoh.SampleKind.PUT)

    def _note(self, key: str, *, alive: bool) -> None:
        who = key.rsplit("/", 1)[1]
        if who.startswith(TOKEN):
            self._roster.note(who.removeprefix(TOKEN), alive)

    def close(self) -> None:
        """Leave: the others take our axes at once."""
        self._token.undeclare()  # type: ignore[no-untyped-call]
        self._subscriber.undeclare()  # type: ignore[no-untyped-call]
