"""What every part of the store stands on: one engine, one transaction a method."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

from sqlalchemy import Connection, literal, select

from monitor.database import explained, make_engine
from monitor.schema import migrate


class StoreBase:
    """Opens the history at `url` for writing; makes or upgrades the schema.

    Raises:
        DatabaseError: from every method, with one line that says what to do.
    """

    def __init__(self, url: str, *, synchronous: str = "NORMAL", receivers: tuple[str, ...] = ()) -> None:
        """Open and migrate; every transition is put into the outbox for each of `receivers`."""
        self.url, self.receivers = url, receivers
        self._engine = make_engine(url, synchronous=synchronous)
        try:
            migrate(self._engine, url)
        except BaseException:
            self._engine.dispose()
            raise

    def close(self) -> None:
        """Close every connection."""
        self._engine.dispose()

    def renew(self) -> None:
        """Forget every connection: one that SQLite opened while it could not write stays without leave to write."""
        self._engine.dispose()

    def answer(self) -> None:
        """Return when the database answers.

        Raises:
            DatabaseError: it does not; says why.
        """
        with self._write() as db:
            db.execute(select(literal(1)))

    @contextlib.contextmanager
    def _write(self) -> Iterator[Connection]:
        with explained(self.url), self._engine.begin() as connection:
            yield connection
