"""The reader with the questions only pages ask: the whole fleet, the watch of one axis. Only reads."""

from __future__ import annotations

from typing import Any

from sqlalchemy import select

from monitor.errors import UnknownError
from monitor.models_life import DiagnosisRow
from monitor.picture_values import figures_of
from monitor.queries import Reader
from monitor.query_fleet import fleet
from monitor.query_watch import curves, watched
from monitor.questions import POINTS
from monitor.times import iso


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

    def diagnosis(self, axis: str, number: int) -> dict[str, Any]:
        """One diagnosis of `axis` with the figures of its evidence; the pictures themselves stay here.

        Raises:
            UnknownError: there is none of this number.
        """
        with self._read() as db:
            mine = DiagnosisRow.axis_id == self._axis_row(db, axis)["id"]
            row = db.execute(select(DiagnosisRow.__table__).where(mine, DiagnosisRow.id == number)).mappings().first()
        if row is None:
            raise UnknownError(f"axis {axis!r} has no diagnosis number {number}; /axes/{axis}/diagnoses lists them")
        result = dict(row["result"])
        pictures = result.pop("pictures", None)
        return {
            "number": row["id"],
            "axis": axis,
            "result": result,
            "figures": figures_of(pictures, result.get("location")),
            **{name: iso(row[f"{name}_ns"]) for name in ("at", "from", "to")},
            **{name: row[name] for name in ("verdict", "windows", "seed", "software", "seconds")},
        }

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
