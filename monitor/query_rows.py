"""From rows of the history to plain values for JSON; the SQL of `queries.py`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import ColumnElement, Connection, Select, func, literal, select

from monitor.alarms import State
from monitor.models import AlarmRow, EstimateRow, GapRow, ParameterRow, WindowRow
from monitor.times import iso

SCHEMA_VERSION = 1
POINTS = 500


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


def between(column: Any, from_ns: int | None, to_ns: int | None) -> list[ColumnElement[bool]]:
    """Conditions that keep `column` within both bounds, where given. [ns]"""
    bounds = []
    if from_ns is not None:
        bounds.append(column >= from_ns)
    if to_ns is not None:
        bounds.append(column <= to_ns)
    return bounds


def summary(db: Connection, row: Any) -> AxisSummary:
    """One axis at a glance, from its row."""
    mine = WindowRow.axis_id == row["id"]
    pending = db.scalar(select(func.count()).where(mine, WindowRow.done.is_(False))) or 0
    verdicts = verdicts_of(db, row["id"], None, None)
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


def verdicts_of(db: Connection, axis_id: int, from_ns: int | None, to_ns: int | None) -> dict[str, int]:
    """Number of answers by verdict."""
    where = [EstimateRow.axis_id == axis_id, *between(EstimateRow.end_ns, from_ns, to_ns)]
    rows = db.execute(select(EstimateRow.verdict, func.count()).where(*where).group_by(EstimateRow.verdict))
    return {verdict: int(count) for verdict, count in rows}


def gaps_of(db: Connection, axis_id: int, from_ns: int | None, to_ns: int | None) -> list[dict[str, Any]]:
    """Breaks with missing samples or of unknown length; the newest `POINTS`."""
    query = select(GapRow.__table__).where(GapRow.axis_id == axis_id, GapRow.kind != "pause")
    query = query.where(*between(GapRow.to_ns, from_ns, to_ns)).order_by(GapRow.id.desc()).limit(POINTS)
    names = ("kind", "epoch", "from_seq", "to_seq", "missing")
    return [
        {**{name: row[name] for name in names}, "from": iso(row["from_ns"]), "to": iso(row["to_ns"])}
        for row in reversed(db.execute(query).mappings().all())
    ]


def series_of(
    db: Connection, axis_id: int, name: str, from_ns: int | None, to_ns: int | None, points: int
) -> dict[str, Any]:
    """Trend of one parameter, at most `points` points."""
    where = [ParameterRow.axis_id == axis_id, ParameterRow.name == name]
    where += between(ParameterRow.end_ns, from_ns, to_ns)
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
