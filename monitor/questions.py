"""A question in words, as Zenoh selectors and URLs carry them, put to the history. Pure but for the reader.

Zenoh and HTTP both come through here, so they refuse and answer alike.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from monitor.errors import QueryError
from monitor.times import parse_duration, parse_time

if TYPE_CHECKING:
    from monitor.queries import Reader

SCHEMA_VERSION = 1
POINTS = 500
MOST = 20_000  # points or rows of one answer
RANGE = ("from", "to", "since")


def parameters(reader: Reader, axis: str, asked: Mapping[str, str]) -> dict[str, Any]:
    """Trend of the parameters of `axis`: from, to, since, parameter, points."""
    refuse_unknown("parameters", asked, (*RANGE, "parameter", "points"))
    times = span_of(asked)
    return reader.history(axis, parameter=asked.get("parameter"), points=whole(asked, "points", POINTS), **times)


def alerts(reader: Reader, axis: str | None, asked: Mapping[str, str]) -> dict[str, Any]:
    """Alerts and their audit, of `axis` or of all: from, to, active, limit."""
    refuse_unknown("alerts", asked, ("from", "to", "active", "limit"))
    times = {f"{name}_ns": parse_time(asked[name]) if name in asked else None for name in ("from", "to")}
    return {
        "schema_version": SCHEMA_VERSION,
        "axis": axis,
        "alerts": reader.alerts(axis, active=flag(asked, "active")),
        "transitions": reader.transitions(axis, limit=whole(asked, "limit", POINTS), **times),
    }


def events(reader: Reader, axis: str, asked: Mapping[str, str]) -> dict[str, Any]:
    """What was done to `axis`: from, to, limit."""
    refuse_unknown("events", asked, ("from", "to", "limit"))
    times = {f"{name}_ns": parse_time(asked[name]) if name in asked else None for name in ("from", "to")}
    found = reader.events(axis, limit=whole(asked, "limit", POINTS), **times)
    return {"schema_version": SCHEMA_VERSION, "axis": axis, "events": found}


def versions(reader: Reader, axis: str, asked: Mapping[str, str]) -> dict[str, Any]:
    """Versions of the constants and the effects of `axis`."""
    refuse_unknown("versions", asked, ())
    return {"schema_version": SCHEMA_VERSION, "axis": axis, "versions": reader.versions(axis)}


def figures(reader: Reader, axis: str | None, asked: Mapping[str, str]) -> dict[str, Any]:
    """How good the alarms of `axis`, or of all, are: since."""
    refuse_unknown("kpi", asked, ("since",))
    return reader.alarm_figures(axis, since_ns=parse_duration(asked["since"]) if "since" in asked else None)


def span_of(asked: Mapping[str, str]) -> dict[str, int | None]:
    """`from_ns`, `to_ns`, `since_ns` from the words, None where not given. [ns]"""
    parse: dict[str, Callable[[str], int]] = {"from": parse_time, "to": parse_time, "since": parse_duration}
    return {f"{name}_ns": read(asked[name]) if name in asked else None for name, read in parse.items()}


def refuse_unknown(what: str, asked: Mapping[str, str], allowed: tuple[str, ...]) -> None:
    """Complain about a name that is not `allowed`.

    Raises:
        QueryError: names it, and what there is.
    """
    for name in asked:
        if name not in allowed:
            takes = ", ".join(allowed) or "none"
            raise QueryError(f"query parameter {name!r} is not known; {what} takes {takes}")


def flag(asked: Mapping[str, str], name: str) -> bool:
    """Whether `name` is given and not denied."""
    return name in asked and asked[name] not in ("false", "0", "no")


def whole(asked: Mapping[str, str], name: str, default: int) -> int:
    """A whole number from 1 to `MOST`.

    Raises:
        QueryError: anything else.
    """
    text = asked.get(name, str(default))
    if not (text.isascii() and text.isdecimal() and len(text) < 9 and 1 <= int(text) <= MOST):
        raise QueryError(f"{name} is {text!r}, but must be a whole number from 1 to {MOST}")
    return int(text)
