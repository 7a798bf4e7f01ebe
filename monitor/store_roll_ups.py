"""Roll-ups: per parameter and span of time the number, mean, extremes and mean interval of the answers.

Kept up to date with every answer, so that a range of any length is a few hundred rows to read.
"""

from __future__ import annotations

import functools
from typing import Any

from sqlalchemy import Connection, case, delete, func, insert, literal, select
from sqlalchemy.dialects import postgresql, sqlite

from monitor.models import ParameterRow
from monitor.models_life import RollUpRow

HOUR = 3_600 * 10**9
SPANS = (HOUR, 24 * HOUR)  # ns: 500 points of a month need hours, of years days


def add_to_roll_ups(db: Connection, parameters: list[dict[str, Any]]) -> None:
    """Count new rows of `parameter` in."""
    rows = [_row(one, span) for one in parameters for span in SPANS]
    if rows:
        db.execute(_upsert(db.dialect.name), rows)


@functools.cache
def _upsert(dialect: str) -> Any:
    """The statement that adds a row or merges it into the one that is there; made once, it is needed all the time."""
    table = RollUpRow.metadata.tables[RollUpRow.__tablename__]
    new = (postgresql.insert if dialect == "postgresql" else sqlite.insert)(table)
    old, more = table.c, new.excluded
    total, bounded = old["count"] + more["count"], old.bounded + more.bounded

    def mean_of_bounds(name: str) -> Any:
        summed = func.coalesce(old[name], 0.0) * old.bounded + func.coalesce(more[name], 0.0) * more.bounded
        return summed / func.nullif(bounded, 0)

    merged = {
        "last_ns": _larger(old.last_ns, more.last_ns, 1),
        "count": total,
        "bounded": bounded,
        "mean": old.mean + (more.mean - old.mean) * more["count"] / total,
        "min": _larger(old["min"], more["min"], -1),
        "max": _larger(old["max"], more["max"], 1),
        "low": mean_of_bounds("low"),
        "high": mean_of_bounds("high"),
    }
    keys = [old.axis_id, old.parameter, old.span, old.start_ns]
    return new.on_conflict_do_update(index_elements=keys, set_=merged)


def _larger(one: Any, other: Any, sign: int) -> Any:
    return case((one >= other if sign > 0 else one <= other, one), else_=other)


def _row(one: dict[str, Any], span: int) -> dict[str, Any]:
    known = one["low"] is not None and one["high"] is not None
    return {
        "axis_id": one["axis_id"],
        "parameter": one["name"],
        "span": span,
        "start_ns": one["end_ns"] // span * span,
        "last_ns": one["end_ns"],
        "count": 1,
        "bounded": int(known),
        "mean": one["value"],
        "min": one["value"],
        "max": one["value"],
        "low": one["low"] if known else None,
        "high": one["high"] if known else None,
        "unit": one["unit"],
    }


def rebuild_roll_ups(db: Connection, axis_id: int, from_ns: int, to_ns: int) -> None:
    """Make the roll-ups of the spans that hold `from_ns` to `to_ns` [ns] again, after answers in them were replaced."""
    p = ParameterRow
    for span in SPANS:
        first, last = from_ns // span * span, to_ns // span * span
        db.execute(
            delete(RollUpRow).where(
                RollUpRow.axis_id == axis_id, RollUpRow.span == span, RollUpRow.start_ns.between(first, last)
            )
        )
        start = (p.end_ns - p.end_ns % span).label("start_ns")
        summed = (
            select(
                p.axis_id,
                p.name,
                literal(span).label("span"),
                start,
                func.max(p.end_ns),
                func.count(),
                func.count(p.low),
                func.avg(p.value),
                func.min(p.value),
                func.max(p.value),
                func.avg(p.low),
                func.avg(p.high),
                func.min(p.unit),
            )
            .where(p.axis_id == axis_id, p.end_ns >= first, p.end_ns < last + span)
            .group_by(p.axis_id, p.name, start)
        )
        names = ["axis_id", "parameter", "span", "start_ns", "last_ns", "count", "bounded", "mean", "min", "max"]
        db.execute(insert(RollUpRow).from_select([*names, "low", "high", "unit"], summed))
