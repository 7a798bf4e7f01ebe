"""Questions to the history: the one implementation behind the command line, Zenoh and the page. Only reads."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Self

from sqlalchemy import ColumnElement, Connection, Select, func, literal, select

from monitor.alarms import State
from monitor.database import explained, make_engine
from monitor.errors import QueryError
from monitor.models import AlarmRow, AxisRow, EstimateRow, GapRow, ParameterRow, TransitionRow, WindowRow
from monitor.schema import check_version
from monitor.times import iso
from plant.axis_schema import nearest

SCHEMA_VERSION = 1
POINTS = 500
MAX_POINTS = 20_000


@dataclass(frozen=True, slots=True)
class AxisSummary:
    """One axis at a glance.

    Attributes:
        name: of the axis.
        listed: False when it streams without being listed in the configuration: counted, not identified.
        samples, missing: received, and known to be missing. [1]
        gaps: breaks in which samples are missing. [1]
        windows: complete windows, and how many of them wait for their answer. [1]
        pending: see `windows`.
        verdicts: answers by verdict. [1]
        rejected: refused samples and payloads by reason. [1]
        last_ns: latest sample. [ns]
        learning: windows the baseline has so far, and whether it is complete.
        alarms: kind -> state of every alarm that is not normal.
        latest: the latest identified answer as `tribowatch identify` prints it, with the window's time.
    """

    name: str
    listed: bool
    samples: int
    missing: int
    gaps: int
    windows: int
    pending: int
    verdicts: dict[str, int]
    rejected: dict[str, int]
    last_ns: int | None
    learning: dict[str, Any]
    alarms: dict[str, str]
    latest: dict[str, Any] | None

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {
            "axis": self.name,
            "listed": self.listed,
            "samples": self.samples,
            "missing": self.missing,
            "gaps": self.gaps,
            "windows": self.windows,
            "pending": self.pending,
            "verdicts": self.verdicts,
            "rejected": self.rejected,
            "last_sample": iso(self.last_ns),
            "last_sample_ns": self.last_ns,
            "baseline": self.learning,
            "alarms": self.alarms,
            "latest": self.latest,
        }


class Reader:
    """Read-only access to the history at a database URL; a context manager. One per thread, or lock around it.

    Raises:
        DatabaseError: from every method: no database there, not ours, of another version, or broken.
    """

    def __init__(self, url: str) -> None:
        """Open without changing anything."""
        self.url = url
        self._engine = make_engine(url, read_only=True)
        with self._read() as db:
            check_version(db, url, must_be_current=True)

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

    # --- axes ---------------------------------------------------------------------------------------------

    def axes(self) -> list[AxisSummary]:
        """Every axis that is listed or was heard, by name."""
        with self._read() as db:
            rows = db.execute(select(AxisRow.__table__).order_by(AxisRow.name)).mappings().all()
            return [_summary(db, row) for row in rows]

    def axis(self, name: str) -> AxisSummary:
        """One axis.

        Raises:
            QueryError: unknown; names the nearest known one.
        """
        with self._read() as db:
            return _summary(db, self._axis_row(db, name))

    def _axis_row(self, db: Connection, name: str) -> Any:
        row = db.execute(select(AxisRow.__table__).where(AxisRow.name == name)).mappings().first()
        if row is None:
            known = list(db.scalars(select(AxisRow.name).order_by(AxisRow.name)))
            hint = nearest(name, known) if known else "no axis was heard yet"
            raise QueryError(f"axis {name!r} is not in the history; {hint}")
        return row

    # --- parameters ---------------------------------------------------------------------------------------

    def history(
        self,
        axis: str,
        *,
        parameter: str | None = None,
        since_ns: int | None = None,
        from_ns: int | None = None,
        to_ns: int | None = None,
        points: int = POINTS,
    ) -> dict[str, Any]:
        """Trend of the parameters of one axis, at most `points` per parameter.

        Args:
            axis: its name.
            parameter: only this one.
            since_ns: this much back from the axis' latest sample; excludes `from_ns`. [ns]
            from_ns: first event time. [ns]
            to_ns: last event time. [ns]
            points: more answers than that are summed up in equal spans of time: mean, min, max and mean interval.

        Returns:
            JSON: `series` by parameter with unit and points, `gaps`, `verdicts`.

        Raises:
            QueryError: unknown axis or parameter, or a range that cannot be.
        """
        if not 1 <= points <= MAX_POINTS:
            raise QueryError(f"points is {points}, but must be 1 to {MAX_POINTS}")
        if since_ns is not None and from_ns is not None:
            raise QueryError("since and from exclude each other: give one")
        with self._read() as db:
            row = self._axis_row(db, axis)
            if since_ns is not None and row["last_ns"] is not None:
                from_ns = row["last_ns"] - since_ns
            if from_ns is not None and to_ns is not None and from_ns > to_ns:
                raise QueryError(f"from {iso(from_ns)} is later than to {iso(to_ns)}")
            names = self._parameter_names(db, row["id"], axis, parameter)
            series = {name: _series(db, row["id"], name, from_ns, to_ns, points) for name in names}
            return {
                "schema_version": SCHEMA_VERSION,
                "axis": axis,
                "from": iso(from_ns),
                "to": iso(to_ns),
                "series": series,
                "verdicts": _verdicts(db, row["id"], from_ns, to_ns),
                "gaps": _gaps(db, row["id"], from_ns, to_ns),
            }

    def _parameter_names(self, db: Connection, axis_id: int, axis: str, wanted: str | None) -> list[str]:
        query = select(ParameterRow.name).where(ParameterRow.axis_id == axis_id).distinct().order_by(ParameterRow.name)
        known = list(db.scalars(query))
        if wanted is None:
            return known
        if wanted not in known:
            hint = nearest(wanted, known) if known else "nothing was identified yet"
            raise QueryError(f"parameter {wanted!r} is not in the history of {axis}; {hint}")
        return [wanted]

    # --- alerts -------------------------------------------------------------------------------------------

    def alerts(self, axis: str | None = None, *, active: bool = False) -> list[dict[str, Any]]:
        """Latest alert of every alarm that was ever raised, newest first; with `active`, only those not normal."""
        query = select(AlarmRow.alert, AlarmRow.state).where(AlarmRow.occurrence > 0)
        with self._read() as db:
            if axis is not None:
                query = query.where(AlarmRow.axis_id == self._axis_row(db, axis)["id"])
            if active:
                query = query.where(AlarmRow.state != State.NORMAL.value)
            found = [{**alert, "state": state} for alert, state in db.execute(query) if alert]
        return sorted(found, key=lambda alert: int(alert["since_ns"]), reverse=True)

    def transitions(
        self,
        axis: str | None = None,
        *,
        from_ns: int | None = None,
        to_ns: int | None = None,
        after: int | None = None,
        limit: int = POINTS,
    ) -> list[dict[str, Any]]:
        """The audit: changes of state with the alert as it was then, oldest first, the latest `limit` of them.

        Args:
            axis: only this one.
            from_ns: first event time. [ns]
            to_ns: last event time. [ns]
            after: only those with a larger `number` (to follow what happens).
            limit: at most. [1]
        """
        query = select(TransitionRow.__table__, AxisRow.name).join(AxisRow, AxisRow.id == TransitionRow.axis_id)
        with self._read() as db:
            if axis is not None:
                query = query.where(TransitionRow.axis_id == self._axis_row(db, axis)["id"])
            if after is not None:
                query = query.where(TransitionRow.id > after)
            query = query.where(*_between(TransitionRow.at_ns, from_ns, to_ns))
            rows = db.execute(query.order_by(TransitionRow.id.desc()).limit(limit)).mappings().all()
        return [transition_dict(row["name"], row) for row in reversed(rows)]


def transition_dict(axis: str, row: Any) -> dict[str, Any]:
    """One audit row as published."""
    return {
        "schema_version": SCHEMA_VERSION,
        "number": row["id"],
        "axis": axis,
        "kind": row["kind"],
        "transition": {
            "event": row["event"],
            "before": row["before"],
            "after": row["after"],
            "at": iso(row["at_ns"]),
            "at_ns": row["at_ns"],
            "author": row["author"],
        },
        "alert": row["alert"],
    }


def _between(column: Any, from_ns: int | None, to_ns: int | None) -> list[ColumnElement[bool]]:
    bounds = []
    if from_ns is not None:
        bounds.append(column >= from_ns)
    if to_ns is not None:
        bounds.append(column <= to_ns)
    return bounds


def _summary(db: Connection, row: Any) -> AxisSummary:
    mine = WindowRow.axis_id == row["id"]
    pending = db.scalar(select(func.count()).where(mine, WindowRow.done.is_(False))) or 0
    verdicts = _verdicts(db, row["id"], None, None)
    gaps = db.scalar(select(func.count()).where(GapRow.axis_id == row["id"], GapRow.missing > 0)) or 0
    alarms = db.execute(
        select(AlarmRow.kind, AlarmRow.state).where(AlarmRow.axis_id == row["id"], AlarmRow.state != State.NORMAL.value)
    )
    drift = row["drift"] or {}
    baseline = drift.get("baseline")
    return AxisSummary(
        row["name"],
        row["listed"],
        row["samples"],
        row["missing"],
        gaps,
        sum(verdicts.values()) + pending,
        pending,
        verdicts,
        dict(row["rejected"]),
        row["last_ns"],
        {
            "complete": baseline is not None,
            "windows": baseline["windows"] if baseline else len(drift.get("learned", [])),
        },
        {kind: state for kind, state in alarms},
        _latest(db, row["id"]),
    )


def _latest(db: Connection, axis_id: int) -> dict[str, Any] | None:
    query = select(EstimateRow.result, EstimateRow.start_ns, EstimateRow.end_ns, EstimateRow.drift).where(
        EstimateRow.axis_id == axis_id, EstimateRow.verdict == "identified"
    )
    found = db.execute(query.order_by(EstimateRow.end_ns.desc()).limit(1)).mappings().first()
    if found is None:
        return None
    times = {"window_start": iso(found["start_ns"]), "window_end": iso(found["end_ns"]), "end_ns": found["end_ns"]}
    return {**found["result"], **times, "indicators": found["drift"]}


def _verdicts(db: Connection, axis_id: int, from_ns: int | None, to_ns: int | None) -> dict[str, int]:
    where = [EstimateRow.axis_id == axis_id, *_between(EstimateRow.end_ns, from_ns, to_ns)]
    rows = db.execute(select(EstimateRow.verdict, func.count()).where(*where).group_by(EstimateRow.verdict))
    return {verdict: int(count) for verdict, count in rows}


def _gaps(db: Connection, axis_id: int, from_ns: int | None, to_ns: int | None) -> list[dict[str, Any]]:
    """Breaks with missing samples or of unknown length; the newest `POINTS`."""
    query = select(GapRow.__table__).where(GapRow.axis_id == axis_id, GapRow.kind != "pause")
    query = query.where(*_between(GapRow.to_ns, from_ns, to_ns)).order_by(GapRow.id.desc()).limit(POINTS)
    names = ("kind", "epoch", "from_seq", "to_seq", "missing")
    return [
        {**{name: row[name] for name in names}, "from": iso(row["from_ns"]), "to": iso(row["to_ns"])}
        for row in reversed(db.execute(query).mappings().all())
    ]


def _series(
    db: Connection, axis_id: int, name: str, from_ns: int | None, to_ns: int | None, points: int
) -> dict[str, Any]:
    where = [ParameterRow.axis_id == axis_id, ParameterRow.name == name]
    where += _between(ParameterRow.end_ns, from_ns, to_ns)
    query = select(func.count(), func.min(ParameterRow.end_ns), func.max(ParameterRow.end_ns)).where(*where)
    count, first, last = db.execute(query).one()
    unit = db.scalar(select(ParameterRow.unit).where(*where[:2]).limit(1))
    rows = db.execute(_raw(where) if count <= points else _buckets(where, first, last, points)).mappings().all()
    return {"unit": unit, "answers": count, "points": [_point(row) for row in rows]}


def _raw(where: Sequence[ColumnElement[bool]]) -> Select[*tuple[Any, ...]]:
    value = ParameterRow.value
    return (
        select(
            ParameterRow.end_ns.label("t_ns"),
            value.label("value"),
            value.label("min"),
            value.label("max"),
            ParameterRow.low.label("low"),
            ParameterRow.high.label("high"),
            literal(1).label("answers"),
        )
        .where(*where)
        .order_by(ParameterRow.end_ns)
    )


def _buckets(where: Sequence[ColumnElement[bool]], first: int, last: int, points: int) -> Select[*tuple[Any, ...]]:
    """Equal spans of event time."""
    width = (last - first) // points + 1
    bucket = ((ParameterRow.end_ns - first) // width).label("bucket")
    value = ParameterRow.value
    return (
        select(
            func.max(ParameterRow.end_ns).label("t_ns"),
            func.avg(value).label("value"),
            func.min(value).label("min"),
            func.max(value).label("max"),
            func.avg(ParameterRow.low).label("low"),
            func.avg(ParameterRow.high).label("high"),
            func.count().label("answers"),
        )
        .where(*where)
        .group_by(bucket)
        .order_by(bucket)
    )


def _point(row: Any) -> dict[str, Any]:
    ci95 = None if row["low"] is None or row["high"] is None else [row["low"], row["high"]]
    return {
        "t": iso(row["t_ns"]),
        "t_ns": row["t_ns"],
        "value": row["value"],
        "ci95": ci95,
        "min": row["min"],
        "max": row["max"],
        "answers": row["answers"],
    }
