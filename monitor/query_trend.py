"""The trend of one parameter in at most so many points, whatever the range: rows as they are, or summed up.

Where the points stand far enough apart, they are made of roll-ups (`store_roll_ups.py`), with raw rows only at the two
ends of the range that cut a span: the answer is the same, and the time it takes does not grow with the history.
"""

from __future__ import annotations

from typing import Any

from sqlalchemy import ColumnElement, Connection, func, select

from monitor.models import ParameterRow
from monitor.models_life import RollUpRow
from monitor.store_roll_ups import SPANS
from monitor.times import iso

Rows = list[dict[str, Any]]


def names_of(db: Connection, axis_id: int) -> list[str]:
    """Parameters that an axis has a trend of."""
    query = select(RollUpRow.parameter).where(RollUpRow.axis_id == axis_id, RollUpRow.span == SPANS[-1])
    return list(db.scalars(query.distinct().order_by(RollUpRow.parameter)))


def series_of(
    db: Connection, axis_id: int, name: str, from_ns: int | None, to_ns: int | None, points: int
) -> dict[str, Any]:
    """Trend of one parameter, at most `points` points. Bounds are event time, both included. [ns]"""
    where = [ParameterRow.axis_id == axis_id, ParameterRow.name == name]
    if from_ns is not None:
        where.append(ParameterRow.end_ns >= from_ns)
    if to_ns is not None:
        where.append(ParameterRow.end_ns <= to_ns)
    some = select(ParameterRow.end_ns).where(*where).limit(points + 1).subquery()
    few = (db.scalar(select(func.count()).select_from(some)) or 0) <= points
    thinned = _thinned_from(db, axis_id, name, where, (from_ns, to_ns))
    if few and thinned is None:
        found = _one_by_one(db, where)
    else:
        found = _summed_up(db, axis_id, name, where, points, (from_ns, to_ns), thinned)
    unit = db.scalar(select(RollUpRow.unit).where(RollUpRow.axis_id == axis_id, RollUpRow.parameter == name).limit(1))
    return {"unit": unit, "answers": sum(row["count"] for row in found), "points": [_point(row) for row in found]}


def _thinned_from(
    db: Connection,
    axis_id: int,
    name: str,
    where: list[ColumnElement[bool]],
    bounds: tuple[int | None, int | None],
) -> int | None:
    """Time of the oldest answer in range of which only roll-ups are kept; None where every answer is there. [ns]"""
    r = RollUpRow
    hours = select(r.last_ns).where(r.axis_id == axis_id, r.parameter == name, r.span == SPANS[0])
    from_ns, to_ns = bounds
    if from_ns is not None:
        hours = hours.where(r.start_ns >= -(-from_ns // SPANS[0]) * SPANS[0])
    if to_ns is not None:
        hours = hours.where(r.last_ns <= to_ns)
    oldest = db.scalar(hours.order_by(r.start_ns).limit(1))
    first = db.scalar(select(ParameterRow.end_ns).where(*where).order_by(ParameterRow.end_ns).limit(1))
    return oldest if oldest is not None and (first is None or oldest < first) else None


def _one_by_one(db: Connection, where: list[ColumnElement[bool]]) -> Rows:
    p = ParameterRow
    rows = db.execute(select(p.end_ns, p.value, p.low, p.high).where(*where).order_by(p.end_ns)).all()
    found = []
    for end_ns, value, low, high in rows:
        bounded = int(low is not None and high is not None)
        found.append(_row(end_ns, 1, bounded, value, value, value, low, high))
    return found


def _summed_up(
    db: Connection,
    axis_id: int,
    name: str,
    where: list[ColumnElement[bool]],
    points: int,
    bounds: tuple[int | None, int | None],
    thinned: int | None,
) -> Rows:
    """Equal spans of event time, each a multiple of a roll-up's where one fits."""
    ends = select(ParameterRow.end_ns).where(*where).limit(1)
    first = thinned if thinned is not None else db.execute(ends.order_by(ParameterRow.end_ns)).scalar_one()
    last = db.scalar(ends.order_by(ParameterRow.end_ns.desc()))
    if last is None:
        last = _last_rolled_up(db, axis_id, name, bounds[1])
    width = max(1, (last - first) // points + 1)
    span = max((one for one in SPANS if one <= width), default=SPANS[0] if thinned is not None else 0)
    if not span:
        return _raw(db, where, first, width)
    origin = first // span * span
    width = -(-((last - origin) // points + 1) // span) * span
    from_ns, to_ns = bounds
    inner = -(-from_ns // span) * span if from_ns is not None else origin
    outer = (to_ns + 1) // span * span if to_ns is not None else last // span * span + span
    if outer <= inner:
        return _raw(db, where, origin, width)
    key = [RollUpRow.axis_id == axis_id, RollUpRow.parameter == name, RollUpRow.span == span]
    whole = _rolled_up(db, [*key, RollUpRow.start_ns >= inner, RollUpRow.start_ns < outer], origin, width)
    head = _raw(db, [*where, ParameterRow.end_ns < inner], origin, width)
    tail = _raw(db, [*where, ParameterRow.end_ns >= outer], origin, width)
    return _merged(head + whole + tail)


def _last_rolled_up(db: Connection, axis_id: int, name: str, to_ns: int | None) -> int:
    r = RollUpRow
    hours = select(r.last_ns).where(r.axis_id == axis_id, r.parameter == name, r.span == SPANS[0])
    if to_ns is not None:
        hours = hours.where(r.last_ns <= to_ns)
    return int(db.execute(hours.order_by(r.start_ns.desc()).limit(1)).scalar_one())


def _raw(db: Connection, where: list[ColumnElement[bool]], origin: int, width: int) -> Rows:
    p = ParameterRow
    bucket = ((p.end_ns - origin) // width).label("bucket")
    sums = (func.count(), func.count(p.low), func.sum(p.value), func.min(p.value), func.max(p.value))
    query = select(bucket, func.max(p.end_ns), *sums, func.sum(p.low), func.sum(p.high))
    return [_bucket(row) for row in db.execute(query.where(*where).group_by(bucket).order_by(bucket))]


def _rolled_up(db: Connection, where: list[ColumnElement[bool]], origin: int, width: int) -> Rows:
    r = RollUpRow
    bucket = ((r.start_ns - origin) // width).label("bucket")
    sums = (func.sum(r.count), func.sum(r.bounded), func.sum(r.mean * r.count), func.min(r.min), func.max(r.max))
    query = select(bucket, func.max(r.last_ns), *sums, func.sum(r.low * r.bounded), func.sum(r.high * r.bounded))
    return [_bucket(row) for row in db.execute(query.where(*where).group_by(bucket).order_by(bucket))]


def _bucket(row: Any) -> dict[str, Any]:
    bucket, last_ns, count, bounded, total, least, most, low, high = row
    return _row(int(last_ns), int(count), int(bounded), total, least, most, low, high) | {"bucket": int(bucket)}


def _row(last_ns: int, count: int, bounded: int, *numbers: float | None) -> dict[str, Any]:
    names = ("total", "min", "max", "low", "high")
    return {"last_ns": last_ns, "count": count, "bounded": bounded} | dict(zip(names, numbers, strict=True))


def _merged(rows: Rows) -> Rows:
    """Rows of the same bucket, made one."""
    found: dict[int, dict[str, Any]] = {}
    for row in rows:
        one = found.setdefault(row["bucket"], row)
        if one is not row:
            one["last_ns"] = max(one["last_ns"], row["last_ns"])
            one["min"], one["max"] = min(one["min"], row["min"]), max(one["max"], row["max"])
            for name in ("count", "bounded", "total"):
                one[name] += row[name]
            for name in ("low", "high"):
                one[name] = (one[name] or 0.0) + (row[name] or 0.0)
    return [found[bucket] for bucket in sorted(found)]


def _point(row: dict[str, Any]) -> dict[str, Any]:
    bounded = row["bounded"]
    return {
        "t": iso(row["last_ns"]),
        "t_ns": row["last_ns"],
        "value": row["total"] / row["count"],
        "ci95": [row["low"] / bounded, row["high"] / bounded] if bounded else None,
        "min": row["min"],
        "max": row["max"],
        "answers": row["count"],
    }
