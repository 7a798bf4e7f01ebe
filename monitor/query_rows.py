"""From rows of the history to plain values for JSON; the SQL of `queries.py`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from sqlalchemy import ColumnElement, Connection, func, select

from monitor.alarms import State
from monitor.models import AlarmRow, EstimateRow, GapRow, WindowRow
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
    verdicts = {name: int(count) for name, count in row["verdicts"].items()}
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
