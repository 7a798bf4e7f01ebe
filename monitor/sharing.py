"""Several daemons share the axes of a site: who watches which, from who is alive. Pure.

Rendezvous hashing: every daemon computes the same answer by itself, and when one dies only its axes move.
The database fences (`StoreBase.claim`): whoever claimed an axis last may write it, so that a daemon that was frozen, or
that the others could not see, can do no harm when it comes back.
"""

from __future__ import annotations

import hashlib
import threading
from collections.abc import Callable, Iterable

from plant.errors import ParameterError
from plant.keys import check_id

TOKEN = "member."  # before a daemon's name in its liveliness token


def token_of(member: str) -> str:
    """Name of the liveliness token of `member`.

    Raises:
        ParameterError: a name that cannot stand in a key.
    """
    try:
        return check_id("who", TOKEN + member)
    except ParameterError:
        raise ParameterError("sharing.member", repr(member), "1-33 of A-Z a-z 0-9 _ . -") from None


def owner_of(axis: str, members: Iterable[str]) -> str:
    """The daemon that watches `axis`: the one whose name with the axis' hashes highest."""
    return max(members, key=lambda member: hashlib.sha256(f"{member}/{axis}".encode()).digest())


class Roster:
    """Who is alive, as seen by one member; safe for threads. Without a name it is alone, and everything is its own."""

    def __init__(self, member: str = "", wake: Callable[[], None] = lambda: None) -> None:
        """`wake` is called from another thread when somebody came or went."""
        self.member = member
        self._members = {member}
        self._lock = threading.Lock()
        self._wake = wake
        self._changes = 0

    def note(self, member: str, alive: bool) -> None:
        """Somebody came or went."""
        if member == self.member:
            return
        with self._lock:
            before = set(self._members)
            (self._members.add if alive else self._members.discard)(member)
            changed = self._members != before
            self._changes += changed
        if changed:
            self._wake()

    @property
    def members(self) -> list[str]:
        """Names of the living, ours included."""
        with self._lock:
            return sorted(self._members)

    @property
    def changes(self) -> int:
        """Grows when somebody comes or goes."""
        return self._changes

    def share(self) -> Callable[[str], bool]:
        """Whether an axis is ours to watch, as things stand now."""
        members = self.members
        return lambda axis: owner_of(axis, members) == self.member
