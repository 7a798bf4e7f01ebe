"""All axes at a glance, from the history: a handful of statements whatever the number of axes."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import asdict
from typing import Any

from sqlalchemy import Connection, func, select

from monitor.alarms import State
from monitor.models import AlarmRow, AxisRow, EstimateRow, GapRow, ParameterRow, WindowRow
from monitor.models_life import RollUpRow
from monitor.store_roll_ups import SPANS
from monitor.times import iso
from monitor.urgency import urgency

FRICTION = "coulomb_force"  # the number everybody knows; the charts watch others too
ALERT = ("id", "priority", "since", "since_ns", "text")
LOT = 500  # rows asked for by key in one statement
TREND = "friction_at_mid_speed"  # what the small line of an axis shows
DAYS = 30  # of them that it shows
# the watch's own state is large: the database picks out of it the two numbers that a list shows
COLUMNS = (
    *(AxisRow.id, AxisRow.name, AxisRow.listed, AxisRow.last_ns, AxisRow.samples, AxisRow.missing, AxisRow.rejected),
    AxisRow.drift[("baseline", "windows")].as_integer().label("baseline"),
    func.json_array_length(AxisRow.drift["learned"]).label("learned"),
)


def fleet(db: Connection) -> list[dict[str, Any]]:
    """One record per axis, the most urgent first."""
    rows = db.execute(select(*COLUMNS).order_by(AxisRow.name)).mappings().all()
    waiting, lost, alarms = _waiting(db), _gaps(db), _alarms(db)
    latest, trends = _latest(db), _trends(db)
    found = [_record(row, waiting, lost, alarms[row["id"]], latest.get(row["id"]), trends[row["id"]]) for row in rows]
    return sorted(found, key=lambda one: (one["urgency"]["level"], -(one["height"] or 0.0), one["axis"]))


def _record(
    row: Any,
    waiting: dict[int, int],
    lost: dict[int, int],
    alarms: list[dict[str, Any]],
    latest: dict[str, Any] | None,
    trend: list[float],
) -> dict[str, Any]:
    complete = row["baseline"] is not None
    watched = latest["drift"] if latest else []
    height = max((max(one["sum_up"], one["sum_down"]) for one in watched), default=None)
    heard = row["last_ns"] is not None
    how = urgency(alarms, listed=row["listed"], learned=complete, height=height, heard=heard)
    middle = next((one for one in watched if one["name"] == "friction at mid speed"), None)
    return {
        "axis": row["name"],
        "urgency": asdict(how),
        "listed": row["listed"],
        "last_sample": iso(row["last_ns"]),
        "last_sample_ns": row["last_ns"],
        "samples": row["samples"],
        "missing": row["missing"],
        "gaps": lost.get(row["id"], 0),
        "rejected": sum(row["rejected"].values()),
        "pending": waiting.get(row["id"], 0),
        "baseline": {
            "complete": complete,
            "windows": row["baseline"] if complete else row["learned"] or 0,
        },
        "alarms": alarms,
        "friction": latest["friction"] if latest else None,
        "change": middle["value"] / middle["baseline"] - 1 if middle and middle["baseline"] else None,
        "height": height,
        "trend": trend,
        "leading": max(watched, key=lambda one: max(one["sum_up"], one["sum_down"]))["name"] if watched else None,
    }


def _waiting(db: Connection) -> dict[int, int]:
    query = select(WindowRow.axis_id, func.count()).where(WindowRow.done.is_(False)).group_by(WindowRow.axis_id)
    return {axis: int(count) for axis, count in db.execute(query)}


def _gaps(db: Connection) -> dict[int, int]:
    query = select(GapRow.axis_id, func.count()).where(GapRow.missing > 0).group_by(GapRow.axis_id)
    return {axis: int(count) for axis, count in db.execute(query)}


def _alarms(db: Connection) -> defaultdict[int, list[dict[str, Any]]]:
    """Alarms that are not normal, with what a list shows of their alert."""
    query = select(AlarmRow.axis_id, AlarmRow.kind, AlarmRow.state, AlarmRow.alert).order_by(AlarmRow.kind)
    found: defaultdict[int, list[dict[str, Any]]] = defaultdict(list)
    for axis, kind, state, alert in db.execute(query.where(AlarmRow.state != State.NORMAL.value)):
        told = alert or {}
        found[axis].append({"kind": kind, "state": state, **{name: told.get(name) for name in ALERT}})
    return found


def _latest(db: Connection) -> dict[int, dict[str, Any]]:
    """By axis: charts and friction of the latest identified window, each found by one step into an index."""
    newest = (
        select(EstimateRow.window_id)
        .where(EstimateRow.axis_id == AxisRow.id, EstimateRow.verdict == "identified")
        .order_by(EstimateRow.end_ns.desc())
        .limit(1)
        .scalar_subquery()
    )
    windows = [window for window in db.scalars(select(newest).select_from(AxisRow)) if window is not None]
    found: dict[int, dict[str, Any]] = {}
    for first in range(0, len(windows), LOT):
        lot = windows[first : first + LOT]
        columns = (EstimateRow.axis_id, EstimateRow.window_id, EstimateRow.end_ns, EstimateRow.drift)
        values = select(ParameterRow.__table__).where(ParameterRow.window_id.in_(lot), ParameterRow.name == FRICTION)
        friction = {row["window_id"]: row for row in db.execute(values).mappings()}
        for row in db.execute(select(*columns).where(EstimateRow.window_id.in_(lot))).mappings():
            known = friction.get(row["window_id"])
            found[row["axis_id"]] = {"drift": row["drift"], "friction": known and _quantity(known)}
    return found


def _trends(db: Connection) -> defaultdict[int, list[float]]:
    """By axis: daily means of its friction at mid speed, of its own latest days, oldest first."""
    day = SPANS[-1]
    query = select(RollUpRow.axis_id, RollUpRow.mean).join(AxisRow, AxisRow.id == RollUpRow.axis_id)
    mine = RollUpRow.parameter == TREND, RollUpRow.span == day, RollUpRow.start_ns > AxisRow.last_ns - DAYS * day
    found: defaultdict[int, list[float]] = defaultdict(list)
    for axis, mean in db.execute(query.where(*mine).order_by(RollUpRow.axis_id, RollUpRow.start_ns)):
        found[axis].append(float(f"{mean:.5g}"))
    return found


def _quantity(row: Any) -> dict[str, Any]:
    ci95 = None if row["low"] is None or row["high"] is None else [row["low"], row["high"]]
    return {"value": row["value"], "unit": row["unit"], "ci95": ci95, "at": iso(row["end_ns"])}
