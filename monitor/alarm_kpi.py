"""How good the alarms are: the figures of ISA-18.2 / IEC 62682 over the audit. Pure.

Rates are counted in event time. The targets are those of the standards for one operator; a watch of wear should stay
far below them.
"""

from __future__ import annotations

import collections
import itertools
import statistics
from dataclasses import dataclass
from typing import Any

from monitor.alarms import State
from monitor.times import UNITS, iso

HOUR_NS, DAY_NS = UNITS["h"], UNITS["d"]
TEN_MINUTES_NS = HOUR_NS // 6
STALE_NS = DAY_NS  # an alarm that stands longer, seen or not, is stale (ISA-18.2)
CHATTER_TIMES, CHATTER_NS = 3, DAY_NS  # raised so often within that time; the standard's minute is for fast signals
BAD_ACTORS = 10
TARGETS = {
    "per_day": 150.0,
    "peak_per_ten_minutes": 10,
    "flood_share": 0.01,
    "top_share": 0.05,
    "stale": 5,
    "chattering": 0,
}
PRIORITIES = {"low": 0.80, "medium": 0.15, "high": 0.05}


@dataclass(frozen=True, slots=True)
class Move:
    """One audit row: whose alarm went where, when, by whom. [ns]"""

    axis: str
    kind: str
    priority: str
    event: str
    before: str
    after: str
    at_ns: int
    author: str = ""

    @property
    def raised(self) -> bool:
        """Whether it was shown to somebody anew."""
        return self.after == State.UNACKNOWLEDGED and self.before != State.ACKNOWLEDGED


def figures(moves: list[Move], from_ns: int, to_ns: int) -> dict[str, Any]:
    """The figures from `from_ns` to `to_ns` [ns]; `moves` in order of time, those before `from_ns` tell what stands."""
    raised = [one for one in moves if one.raised and from_ns <= one.at_ns <= to_ns]
    days = max(to_ns - from_ns, 1) / DAY_NS
    tens = collections.Counter((one.at_ns - from_ns) // TEN_MINUTES_NS for one in raised)
    peak = max(tens.values(), default=0)
    flooded = sum(count > TARGETS["peak_per_ten_minutes"] for count in tens.values())
    actors = collections.Counter((one.axis, one.kind) for one in raised)
    top = actors.most_common(BAD_ACTORS)
    stale, standing = _standing(moves, to_ns)
    waits = _waits(moves, from_ns, to_ns)
    chattering = _chattering(raised)
    priorities = collections.Counter(one.priority for one in raised)
    return {
        "from": iso(from_ns),
        "to": iso(to_ns),
        "days": days,
        "raised": len(raised),
        "per_day": len(raised) / days,
        "peak_per_ten_minutes": peak,
        "flood_share": flooded * TEN_MINUTES_NS / max(to_ns - from_ns, 1),
        "chattering": chattering,
        "standing": standing,
        "stale": stale,
        "bad_actors": [
            {"axis": axis, "kind": kind, "raised": count, "share": count / len(raised)} for (axis, kind), count in top
        ],
        "top_share": sum(count for _, count in top) / len(raised) if raised else 0.0,
        "priorities": {name: priorities[name] / len(raised) if raised else 0.0 for name in PRIORITIES},
        "hours_to_acknowledge": _spread(waits),
        "never_acknowledged": sum(one is None for one in waits),
        "put_aside": dict(collections.Counter(one.after for one in moves if _aside(one, from_ns, to_ns))),
        "targets": {**TARGETS, "priorities": PRIORITIES},
    }


def _aside(one: Move, from_ns: int, to_ns: int) -> bool:
    aside = (State.SHELVED, State.SUPPRESSED, State.OUT_OF_SERVICE)
    return one.after in aside and from_ns <= one.at_ns <= to_ns


def _chattering(raised: list[Move]) -> list[dict[str, Any]]:
    """Alarms that were raised `CHATTER_TIMES` within `CHATTER_NS`."""
    times = collections.defaultdict(list)
    for one in raised:
        times[one.axis, one.kind].append(one.at_ns)
    found = []
    for (axis, kind), stamps in times.items():
        runs = zip(stamps, stamps[CHATTER_TIMES - 1 :], strict=False)
        if any(last - first <= CHATTER_NS for first, last in runs):
            found.append({"axis": axis, "kind": kind, "raised": len(stamps)})
    return found


def _standing(moves: list[Move], to_ns: int) -> tuple[list[dict[str, Any]], int]:
    """Alarms that stand too long at the end, and how many stand at all."""
    latest: dict[tuple[str, str], tuple[Move, int]] = {}
    for one in moves:
        if one.at_ns > to_ns:
            continue
        key = one.axis, one.kind
        since = latest[key][1] if key in latest and one.before == State.UNACKNOWLEDGED else one.at_ns
        latest[key] = one, since
    shown = (State.UNACKNOWLEDGED, State.ACKNOWLEDGED)
    standing = [(one, since) for one, since in latest.values() if one.after in shown]
    old = [
        {"axis": one.axis, "kind": one.kind, "days": (to_ns - since) / DAY_NS, "since": iso(since)}
        for one, since in standing
        if to_ns - since > STALE_NS
    ]
    return sorted(old, key=lambda one: one["days"], reverse=True), len(standing)


def _waits(moves: list[Move], from_ns: int, to_ns: int) -> list[float | None]:
    """Hours from each raising to somebody's acknowledgement; None where none came before it was raised anew."""
    found: list[float | None] = []
    moves = [one for one in moves if one.at_ns <= to_ns]

    def whose(one: Move) -> tuple[str, str]:
        return one.axis, one.kind

    for _, group in itertools.groupby(sorted(moves, key=whose), key=whose):
        open_ns: int | None = None
        for one in group:
            if one.event == "acknowledge" and open_ns is not None:
                found.append((one.at_ns - open_ns) / HOUR_NS)
                open_ns = None
            elif one.raised and one.at_ns >= from_ns:
                found += [None] * (open_ns is not None)
                open_ns = one.at_ns
        found += [None] * (open_ns is not None)
    return found


def _spread(waits: list[float | None]) -> dict[str, float] | None:
    known = [one for one in waits if one is not None]
    return {"median": statistics.median(known), "longest": max(known)} if known else None
