"""What the watch of one axis saw, from the history: charts over time, operating point, friction against speed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from sqlalchemy import Connection, func, select

from monitor.baseline import Baseline
from monitor.channels import REFERENCES, UNEXPLAINED, Channel, lacking
from monitor.drift_state import DriftState
from monitor.models import EstimateRow
from monitor.query_rows import between
from monitor.times import iso

Z95 = 1.96  # standard deviations of a 95 % interval


def curves(db: Connection, row: Any) -> dict[str, Any]:
    """Friction against speed: of the latest identified window, and what is normal for this axis.

    Args:
        db: the history.
        row: of the axis.
    """
    query = select(EstimateRow.curve, EstimateRow.end_ns).where(
        EstimateRow.axis_id == row["id"], EstimateRow.verdict == "identified"
    )
    latest = db.execute(query.order_by(EstimateRow.end_ns.desc()).limit(1)).mappings().first()
    now = None
    if latest is not None and latest["curve"]:
        now = {**latest["curve"], "at": iso(latest["end_ns"])}
    return {
        "force_unit": row["force_unit"],
        "speed_unit": f"{row['position_unit']}/s",
        "now": now,
        "baseline": _baseline(row["drift"]),
    }


def _baseline(drift: dict[str, Any] | None) -> dict[str, Any] | None:
    """Mean friction of the healthy axis, and between which values one of its windows falls 19 times of 20."""
    known = DriftState.from_dict(drift).baseline if drift else None
    if known is None:
        return None
    mean, scatter = known.friction, np.sqrt(known.fit.variance)
    half = Z95 * scatter[: len(mean)]
    return {
        "windows": known.windows,
        "from": iso(known.from_ns),
        "to": iso(known.to_ns),
        "speeds": list(known.speeds),
        "values": mean.tolist(),
        "low": (mean - half).tolist(),
        "high": (mean + half).tolist(),
        "indicators": [
            _healthy(one, float(level), float(spread), known)
            for one, level, spread in zip(known.channels, known.moments.mean_y, scatter, strict=True)
            if np.isfinite(one.floor)
        ],
    }


def _healthy(one: Channel, level: float, spread: float, known: Baseline) -> dict[str, Any]:
    """Mean and scatter of a watched number; of the unexplained force not of its logarithm."""
    unit = one.unit
    if one.name == UNEXPLAINED:
        middle = REFERENCES // 2
        unit, level = known.channels[middle].unit, lacking(level, float(known.moments.mean_y[middle]))
        spread *= level
    return {"name": one.name, "unit": unit, "mean": level, "scatter": spread}


def watched(db: Connection, axis_id: int, from_ns: int | None, to_ns: int | None, points: int) -> dict[str, Any]:
    """Charts, conditions and verdicts over time, at most `points` of each.

    Of more windows, the last one of each of `points` equal spans is taken: charts are sums, they do not jump.
    """
    where = [EstimateRow.axis_id == axis_id, *between(EstimateRow.end_ns, from_ns, to_ns)]
    count, first, last = db.execute(
        select(func.count(), func.min(EstimateRow.end_ns), func.max(EstimateRow.end_ns)).where(*where)
    ).one()
    if not count:
        return {"windows": 0, **_columns([]), "verdicts": []}
    width = (last - first) // points + 1
    bucket = (EstimateRow.end_ns - first) // width
    good = [*where, EstimateRow.verdict == "identified"]
    ends = select(func.max(EstimateRow.end_ns)).where(*good).group_by(bucket)
    columns = (EstimateRow.end_ns, EstimateRow.drift, EstimateRow.conditions)
    shown = select(*columns).where(EstimateRow.axis_id == axis_id, EstimateRow.end_ns.in_(ends))
    counted = select(func.max(EstimateRow.end_ns), EstimateRow.verdict, func.count()).where(*where)
    return {
        "windows": count,
        **_columns(db.execute(shown.order_by(EstimateRow.end_ns)).mappings().all()),
        "verdicts": [
            {"t_ns": end, "verdict": verdict, "windows": number}
            for end, verdict, number in db.execute(counted.group_by(bucket, EstimateRow.verdict))
        ],
    }


def _columns(rows: Sequence[Any]) -> dict[str, Any]:
    """Rows as columns of equal length, null where a window has no such number."""
    drifts = [{one["name"]: one for one in row["drift"]} for row in rows]
    names = dict.fromkeys(name for drift in drifts for name in drift)
    conditions = dict.fromkeys(name for row in rows for name in row["conditions"])
    fields = {"up": "sum_up", "down": "sum_down", "deviation": "deviation"}
    return {
        "t_ns": [row["end_ns"] for row in rows],
        "charts": {
            name: {
                field: [drift[name][source] if name in drift else None for drift in drifts]
                for field, source in fields.items()
            }
            for name in names
        },
        "conditions": {name: [row["conditions"].get(name) for row in rows] for name in conditions},
    }
