"""Tokens of the page: who may look, who may operate. Pure: what is kept are hashes, never the token itself.

A token is 32 random bytes, so a plain SHA-256 keeps it: there is nothing to guess that a slow hash would protect.
"""

from __future__ import annotations

import enum
import hashlib
import hmac
from collections.abc import Iterable
from dataclasses import dataclass

PREFIX = "tw_"  # so that people and secret scanners recognise one
BYTES = 32  # of chance in a token


class Role(enum.StrEnum):
    """What a token allows: `view` everything, or `operate` too (acknowledge, shelve, promote ...)."""

    VIEW = "view"
    OPERATE = "operate"


@dataclass(frozen=True, slots=True)
class Token:
    """A token as it is kept.

    Attributes:
        name: of its holder; the author of what is done with it.
        role: what it allows.
        sha256: of the token, hexadecimal.
        made: when, RFC 3339.
    """

    name: str
    role: Role
    sha256: str
    made: str = ""


@dataclass(frozen=True, slots=True)
class Visitor:
    """Who asks: the holder of a token, or anybody on this computer where no token is needed."""

    name: str
    role: Role

    @property
    def may_operate(self) -> bool:
        """Whether commands are taken from them."""
        return self.role is Role.OPERATE


LOCAL = Visitor("", Role.OPERATE)  # no name of their own: a command says who gives it


def digest(token: str) -> str:
    """What is kept of a token."""
    return hashlib.sha256(token.encode()).hexdigest()


def holder(tokens: Iterable[Token], shown: str) -> Visitor | None:
    """Whose token was `shown`; None where it is nobody's. Takes the same time wherever it stands in the list."""
    wanted = digest(shown)
    found = None
    for one in tokens:
        if hmac.compare_digest(one.sha256, wanted):
            found = Visitor(one.name, one.role)
    return found
