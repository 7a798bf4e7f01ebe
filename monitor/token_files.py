"""The file of the page's tokens: hashes with name and role, readable by its owner alone. Does I/O."""

from __future__ import annotations

import contextlib
import os
import re
import secrets
import tempfile
from datetime import UTC, datetime
from pathlib import Path

from monitor.errors import TokenError
from monitor.tokens import BYTES, PREFIX, Role, Token, Visitor, digest, holder
from plant.axis import AXIS_NAME
from plant.toml_files import read_toml

HEAD = "# tokens of tribowatch's page, made by `tribowatch token add`; hashes only, a lost token cannot be read here\n"


class TokenFile:
    """The tokens at `path`, read again when the file changes: a token taken back stops working at once."""

    def __init__(self, path: Path) -> None:
        """Read it.

        Raises:
            TokenError: no such file, or not a token file.
        """
        self._path = path
        self._stamp: tuple[int, int, int] | None = None
        self._tokens: tuple[Token, ...] = ()
        self._refresh()

    def holder(self, shown: str) -> Visitor | None:
        """Whose token was `shown`; nobody's while the file cannot be read."""
        try:
            self._refresh()
        except TokenError:
            return None
        return holder(self._tokens, shown)

    def _refresh(self) -> None:
        try:
            seen = self._path.stat()
        except OSError as error:
            raise TokenError(
                f"{self._path}: cannot read the token file: {error.strerror}; {_made_by(self._path)}"
            ) from None
        stamp = (seen.st_mtime_ns, seen.st_size, seen.st_ino)
        if stamp != self._stamp:
            self._tokens = read_tokens(self._path)
            self._stamp = stamp


def read_tokens(path: Path) -> tuple[Token, ...]:
    """The tokens at `path`.

    Raises:
        TokenError: it cannot be read, or holds something else.
    """
    content = read_toml(path, "token file", TokenError, f"no such token file; {_made_by(path)}")
    try:
        rows = content.get("token", [])
        if set(content) - {"token"}:
            raise KeyError(", ".join(set(content) - {"token"}))
        return tuple(Token(row["name"], Role(row["role"]), _hash(row["sha256"]), row.get("made", "")) for row in rows)
    except (KeyError, ValueError, TypeError) as error:
        raise TokenError(f"{path}: not a token file ({error}); make one with tribowatch token add") from None


def add_token(path: Path, name: str, role: Role) -> str:
    """Make a token for `name` and keep its hash at `path`; gives the token, which nobody can read again.

    Raises:
        TokenError: the name is taken or odd, or the file cannot be written.
    """
    if not re.fullmatch(AXIS_NAME, name):
        raise TokenError(f"name {name!r} of a token must be letters, digits, '_', '.', '-', at most 40, as in anna")
    known = read_tokens(path) if path.exists() else ()
    if any(one.name == name for one in known):
        raise TokenError(f"{path}: {name} has a token already; take it back first: tribowatch token remove {name}")
    token = PREFIX + secrets.token_urlsafe(BYTES)
    made = f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ}"
    _write(path, (*known, Token(name, role, digest(token), made)))
    return token


def remove_token(path: Path, name: str) -> None:
    """Take back the token of `name`.

    Raises:
        TokenError: there is none, or the file cannot be read or written.
    """
    known = read_tokens(path)
    left = tuple(one for one in known if one.name != name)
    if len(left) == len(known):
        raise TokenError(f"{path}: no token of {name!r}; there are {', '.join(one.name for one in known) or 'none'}")
    _write(path, left)


def _write(path: Path, tokens: tuple[Token, ...]) -> None:
    """Replace the file in one step; only its owner may read it."""
    text = HEAD + "".join(
        f'\n[[token]]\nname = "{one.name}"\nrole = "{one.role}"\nsha256 = "{one.sha256}"\nmade = "{one.made}"\n'
        for one in tokens
    )
    try:
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=path.name)  # mode 600
        try:
            with os.fdopen(handle, "w", encoding="utf-8") as file:
                file.write(text)
                file.flush()
                os.fsync(file.fileno())
            Path(name).replace(path)
        except OSError:
            with contextlib.suppress(OSError):
                Path(name).unlink()
            raise
    except OSError as error:
        raise TokenError(f"{path}: cannot be written ({error.strerror}); name another --file") from None


def _hash(text: str) -> str:
    if not re.fullmatch("[0-9a-f]{64}", text):
        raise ValueError("sha256 must be 64 hexadecimal digits")
    return text


def _made_by(path: Path) -> str:
    return f"make it: tribowatch token add NAME --file {path}"
