"""Event time: integer nanoseconds of Unix time, UTC, in and out of words."""

from __future__ import annotations

import re
from datetime import UTC, datetime

from monitor.errors import QueryError

SECOND = 10**9
UNITS = {"s": SECOND, "min": 60 * SECOND, "h": 3600 * SECOND, "d": 86400 * SECOND, "w": 7 * 86400 * SECOND}
UNITS["m"] = UNITS["min"]
UNITS["y"] = UNITS["a"] = 31_557_600 * SECOND


def iso(t_ns: int | None) -> str | None:
    """RFC 3339 in UTC with milliseconds; None stays None."""
    if t_ns is None:
        return None
    moment = datetime.fromtimestamp(t_ns // SECOND, UTC)
    return f"{moment:%Y-%m-%dT%H:%M:%S}.{t_ns % SECOND // 10**6:03d}Z"


def parse_time(text: str) -> int:
    """RFC 3339 (UTC where no zone is given), a date, or nanoseconds. [ns]

    Raises:
        QueryError: none of these.
    """
    text = text.strip()
    if re.fullmatch(r"-?\d{12,19}", text):
        return int(text)
    try:
        moment = datetime.fromisoformat(text)
    except ValueError:
        raise QueryError(
            f"time {text!r} is not understood; write 2026-03-01T12:00:00Z, 2026-03-01, or nanoseconds since 1970"
        ) from None
    moment = moment if moment.tzinfo else moment.replace(tzinfo=UTC)
    whole = int(moment.replace(microsecond=0).timestamp())
    return whole * SECOND + moment.microsecond * 1000


def parse_duration(text: str) -> int:
    """A span such as `7d`, `12h`, `90min`, `1.5y`. [ns]

    Raises:
        QueryError: no number, or no unit we know.
    """
    match = re.fullmatch(r"(\d+(?:\.\d+)?)\s*([a-z]+)", text.strip().lower())
    if match is None or match[2] not in UNITS:
        raise QueryError(f"duration {text!r} is not understood; write a number and one of s, min, h, d, w, y, as in 7d")
    return round(float(match[1]) * UNITS[match[2]])


def span(t_ns: int) -> str:
    """A span in words: the largest unit that gives a number of at least one."""
    for unit in ("y", "w", "d", "h", "min"):
        if abs(t_ns) >= 2 * UNITS[unit]:
            return f"{t_ns / UNITS[unit]:.3g} {unit}"
    return f"{t_ns / SECOND:.3g} s"
