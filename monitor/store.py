"""The one writer of the history: journal, windows, estimates, alarms. Every method is one transaction.

A sample is acknowledged only after `commit` returned; a window is in the history once, whatever is killed when.
Not safe for threads: it belongs to the supervising thread. Readers use `queries.py`.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from sqlalchemy import Connection, bindparam, delete, func, insert, or_, select, true, update

from monitor.axis_versions import constants_of, differences
from monitor.errors import DatabaseError
from monitor.estimate import Estimate
from monitor.models import (
    AxisRow,
    Base,
    BlockRow,
    EstimateRow,
    GapRow,
    ParameterRow,
    WindowRow,
)
from monitor.models_life import AxisVersionRow, EventRow
from monitor.query_raw import raw_samples
from monitor.samples import Outcome, Samples, StreamState, Window, WindowId
from monitor.store_alarms import AlarmStore
from monitor.store_journal import first_needed
from monitor.store_life import LifeStore
from monitor.store_records import AlarmRecord, AxisRecord, Change
from monitor.store_roll_ups import SPANS, add_to_roll_ups, rebuild_roll_ups
from monitor.store_rows import (
    AXIS_COLUMNS,
    as_parameters,
    axis_record,
    axis_row,
    block_row,
    estimate_row,
    gap_row,
    window_of,
)
from monitor.windows import KEPT_GAPS
from plant.axis import Axis

AXIS_FILE = "axis file"  # the author of what a changed axis file brings
# Core statements on tables, made once: the intake runs them several times a second for every axis
_INSERT_BLOCK = insert(Base.metadata.tables["block"])
_INSERT_ESTIMATE = insert(Base.metadata.tables["estimate"])
_INSERT_PARAMETER = insert(Base.metadata.tables["parameter"])
_AXIS = Base.metadata.tables["axis"]
_UPDATE_AXIS = (
    update(_AXIS)
    .where(_AXIS.c.id == bindparam("row"))
    .values({name: bindparam(f"new_{name}") for name in AXIS_COLUMNS})
)


class Store(AlarmStore, LifeStore):
    """Writes the history at `url`; makes or upgrades the schema when it opens.

    Raises:
        DatabaseError: from every method, with one line that says what to do.
    """

    # --- axes ---------------------------------------------------------------------------------------------

    def register(self, axes: Iterable[Axis]) -> dict[str, AxisRecord]:
        """Make the listed axes known, unlist the others; return all axes by name."""
        listed = {axis.name: axis for axis in axes}
        with self._write() as db:
            for axis in listed.values():
                self._list_axis(db, axis)
            db.execute(update(AxisRow).where(AxisRow.name.not_in(listed)).values(listed=False))
            rows = db.execute(select(AxisRow.__table__)).mappings()
            records = {row["name"]: axis_record(row) for row in rows}
            for record in records.values():
                latest = _latest_version(db, record.id)
                if latest is not None:
                    record.version, record.effects = latest["version"], dict(latest["effects"])
            return records

    def _list_axis(self, db: Connection, axis: Axis) -> None:
        """Note a listed axis; where its file says other constants than before, a new version of it begins."""
        units = {"listed": True, "force_unit": axis.force_unit, "position_unit": axis.position_unit}
        row = db.execute(select(AxisRow.id, AxisRow.last_ns).where(AxisRow.name == axis.name)).first()
        if row is None:
            new = insert(AxisRow).values(name=axis.name, **units).returning(AxisRow.id, AxisRow.last_ns)
            row = db.execute(new).one()
        else:
            db.execute(update(AxisRow).where(AxisRow.id == row.id).values(units))
        latest, constants = _latest_version(db, row.id), constants_of(axis)
        version = {"axis_id": row.id, "constants": constants, "author": AXIS_FILE}
        if latest is None:
            first = {"version": 1, "from_ns": 0, "effects": {}, "why": "first seen"}
            db.execute(insert(AxisVersionRow).values(**version, **first))
        elif changed := differences(latest["constants"], constants):
            since, why = (row.last_ns or 0) + 1, "; ".join(changed)
            later = {"version": latest["version"] + 1, "from_ns": since, "effects": latest["effects"], "why": why}
            db.execute(insert(AxisVersionRow).values(**version, **later))
            event = {"kind": "axis_changed", "text": why, "author": AXIS_FILE, "new_baseline": True}
            db.execute(insert(EventRow).values(axis_id=row.id, at_ns=since, **event))
            db.execute(update(AxisRow).where(AxisRow.id == row.id).values(drift=None))  # not comparable: learn anew

    def add_unknown(self, name: str) -> AxisRecord:
        """Note an axis that streams without being listed."""
        with self._write() as db:
            row = insert(AxisRow).values(name=name, listed=False).returning(AxisRow.id)
            return AxisRecord(int(db.execute(row).scalar_one()), name, False, StreamState())

    def gaps_of(self, axis_id: int, epoch: int) -> list[tuple[int, int]]:
        """(from, to) of the latest gaps declared in `epoch`, in order."""
        query = select(GapRow.from_seq, GapRow.to_seq).where(
            GapRow.axis_id == axis_id, GapRow.epoch == epoch, GapRow.missing > 0
        )
        newest = query.order_by(GapRow.from_seq.desc()).limit(KEPT_GAPS)
        with self._write() as db:
            return [(int(start), int(end)) for start, end in db.execute(newest)][::-1]

    def gap_counts(self) -> list[tuple[int, str, int]]:
        """(axis id, kind, how many) of all gaps."""
        query = select(GapRow.axis_id, GapRow.kind, func.count()).group_by(GapRow.axis_id, GapRow.kind)
        with self._write() as db:
            return [(int(axis_id), str(kind), int(count)) for axis_id, kind, count in db.execute(query)]

    # --- journal ------------------------------------------------------------------------------------------

    def commit(self, batch: Sequence[tuple[AxisRecord, Outcome]]) -> list[tuple[AxisRecord, int, Window]]:
        """Write what the assemblers settled, with their state; return the new windows with their row ids."""
        blocks = [block_row(axis.id, part) for axis, out in batch for part in out.accepted]
        gaps = [gap_row(axis.id, gap) for axis, out in batch for gap in out.gaps]
        windows = []
        with self._write() as db:
            self._fence(db, [axis.id for axis, _ in batch])
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

    def leave_out(self, windows: Mapping[int, Sequence[int]]) -> None:
        """Forget complete windows that will not be identified, row ids by axis id; their samples stay as before."""
        rows = [{"row": row} for group in windows.values() for row in group]
        with self._write() as db:
            self._fence(db, list(windows))
            db.execute(delete(WindowRow).where(WindowRow.id == bindparam("row"), WindowRow.done.is_(False)), rows)

    def pending(self) -> list[tuple[int, int, Window]]:
        """(row id, axis id, window) of every complete window without an answer, oldest first."""
        query = select(WindowRow.__table__).where(WindowRow.done.is_(False))
        with self._write() as db:
            rows = db.execute(query.order_by(WindowRow.axis_id, WindowRow.id)).mappings()
            return [(row["id"], row["axis_id"], window_of(row)) for row in rows]

    def read(self, axis_id: int, window: WindowId) -> Samples:
        """Raw samples of a window, from the journal.

        Raises:
            DatabaseError: the journal does not hold them (which would be an error of ours).
        """
        with self._write() as db:
            samples = raw_samples(db, axis_id, window)
        if samples is None:
            raise DatabaseError(f"{self.url}: the journal does not hold {window} of axis {axis_id}")
        return samples

    def prune(
        self,
        axis_id: int,
        needed_from: tuple[int, int],
        keep_windows: int,
        also: Sequence[tuple[int, int, int]] = (),
    ) -> int:
        """Delete blocks that nobody needs: no pending or future window, none of the newest `keep_windows`; count them.

        `also` are older windows whose samples stay: epoch, first sample, samples.
        """
        with self._write() as db:
            first = first_needed(db, axis_id, needed_from, keep_windows)
            needed = [
                (BlockRow.epoch == epoch) & (BlockRow.seq < seq + n) & (BlockRow.seq + BlockRow.n > seq)
                for epoch, seq, n in also
            ]
            free = ~or_(*needed) if needed else true()
            old = true() if first is None else BlockRow.id < first
            return int(db.execute(delete(BlockRow).where(BlockRow.axis_id == axis_id, old, free)).rowcount)

    def thin_out(self, axis_id: int, before_ns: int, limit: int = 2000) -> int:
        """Delete the oldest answers that ended before `before_ns` [ns], at most `limit`; count them.

        Their roll-ups stay, so that the trend does. Only whole days go: what is left and the roll-ups never overlap.
        """
        before_ns = before_ns // SPANS[-1] * SPANS[-1]
        old = select(EstimateRow.window_id).where(EstimateRow.axis_id == axis_id, EstimateRow.end_ns < before_ns)
        with self._write() as db:
            self._fence(db, [axis_id])
            rows = list(db.scalars(old.order_by(EstimateRow.end_ns).limit(limit)))
            db.execute(delete(WindowRow).where(WindowRow.id.in_(rows)))
            gaps = delete(GapRow).where(GapRow.axis_id == axis_id, GapRow.to_ns < before_ns)
            if not rows:  # gaps of the open epoch are needed to know a sample that comes late
                newest = select(func.max(GapRow.epoch)).where(GapRow.axis_id == axis_id).scalar_subquery()
                db.execute(gaps.where(GapRow.epoch < newest))
            return len(rows)

    # --- answers ------------------------------------------------------------------------------------------

    def replace(self, axis: AxisRecord, answers: Sequence[tuple[int, Estimate, list[dict[str, Any]]]]) -> None:
        """Put other answers in the place of those to these windows (by row): another model looked at them."""
        if not answers:
            return
        rows = [row for row, _, _ in answers]
        with self._write() as db:
            self._fence(db, [axis.id])
            db.execute(delete(ParameterRow).where(ParameterRow.window_id.in_(rows)))
            db.execute(delete(EstimateRow).where(EstimateRow.window_id.in_(rows)))
            for row, estimate, indicators in answers:
                self._keep(db, axis, row, estimate, indicators)
            for day in sorted({estimate.window.end_ns // SPANS[-1] * SPANS[-1] for _, estimate, _ in answers}):
                rebuild_roll_ups(db, axis.id, day, day)

    def save(
        self,
        axis: AxisRecord,
        window_row: int,
        estimate: Estimate,
        indicators: list[dict[str, Any]],
        alarms: Iterable[AlarmRecord],
        changes: Sequence[Change],
        *,
        keep: bool = True,
    ) -> list[int]:
        """Store an answer with everything it changed; return the ids of the transitions.

        With `keep` false (no room) only what it changed is stored: the watch goes on, the trend has a hole.
        """
        verdicts = {**axis.verdicts, estimate.verdict: axis.verdicts.get(estimate.verdict, 0) + 1}
        with self._write() as db:
            self._fence(db, [axis.id])
            if keep:
                self._keep(db, axis, window_row, estimate, indicators)
            db.execute(update(WindowRow).where(WindowRow.id == window_row).values(done=True))
            db.execute(update(AxisRow).where(AxisRow.id == axis.id).values(drift=axis.drift, verdicts=verdicts))
            axis.verdicts = verdicts
            return self._save_alarms(db, axis.id, alarms, changes)

    def _keep(
        self,
        db: Connection,
        axis: AxisRecord,
        window_row: int,
        estimate: Estimate,
        indicators: list[dict[str, Any]],
    ) -> None:
        db.execute(_INSERT_ESTIMATE, estimate_row(axis, window_row, estimate, indicators))
        common = {"window_id": window_row, "axis_id": axis.id, "end_ns": estimate.window.end_ns}
        known = {one.name for one in estimate.parameters}
        watched = (one for one in as_parameters(indicators) if one.name not in known)
        trended = (*estimate.parameters, *watched)
        if trended:
            rows = [{**common, **dataclasses.asdict(one)} for one in trended]
            db.execute(_INSERT_PARAMETER, rows)
            add_to_roll_ups(db, rows)


def _latest_version(db: Connection, axis_id: int) -> Any:
    query = select(AxisVersionRow.__table__).where(AxisVersionRow.axis_id == axis_id)
    return db.execute(query.order_by(AxisVersionRow.version.desc()).limit(1)).mappings().first()
