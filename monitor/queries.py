"""Questions to the history: the one implementation behind the command line, Zenoh and the page. Only reads."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from sqlalchemy import Connection, select

from monitor.alarms import State
from monitor.errors import QueryError, UnknownError
from monitor.models import AlarmRow, AxisRow, EstimateRow, ParameterRow, TransitionRow
from monitor.query_life import LifeReader
from monitor.query_rows import (
    POINTS,
    SCHEMA_VERSION,
    AxisSummary,
    between,
    gaps_of,
    summary,
    transition_dict,
    verdicts_of,
)
from monitor.query_trend import names_of, series_of
from monitor.times import iso
from plant.checks import nearest

MAX_POINTS = 20_000
PLAIN = ("unit", "value", "identifiable", "at_bound", "axis_version", "seed", "software", "data_sha256")


class Reader(LifeReader):
    """Read-only access to the history at a database URL; a context manager. One per thread, or lock around it.

    Raises:
        DatabaseError: from every method: no database there, not ours, of another version, or broken.
    """

    # --- axes ---------------------------------------------------------------------------------------------

    def axes(self) -> list[AxisSummary]:
        """Every axis that is listed or was heard, by name."""
        with self._read() as db:
            rows = db.execute(select(AxisRow.__table__).order_by(AxisRow.name)).mappings().all()
            return [summary(db, row) for row in rows]

    def axis(self, name: str) -> AxisSummary:
        """One axis.

        Raises:
            QueryError: unknown; names the nearest known one.
        """
        with self._read() as db:
            return summary(db, self._axis_row(db, name))

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
            JSON: `series` by parameter with unit and points, `gaps`, `verdicts`, `events` (maintenance, new baselines,
            changed constants).

        Raises:
            QueryError: unknown axis or parameter, or a range that cannot be.
        """
        if not 1 <= points <= MAX_POINTS:
            raise QueryError(f"points is {points}, but must be 1 to {MAX_POINTS}")
        with self._read() as db:
            row = self._axis_row(db, axis)
            from_ns = _begin(row, since_ns, from_ns, to_ns)
            names = self._parameter_names(db, row["id"], axis, parameter)
            series = {name: series_of(db, row["id"], name, from_ns, to_ns, points) for name in names}
            return {
                "schema_version": SCHEMA_VERSION,
                "axis": axis,
                "from": iso(from_ns),
                "to": iso(to_ns),
                "series": series,
                "verdicts": verdicts_of(db, row["id"], from_ns, to_ns),
                "gaps": gaps_of(db, row["id"], from_ns, to_ns),
                "events": self._events(db, row, from_ns, to_ns, POINTS),
            }

    def answers(
        self,
        axis: str,
        *,
        parameter: str | None = None,
        since_ns: int | None = None,
        from_ns: int | None = None,
        to_ns: int | None = None,
    ) -> Iterator[dict[str, Any]]:
        """Every parameter of every answer, one by one, oldest first: the rows of an export. Bounds as in `history`."""
        columns = (*ParameterRow.__table__.columns, EstimateRow.axis_version, EstimateRow.seed)
        with self._read() as db:
            row = self._axis_row(db, axis)
            from_ns = _begin(row, since_ns, from_ns, to_ns)
            names = self._parameter_names(db, row["id"], axis, parameter)
            query = (
                select(*columns, EstimateRow.software, EstimateRow.data_sha256)
                .join(EstimateRow, EstimateRow.window_id == ParameterRow.window_id)
                .where(ParameterRow.axis_id == row["id"], *between(EstimateRow.end_ns, from_ns, to_ns))
                .where(EstimateRow.axis_id == row["id"], ParameterRow.name.in_(names))
                .order_by(EstimateRow.end_ns, ParameterRow.name)
            )
            streamed = db.execution_options(yield_per=5000).execute(query).mappings()
            for one in streamed:
                yield {
                    "t_ns": one["end_ns"],
                    "time": iso(one["end_ns"]),
                    "parameter": one["name"],
                    "ci95_low": one["low"],
                    "ci95_high": one["high"],
                    **{name: one[name] for name in PLAIN},
                }

    def _parameter_names(self, db: Connection, axis_id: int, axis: str, wanted: str | None) -> list[str]:
        known = names_of(db, axis_id)
        if wanted is None:
            return known
        if wanted not in known:
            hint = nearest(wanted, known) if known else "nothing was identified yet"
            raise UnknownError(f"parameter {wanted!r} is not in the history of {axis}; {hint}")
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
            query = query.where(*between(TransitionRow.at_ns, from_ns, to_ns))
            rows = db.execute(query.order_by(TransitionRow.id.desc()).limit(limit)).mappings().all()
        return [transition_dict(row["name"], row) for row in reversed(rows)]


def _begin(row: Any, since_ns: int | None, from_ns: int | None, to_ns: int | None) -> int | None:
    """First event time of a range: given, or counted back from the axis' latest sample. [ns]"""
    if since_ns is not None and from_ns is not None:
        raise QueryError("since and from exclude each other: give one")
    if since_ns is not None and row["last_ns"] is not None:
        from_ns = row["last_ns"] - since_ns
    if from_ns is not None and to_ns is not None and from_ns > to_ns:
        raise QueryError(f"from {iso(from_ns)} is later than to {iso(to_ns)}")
    return from_ns
