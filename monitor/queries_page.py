"""The reader with the questions only pages ask: the whole fleet, the watch of one axis. Only reads."""

from __future__ import annotations

from typing import Any

from monitor.queries import Reader
from monitor.query_fleet import fleet
from monitor.query_watch import curves, watched
from monitor.questions import POINTS


class PageReader(Reader):
    """Everything `Reader` answers, and what a page shows besides."""

    def fleet(self) -> list[dict[str, Any]]:
        """One record per axis, the most urgent first."""
        with self._read() as db:
            return fleet(db)

    def curves(self, axis: str) -> dict[str, Any]:
        """Friction against speed of `axis`: now and when it was healthy."""
        with self._read() as db:
            return {"axis": axis, **curves(db, self._axis_row(db, axis))}

    def watched(
        self,
        axis: str,
        *,
        since_ns: int | None = None,
        from_ns: int | None = None,
        to_ns: int | None = None,
        points: int = POINTS,
    ) -> dict[str, Any]:
        """Charts, operating point and verdicts of `axis` over time; times as in `Reader.history`. [ns]"""
        with self._read() as db:
            row = self._axis_row(db, axis)
            if since_ns is not None and row["last_ns"] is not None:
                from_ns = row["last_ns"] - since_ns
            return {"axis": axis, **watched(db, row["id"], from_ns, to_ns, points)}
