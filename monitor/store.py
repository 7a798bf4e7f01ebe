"""The one writer of the history: journal, windows, estimates, alarms. Every method is one transaction.

A sample is acknowledged only after `commit` returned; a window is in the history once, whatever is killed when.
Not safe for threads: it belongs to the supervising thread. Readers use `queries.py`.
"""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from sqlalchemy import Connection, bindparam, delete, insert, literal, select, update

from monitor.database import explained, make_engine
from monitor.errors import DatabaseError
from monitor.estimate import Estimate
from monitor.models import (
    AlarmRow,
    AxisRow,
    Base,
    BlockRow,
    EstimateRow,
    GapRow,
    ParameterRow,
    TransitionRow,
    WindowRow,
)
from monitor.schema import migrate
from monitor.store_records import AlarmRecord, AxisRecord, Change
from monitor.store_rows import (
    AXIS_COLUMNS,
    alarm_of,
    as_parameters,
    axis_record,
    axis_row,
    block_row,
    estimate_row,
    gap_row,
    join,
    samples_of,
    window_of,
)
from monitor.windows import Outcome, Samples, StreamState, Window, WindowId
from plant.axis import Axis

# Core statements on tables, made once: the intake runs them several times a second for every axis
_INSERT_BLOCK = insert(Base.metadata.tables["block"])
_AXIS = Base.metadata.tables["axis"]
_UPDATE_AXIS = (
    update(_AXIS)
    .where(_AXIS.c.id == bindparam("row"))
    .values({name: bindparam(f"new_{name}") for name in AXIS_COLUMNS})
)


class Store:
    """Writes the history at `url`; makes or upgrades the schema when it opens.

    Raises:
        DatabaseError: from every method, with one line that says what to do.
    """

    def __init__(self, url: str, *, synchronous: str = "NORMAL") -> None:
        """Open and migrate."""
        self.url = url
        self._engine = make_engine(url, synchronous=synchronous)
        migrate(self._engine, url)

    def close(self) -> None:
        """Close every connection."""
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

    # --- axes ---------------------------------------------------------------------------------------------

    def register(self, axes: Iterable[Axis]) -> dict[str, AxisRecord]:
        """Make the listed axes known, unlist the others; return all axes by name."""
        listed = {axis.name: axis for axis in axes}
        with self._write() as db:
            known = set(db.scalars(select(AxisRow.name)))
            for name, axis in listed.items():
                units = {"listed": True, "force_unit": axis.force_unit, "position_unit": axis.position_unit}
                if name in known:
                    db.execute(update(AxisRow).where(AxisRow.name == name).values(units))
                else:
                    db.execute(insert(AxisRow).values(name=name, **units))
            db.execute(update(AxisRow).where(AxisRow.name.not_in(listed)).values(listed=False))
            rows = db.execute(select(AxisRow.__table__)).mappings()
            return {row["name"]: axis_record(row) for row in rows}

    def add_unknown(self, name: str) -> AxisRecord:
        """Note an axis that streams without being listed."""
        with self._write() as db:
            row = insert(AxisRow).values(name=name, listed=False).returning(AxisRow.id)
            return AxisRecord(int(db.execute(row).scalar_one()), name, False, StreamState())

    def gaps_of(self, axis_id: int, epoch: int) -> list[tuple[int, int]]:
        """(from, to) of the gaps already declared in `epoch`."""
        query = select(GapRow.from_seq, GapRow.to_seq).where(
            GapRow.axis_id == axis_id, GapRow.epoch == epoch, GapRow.missing > 0
        )
        with self._write() as db:
            return [(int(start), int(end)) for start, end in db.execute(query)]

    # --- journal ------------------------------------------------------------------------------------------

    def commit(self, batch: Sequence[tuple[AxisRecord, Outcome]]) -> list[tuple[AxisRecord, int, Window]]:
        """Write what the assemblers settled, with their state; return the new windows with their row ids."""
        blocks = [block_row(axis.id, part) for axis, out in batch for part in out.accepted]
        gaps = [gap_row(axis.id, gap) for axis, out in batch for gap in out.gaps]
        windows = []
        with self._write() as db:
            if blocks:
                db.execute(_INSERT_BLOCK, blocks)
            if gaps:
                db.execute(insert(GapRow), gaps)
            for axis, window in [(axis, window) for axis, out in batch for window in out.windows]:
                times = {"start_ns": window.start_ns, "end_ns": window.end_ns}
                row = insert(WindowRow).values(axis_id=axis.id, **dataclasses.asdict(window.id), **times)
                windows.append((axis, int(db.execute(row.returning(WindowRow.id)).scalar_one()), window))
            if batch:
                db.execute(_UPDATE_AXIS, [axis_row(axis) for axis, _ in batch])
        return windows

    def pending(self) -> list[tuple[int, int, Window]]:
        """(row id, axis id, window) of every complete window without an answer, oldest first."""
        query = select(WindowRow.__table__).where(WindowRow.done.is_(False))
        with self._write() as db:
            rows = db.execute(query.order_by(WindowRow.axis_id, WindowRow.epoch, WindowRow.first_seq)).mappings()
            return [(row["id"], row["axis_id"], window_of(row)) for row in rows]

    def read(self, axis_id: int, window: WindowId) -> Samples:
        """Raw samples of a window, from the journal.

        Raises:
            DatabaseError: the journal does not hold them (which would be an error of ours).
        """
        end = window.first_seq + window.samples
        query = select(BlockRow.__table__).where(
            BlockRow.axis_id == axis_id,
            BlockRow.epoch == window.epoch,
            BlockRow.seq < end,
            BlockRow.seq + BlockRow.n > window.first_seq,
        )
        with self._write() as db:
            parts = [samples_of(row) for row in db.execute(query.order_by(BlockRow.seq)).mappings()]
        whole = join(parts)
        if whole is None or whole.seq > window.first_seq or whole.end < end or len(whole) != whole.end - whole.seq:
            raise DatabaseError(f"{self.url}: the journal does not hold {window} of axis {axis_id}")
        return whole.cut(window.first_seq, end)

    def prune(self, axis_id: int, needed_from: tuple[int, int], keep_windows: int) -> int:
        """Delete blocks that neither a pending nor a future window nor the newest `keep_windows` need; count them."""
        epoch, seq = needed_from
        with self._write() as db:
            done = select(WindowRow.epoch, WindowRow.first_seq).where(WindowRow.axis_id == axis_id)
            open_first = db.execute(
                done.where(WindowRow.done.is_(False)).order_by(WindowRow.epoch, WindowRow.first_seq).limit(1)
            ).first()
            kept = done.where(WindowRow.done.is_(True)).order_by(WindowRow.epoch.desc(), WindowRow.first_seq.desc())
            kept_first = db.execute(kept.limit(1).offset(keep_windows - 1)).first() if keep_windows else None
            if keep_windows and kept_first is None:
                return 0
            firsts = [(epoch, seq), *((int(row[0]), int(row[1])) for row in (open_first, kept_first) if row)]
            epoch, seq = min(firsts)
            old = (BlockRow.epoch < epoch) | ((BlockRow.epoch == epoch) & (BlockRow.seq + BlockRow.n <= seq))
            return int(db.execute(delete(BlockRow).where(BlockRow.axis_id == axis_id, old)).rowcount)

    # --- answers ------------------------------------------------------------------------------------------

    def save(
        self,
        axis: AxisRecord,
        window_row: int,
        estimate: Estimate,
        indicators: list[dict[str, Any]],
        alarms: Iterable[AlarmRecord],
        changes: Sequence[Change],
    ) -> list[int]:
        """Store an answer with everything it changed; return the ids of the transitions."""
        with self._write() as db:
            db.execute(insert(EstimateRow).values(estimate_row(axis.id, window_row, estimate, indicators)))
            common = {"window_id": window_row, "axis_id": axis.id, "end_ns": estimate.window.end_ns}
            trended = (*estimate.parameters, *as_parameters(indicators))
            if trended:
                db.execute(insert(ParameterRow), [{**common, **dataclasses.asdict(one)} for one in trended])
            db.execute(update(WindowRow).where(WindowRow.id == window_row).values(done=True))
            db.execute(update(AxisRow).where(AxisRow.id == axis.id).values(drift=axis.drift))
            return self._save_alarms(db, axis.id, alarms, changes)

    def save_alarms(self, axis_id: int, alarms: Iterable[AlarmRecord], changes: Sequence[Change]) -> list[int]:
        """Store alarms that changed without an estimate (staleness, commands); return the ids of the transitions."""
        with self._write() as db:
            return self._save_alarms(db, axis_id, alarms, changes)

    def _save_alarms(
        self, db: Connection, axis_id: int, alarms: Iterable[AlarmRecord], changes: Sequence[Change]
    ) -> list[int]:
        for record in alarms:
            where = (AlarmRow.axis_id == axis_id) & (AlarmRow.kind == record.kind)
            machine = {**dataclasses.asdict(record.alarm)}
            values = {
                "state": record.alarm.state.value,
                "occurrence": record.occurrence,
                "machine": machine,
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
