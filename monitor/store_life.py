"""The store's part for the life of an axis: events, versions, diagnoses, evidence, its name and its end."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Sequence

from sqlalchemy import delete, func, insert, select, update

from monitor.errors import QueryError
from monitor.models import AlarmRow, AxisRow, WindowRow
from monitor.models_life import AxisVersionRow, DiagnosisRow, EventRow, EvidenceRow
from monitor.samples import Window, WindowId
from monitor.store_records import AxisRecord, DiagnosisRecord, EventRecord, VersionRecord
from monitor.store_rows import window_of
from monitor.store_sharing import SharingStore


class LifeStore(SharingStore):
    """Events, versions, diagnoses, evidence; rename and delete."""

    def add_event(self, axis: AxisRecord, event: EventRecord) -> int:
        """Store an event together with the axis' drift state, which it may have reset; its row."""
        with self._write() as db:
            self._fence(db, [axis.id])
            db.execute(update(AxisRow).where(AxisRow.id == axis.id).values(drift=axis.drift))
            row = insert(EventRow).values(axis_id=axis.id, **dataclasses.asdict(event))
            return int(db.execute(row.returning(EventRow.id)).scalar_one())

    def add_version(self, axis: AxisRecord, version: VersionRecord) -> None:
        """Store a new version of an axis' model together with its drift state; `axis` carries it from now on."""
        with self._write() as db:
            self._fence(db, [axis.id])
            db.execute(insert(AxisVersionRow).values(axis_id=axis.id, **dataclasses.asdict(version)))
            db.execute(update(AxisRow).where(AxisRow.id == axis.id).values(drift=axis.drift))
        axis.version, axis.effects = version.version, dict(version.effects)

    def versions(self, axis_id: int) -> list[VersionRecord]:
        """Versions of an axis' constants and effects, oldest first."""
        query = select(AxisVersionRow.__table__).where(AxisVersionRow.axis_id == axis_id)
        names = [field.name for field in dataclasses.fields(VersionRecord)]
        with self._write() as db:
            rows = db.execute(query.order_by(AxisVersionRow.version)).mappings()
            return [VersionRecord(**{name: row[name] for name in names}) for row in rows]

    def windows_of(self, axis_id: int, ids: Sequence[WindowId]) -> list[tuple[int, Window]]:
        """(row id, window) of those of `ids` that are in the history, oldest first."""
        wanted = {(one.epoch, one.first_seq, one.samples) for one in ids}
        if not wanted:
            return []
        query = select(WindowRow.__table__).where(
            WindowRow.axis_id == axis_id, WindowRow.first_seq.in_({one[1] for one in wanted})
        )
        with self._write() as db:
            rows = db.execute(query.order_by(WindowRow.id)).mappings()
            found = [(int(row["id"]), window_of(row)) for row in rows]
        return [(row, one) for row, one in found if (one.id.epoch, one.id.first_seq, one.id.samples) in wanted]

    def save_drift(self, axis: AxisRecord) -> None:
        """Store what the watch of an axis remembers."""
        with self._write() as db:
            self._fence(db, [axis.id])
            db.execute(update(AxisRow).where(AxisRow.id == axis.id).values(drift=axis.drift))

    def add_diagnosis(self, axis_id: int, diagnosis: DiagnosisRecord) -> int:
        """Store a diagnosis; its row."""
        with self._write() as db:
            self._fence(db, [axis_id])
            row = insert(DiagnosisRow).values(axis_id=axis_id, **dataclasses.asdict(diagnosis))
            return int(db.execute(row.returning(DiagnosisRow.id)).scalar_one())

    def latest_diagnosis(self, axis_id: int) -> DiagnosisRecord | None:
        """The newest diagnosis of an axis as its model is now; None where there is none."""
        begun = select(func.max(AxisVersionRow.from_ns)).where(AxisVersionRow.axis_id == axis_id).scalar_subquery()
        query = select(DiagnosisRow.__table__).where(DiagnosisRow.axis_id == axis_id, DiagnosisRow.at_ns > begun)
        names = [field.name for field in dataclasses.fields(DiagnosisRecord)]
        with self._write() as db:
            row = db.execute(query.order_by(DiagnosisRow.id.desc()).limit(1)).mappings().first()
        return None if row is None else DiagnosisRecord(**{name: row[name] for name in names})

    def add_evidence(
        self,
        axis_id: int,
        at_ns: int,
        kind: str,
        blob: bytes,
        *,
        transition_id: int | None = None,
        diagnosis_id: int | None = None,
    ) -> int:
        """Keep a bundle of evidence (zip) for an alert's transition or a diagnosis; its row. `at_ns` [ns]"""
        values = {"axis_id": axis_id, "at_ns": at_ns, "kind": kind, "blob": blob}
        whose = {"transition_id": transition_id, "diagnosis_id": diagnosis_id}
        sha256 = hashlib.sha256(blob).hexdigest()
        with self._write() as db:
            self._fence(db, [axis_id])
            row = insert(EvidenceRow).values(**values, **whose, sha256=sha256)
            return int(db.execute(row.returning(EvidenceRow.id)).scalar_one())

    def rename_axis(self, axis: AxisRecord, name: str) -> None:
        """Give an axis another name; its history stays its own, what was published keeps the old one.

        Raises:
            QueryError: the history has an axis of that name already.
        """
        with self._write() as db:
            self._fence(db, [axis.id])
            if db.scalar(select(AxisRow.id).where(AxisRow.name == name)) is not None:
                raise QueryError(f"axis {name!r} is in the history already; choose another name")
            db.execute(update(AxisRow).where(AxisRow.id == axis.id).values(name=name))
            for row in db.execute(select(AlarmRow.id, AlarmRow.alert).where(AlarmRow.axis_id == axis.id)).all():
                if row.alert:
                    site, _, rest = row.alert["id"].split("/", 2)
                    alert = {**row.alert, "axis": name, "id": f"{site}/{name}/{rest}"}
                    db.execute(update(AlarmRow).where(AlarmRow.id == row.id).values(alert=alert))
        axis.name = name

    def delete_axis(self, axis_id: int) -> None:
        """Delete an axis with everything that is known of it."""
        with self._write() as db:
            self._fence(db, [axis_id])
            db.execute(delete(AxisRow).where(AxisRow.id == axis_id))

    def thin_out_evidence(self, axis_id: int, before_ns: int) -> int:
        """Delete the evidence of an axis that is older than event time `before_ns` [ns]; count it."""
        with self._write() as db:
            old = delete(EvidenceRow).where(EvidenceRow.axis_id == axis_id, EvidenceRow.at_ns < before_ns)
            return int(db.execute(old).rowcount)
