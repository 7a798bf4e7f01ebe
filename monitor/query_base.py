"""What every part of the reader stands on: one engine that changes nothing, one snapshot a question."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from types import TracebackType
from typing import Any, Self

from sqlalchemy import Connection, select

from monitor.database import explained, make_engine
from monitor.errors import UnknownError
from monitor.models import AxisRow
from monitor.schema import check_version
from plant.checks import nearest


class ReaderBase:
    """Read-only access to the history at a database URL; a context manager. One per thread, or lock around it.

    Raises:
        DatabaseError: from every method: no database there, not ours, of another version, or broken.
    """

    def __init__(self, url: str) -> None:
        """Open without changing anything."""
        self.url = url
        self._engine = make_engine(url, read_only=True)
        try:
            with self._read() as db:
                check_version(db, url, must_be_current=True)
        except BaseException:
            self._engine.dispose()
            raise

    def __enter__(self) -> Self:
        """Return the reader."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """Close."""
        self.close()

    def close(self) -> None:
        """Close every connection."""
        self._engine.dispose()

    @contextlib.contextmanager
    def _read(self) -> Iterator[Connection]:
        """One snapshot: all that is read inside belongs together."""
        with explained(self.url), self._engine.begin() as connection:
            yield connection

    def _axis_row(self, db: Connection, name: str) -> Any:
        row = db.execute(select(AxisRow.__table__).where(AxisRow.name == name)).mappings().first()
        if row is None:
            known = list(db.scalars(select(AxisRow.name).order_by(AxisRow.name)))
            hint = nearest(name, known) if known else "no axis was heard yet"
            raise UnknownError(f"axis {name!r} is not in the history; {hint}")
        return row
