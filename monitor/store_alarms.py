"""The store's part for alarms: their state, the audit of their transitions, and who outside is yet to be told."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Iterable, Sequence
from typing import Any

from sqlalchemy import Connection, delete, insert, select, update

from monitor.models import AlarmRow, AxisRow, TransitionRow
from monitor.models_life import OutboxRow
from monitor.store_records import AlarmRecord, Change, Letter
from monitor.store_rows import alarm_of
from monitor.store_sharing import SharingStore


class AlarmStore(SharingStore):
    """Alarms, transitions and the outbox."""

    def save_alarms(self, axis_id: int, alarms: Iterable[AlarmRecord], changes: Sequence[Change]) -> list[int]:
        """Store alarms that changed without an estimate (staleness, commands); return the ids of the transitions."""
        with self._write() as db:
            self._fence(db, [axis_id])
            return self._save_alarms(db, axis_id, alarms, changes)

    def _save_alarms(
        self, db: Connection, axis_id: int, alarms: Iterable[AlarmRecord], changes: Sequence[Change]
    ) -> list[int]:
        for record in alarms:
            where = (AlarmRow.axis_id == axis_id) & (AlarmRow.kind == record.kind)
            values = {
                "state": record.alarm.state.value,
                "occurrence": record.occurrence,
                "machine": dataclasses.asdict(record.alarm),
                "alert": record.alert,
            }
            if db.execute(update(AlarmRow).where(where).values(values)).rowcount == 0:
                db.execute(insert(AlarmRow).values(axis_id=axis_id, kind=record.kind, **values))
        ids = []
        for change in changes:
            row = insert(TransitionRow).values(
                axis_id=axis_id,
                kind=change.record.kind,
                event=change.transition.event.value,
                before=change.transition.before.value,
                after=change.transition.after.value,
                at_ns=change.transition.at_ns,
                author=change.author,
                alert=change.record.alert or {},
            )
            ids.append(int(db.execute(row.returning(TransitionRow.id)).scalar_one()))
        letters = [
            {"transition_id": number, "receiver": one}
            for number, change in zip(ids, changes, strict=True)
            for one in self.receivers
            if change.record.alert  # put aside before it was ever raised: nothing to tell
        ]
        if letters:
            db.execute(insert(OutboxRow), letters)
        return ids

    def alarms(self, axis_id: int) -> dict[str, AlarmRecord]:
        """Alarms of an axis by kind, as they were left."""
        with self._write() as db:
            rows = db.execute(select(AlarmRow.__table__).where(AlarmRow.axis_id == axis_id)).mappings()
            return {
                row["kind"]: AlarmRecord(row["kind"], alarm_of(row["machine"]), row["occurrence"], row["alert"])
                for row in rows
            }

    def untold(self) -> list[tuple[int, int, dict[str, Any]]]:
        """(id, axis id, row) of the transitions that were stored but perhaps never published."""
        query = select(TransitionRow.__table__).where(TransitionRow.published.is_(False)).order_by(TransitionRow.id)
        with self._write() as db:
            return [(row["id"], row["axis_id"], dict(row)) for row in db.execute(query).mappings()]

    def mark_told(self, ids: Sequence[int]) -> None:
        """Note that these transitions were published."""
        with self._write() as db:
            db.execute(update(TransitionRow).where(TransitionRow.id.in_(ids)).values(published=True))

    # --- outbox -------------------------------------------------------------------------------------------

    def next_letter(self, receiver: str, axes: Collection[int]) -> Letter | None:
        """The oldest transition of `axes` (their rows) that `receiver` was not told yet; None when it knows all."""
        query = (
            select(OutboxRow.id.label("letter"), OutboxRow.tries, OutboxRow.next_ns, TransitionRow.__table__)
            .add_columns(AxisRow.name.label("axis"))
            .join(TransitionRow, TransitionRow.id == OutboxRow.transition_id)
            .join(AxisRow, AxisRow.id == TransitionRow.axis_id)
            .where(OutboxRow.receiver == receiver, OutboxRow.delivered_ns.is_(None), TransitionRow.axis_id.in_(axes))
            .order_by(OutboxRow.transition_id)
            .limit(1)
        )
        with self._write() as db:
            row = db.execute(query).mappings().first()
        if row is None:
            return None
        return Letter(row["letter"], receiver, row["tries"], row["next_ns"], row["axis"], dict(row))

    def letter_delivered(self, letter: int, at_ns: int, error: str = "") -> None:
        """Note that a letter needs no further try; with `error` because its receiver refuses it for good. [ns]"""
        values = {"delivered_ns": at_ns, "last_error": error, "tries": OutboxRow.tries + 1}
        with self._write() as db:
            db.execute(update(OutboxRow).where(OutboxRow.id == letter).values(values))

    def letter_failed(self, letter: int, next_ns: int, error: str) -> None:
        """Note a failed try, and when the next one is due on the wall clock. [ns]"""
        values = {"next_ns": next_ns, "last_error": error, "tries": OutboxRow.tries + 1}
        with self._write() as db:
            db.execute(update(OutboxRow).where(OutboxRow.id == letter).values(values))

    def thin_out_letters(self, before_ns: int) -> int:
        """Delete letters that were delivered before `before_ns` on the wall clock [ns]; count them."""
        with self._write() as db:
            old = delete(OutboxRow).where(OutboxRow.delivered_ns < before_ns)
            return int(db.execute(old).rowcount)
