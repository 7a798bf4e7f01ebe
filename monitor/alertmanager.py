"""An alert in the words of Prometheus' Alertmanager, API v2 (`POST /api/v2/alerts`). Pure."""

from __future__ import annotations

from typing import Any

from monitor.alarms import State
from monitor.times import iso

SEVERITIES = {"high": "critical", "medium": "warning", "low": "info"}
SHOWN = (State.UNACKNOWLEDGED, State.ACKNOWLEDGED)  # what Alertmanager calls firing
STANDS_NS = 86_400 * 10**9  # a firing alert lasts at least a day there unless we say that it is over


def message_of(alert: dict[str, Any], state: str, at_ns: int, author: str, now_ns: int) -> dict[str, Any]:
    """One alert of the list that Alertmanager takes.

    It is over when its condition is gone, and while it is shelved, suppressed or out of service: then nobody is to be
    called. Stamps are never later than `now_ns`, for a replay may run ahead of the clock.

    Args:
        alert: as published.
        state: of ISA-18.2.
        at_ns: event time of its latest change. [ns]
        author: who changed it, where somebody did.
        now_ns: the wall clock. [ns]
    """
    firing = state in SHOWN
    ends_ns = now_ns + STANDS_NS if firing else min(at_ns, now_ns)
    starts_ns = min(int(alert["since_ns"]), now_ns, ends_ns)
    return {
        "labels": {
            "alertname": f"tribowatch_{alert['kind']}",
            "site": alert["site"],
            "axis": alert["axis"],
            "kind": alert["kind"],
            "severity": SEVERITIES[alert["priority"]],
        },
        "annotations": {
            "summary": alert["text"],
            "likely_cause": alert["likely_cause"],
            "recommended_action": alert["recommended_action"],
            "consequence": alert["consequence"],
            "state": state,
            "id": alert["id"],
            **({"changed_by": author} if author else {}),
        },
        "startsAt": iso(starts_ns),
        "endsAt": iso(ends_ns),
    }
