"""Questions about the life of an axis: events, versions of its model, diagnoses, evidence."""

from __future__ import annotations

from typing import Any

from sqlalchemy import Connection, func, select

from monitor.alarm_kpi import Move, figures
from monitor.errors import UnknownError
from monitor.models import AxisRow, TransitionRow
from monitor.models_life import AxisVersionRow, DiagnosisRow, EventRow, EvidenceRow
from monitor.query_base import ReaderBase
from monitor.query_rows import POINTS, SCHEMA_VERSION, between
from monitor.times import iso

LAST_ROW = 2**63 - 1  # a database numbers no further
EVIDENCE = (EvidenceRow.id, EvidenceRow.transition_id, EvidenceRow.diagnosis_id, EvidenceRow.at_ns, EvidenceRow.kind)


class LifeReader(ReaderBase):
    """Events, versions, diagnoses, evidence."""

    def events(
        self, axis: str, *, from_ns: int | None = None, to_ns: int | None = None, limit: int = POINTS
    ) -> list[dict[str, Any]]:
        """What was done to an axis, oldest first, the latest `limit`. Bounds are event time. [ns]"""
        with self._read() as db:
            return self._events(db, self._axis_row(db, axis), from_ns, to_ns, limit)

    def _events(
        self, db: Connection, row: Any, from_ns: int | None, to_ns: int | None, limit: int
    ) -> list[dict[str, Any]]:
        query = select(EventRow.__table__).where(EventRow.axis_id == row["id"])
        query = query.where(*between(EventRow.at_ns, from_ns, to_ns))
        query = query.order_by(EventRow.at_ns.desc(), EventRow.id.desc()).limit(limit)
        names = ("kind", "text", "author", "new_baseline", "at_ns")
        return [
            {"number": one["id"], "axis": row["name"], "at": iso(one["at_ns"])} | {name: one[name] for name in names}
            for one in reversed(db.execute(query).mappings().all())
        ]

    def alarm_figures(self, axis: str | None = None, *, since_ns: int | None = None) -> dict[str, Any]:
        """How good the alarms are: the figures of ISA-18.2, of one axis or all.

        Args:
            axis: only this one.
            since_ns: this far back from the latest sample of any axis; None = from the first transition on. [ns]
        """
        t = TransitionRow
        query = select(t.kind, t.event, t.before, t.after, t.at_ns, t.author, t.alert, AxisRow.name)
        query = query.join(AxisRow, AxisRow.id == t.axis_id).order_by(t.id)
        with self._read() as db:
            newest = select(func.max(AxisRow.last_ns))
            if axis is not None:
                row = self._axis_row(db, axis)
                query, newest = query.where(t.axis_id == row["id"]), newest.where(AxisRow.id == row["id"])
            moves = [
                Move(one.name, one.kind, one.alert.get("priority", "low"), one.event, one.before, one.after,
                     one.at_ns, one.author)
                for one in db.execute(query)
            ]  # fmt: skip
            latest = db.scalar(newest)
        stamps = [one.at_ns for one in moves]
        to_ns = max([*stamps, latest or 0])  # staleness is stamped by the wall clock
        first = min(stamps, default=to_ns)
        from_ns = first if since_ns is None else (latest or to_ns) - since_ns
        return {"schema_version": SCHEMA_VERSION, "axis": axis, **figures(moves, from_ns, to_ns)}

    def versions(self, axis: str) -> list[dict[str, Any]]:
        """Versions of an axis' constants and promoted effects, oldest first."""
        with self._read() as db:
            query = select(AxisVersionRow.__table__).where(AxisVersionRow.axis_id == self._axis_row(db, axis)["id"])
            rows = db.execute(query.order_by(AxisVersionRow.version)).mappings().all()
        names = ("version", "from_ns", "constants", "effects", "author", "why")
        return [{name: one[name] for name in names} | {"axis": axis, "from": iso(one["from_ns"])} for one in rows]

    def diagnoses(self, axis: str, *, limit: int = POINTS) -> list[dict[str, Any]]:
        """Diagnoses of an axis, oldest first, the latest `limit`, each with the JSON of `tribowatch diagnose`."""
        with self._read() as db:
            query = select(DiagnosisRow.__table__).where(DiagnosisRow.axis_id == self._axis_row(db, axis)["id"])
            rows = db.execute(query.order_by(DiagnosisRow.id.desc()).limit(limit)).mappings().all()
        names = ("at_ns", "from_ns", "to_ns", "verdict", "result", "windows", "seed", "software", "seconds")
        return [
            {"number": one["id"], "axis": axis, "at": iso(one["at_ns"])} | {name: one[name] for name in names}
            for one in reversed(rows)
        ]

    def evidence_list(self, axis: str | None = None, *, limit: int = POINTS) -> list[dict[str, Any]]:
        """What bundles of evidence are kept, newest first: number, axis, kind, time, hash; without their content."""
        query = select(*EVIDENCE, EvidenceRow.sha256, AxisRow.name).join(AxisRow, AxisRow.id == EvidenceRow.axis_id)
        with self._read() as db:
            if axis is not None:
                query = query.where(EvidenceRow.axis_id == self._axis_row(db, axis)["id"])
            rows = db.execute(query.order_by(EvidenceRow.id.desc()).limit(limit)).mappings().all()
        return [
            {
                "number": one["id"],
                "axis": one["name"],
                "kind": one["kind"],
                "transition": one["transition_id"],
                "diagnosis": one["diagnosis_id"],
                "at": iso(one["at_ns"]),
                "at_ns": one["at_ns"],
                "sha256": one["sha256"],
            }
            for one in rows
        ]

    def evidence(self, number: int) -> bytes:
        """The zip of one bundle, as it was kept.

        Raises:
            UnknownError: there is none of this number.
        """
        with self._read() as db:
            known = 0 < number <= LAST_ROW
            blob = db.scalar(select(EvidenceRow.blob).where(EvidenceRow.id == number)) if known else None
        if blob is None:
            raise UnknownError(f"there is no evidence number {number}; tribowatch alerts evidence lists what is kept")
        return bytes(blob)
