"""What a re-analysis reads: answered windows with their raw samples, and the models that were in force."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Connection, Select, func, select, tuple_

from monitor.models import AxisRow, BlockRow, EstimateRow, WindowRow
from monitor.models_life import AxisVersionRow
from monitor.query_base import ReaderBase
from monitor.query_rows import between
from monitor.samples import Samples, Window, WindowId
from monitor.store_records import VersionRecord
from monitor.store_rows import join, samples_of, window_of

PAGE = 200  # answers read at once
ANSWER = ("verdict", "reason", "method", "seed", "software", "axis_version", "data_sha256", "result", "curve")


@dataclass(frozen=True, slots=True)
class Answered:
    """A window and what the history says of it; `result` is the JSON of `tribowatch identify`."""

    window: Window
    verdict: str
    reason: str | None
    method: str
    seed: int
    software: str
    axis_version: int
    data_sha256: str
    result: dict[str, Any]
    curve: dict[str, Any] | None


@dataclass(frozen=True, slots=True)
class StoredAxis:
    """An axis of the history: its row, when its latest sample was [ns], and its model by version."""

    id: int
    name: str
    last_ns: int | None
    versions: dict[int, VersionRecord]


def raw_samples(db: Connection, axis_id: int, window: WindowId) -> Samples | None:
    """Raw samples of a window from the journal; None where it does not hold all of them."""
    end = window.first_seq + window.samples
    query = select(BlockRow.__table__).where(
        BlockRow.axis_id == axis_id,
        BlockRow.epoch == window.epoch,
        BlockRow.seq < end,
        BlockRow.seq + BlockRow.n > window.first_seq,
    )
    whole = join([samples_of(row) for row in db.execute(query.order_by(BlockRow.seq)).mappings()])
    if whole is None or whole.seq > window.first_seq or whole.end < end or len(whole) != whole.end - whole.seq:
        return None
    return whole.cut(window.first_seq, end)


def _answers(axis_id: int) -> Select[Any]:
    columns = [getattr(EstimateRow, name) for name in ANSWER]
    query = select(WindowRow.__table__, *columns).join(EstimateRow, EstimateRow.window_id == WindowRow.id)
    return query.where(EstimateRow.axis_id == axis_id)


def _answered(row: Any) -> Answered:
    return Answered(window_of(row), **{name: row[name] for name in ANSWER})


class RawReader(ReaderBase):
    """Answered windows with their samples; read-only, like every reader."""

    def stored_axes(self) -> list[StoredAxis]:
        """Every axis whose constants are known, by name, with all versions of its model."""
        names = [field.name for field in dataclasses.fields(VersionRecord)]
        with self._read() as db:
            versions: dict[int, dict[int, VersionRecord]] = {}
            for row in db.execute(select(AxisVersionRow.__table__).order_by(AxisVersionRow.version)).mappings():
                one = VersionRecord(**{name: row[name] for name in names})
                versions.setdefault(row["axis_id"], {})[one.version] = one
            rows = db.execute(select(AxisRow.id, AxisRow.name, AxisRow.last_ns).order_by(AxisRow.name)).all()
            return [StoredAxis(row.id, row.name, row.last_ns, versions[row.id]) for row in rows if row.id in versions]

    def count_answered(self, axis_id: int, from_ns: int | None, to_ns: int | None) -> int:
        """How many answers `answered` gives."""
        with self._read() as db:
            query = select(func.count()).where(EstimateRow.axis_id == axis_id)
            return int(db.scalar(query.where(*between(EstimateRow.end_ns, from_ns, to_ns))) or 0)

    def answered(self, axis_id: int, from_ns: int | None = None, to_ns: int | None = None) -> Iterator[Answered]:
        """The answers of an axis whose windows ended from `from_ns` to `to_ns` [ns], oldest first.

        A page at a time: a snapshot held for hours would keep the daemon's journal from shrinking.
        """
        query = _answers(axis_id).where(*between(EstimateRow.end_ns, from_ns, to_ns))
        query = query.order_by(EstimateRow.end_ns, EstimateRow.window_id).limit(PAGE)
        place = tuple_(EstimateRow.end_ns, EstimateRow.window_id)
        after = None
        while True:
            with self._read() as db:
                page = db.execute(query if after is None else query.where(place > after)).mappings().all()
            yield from map(_answered, page)
            if len(page) < PAGE:
                return
            after = (page[-1]["end_ns"], page[-1]["id"])

    def answer(self, axis_id: int, window: WindowId) -> Answered | None:
        """The answer to one window."""
        columns = (WindowRow.epoch, WindowRow.first_seq, WindowRow.samples)
        values = (window.epoch, window.first_seq, window.samples)
        with self._read() as db:
            row = db.execute(_answers(axis_id).where(tuple_(*columns) == values)).mappings().first()
        return None if row is None else _answered(row)

    def answered_windows(self, axis_id: int) -> set[WindowId]:
        """Which windows of an axis have an answer."""
        query = select(WindowRow.epoch, WindowRow.first_seq, WindowRow.samples)
        query = query.join(EstimateRow, EstimateRow.window_id == WindowRow.id).where(EstimateRow.axis_id == axis_id)
        with self._read() as db:
            return {WindowId(*row) for row in db.execute(query)}

    def samples(self, axis_id: int, window: WindowId) -> Samples | None:
        """Raw samples of a window; None where the journal holds them no more."""
        with self._read() as db:
            return raw_samples(db, axis_id, window)
