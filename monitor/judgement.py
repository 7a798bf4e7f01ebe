"""From findings to alarms: each finding moves its alarm's state machine; what changed comes out. Pure."""

from __future__ import annotations

from collections.abc import Iterable

from monitor.alarms import RAISED, Alarm, AlarmRule, Event, State, advance
from monitor.alerts import compose
from monitor.drift import Finding, Kind
from monitor.store_records import AlarmRecord, Change


def apply(
    site: str, axis: str, alarms: dict[str, AlarmRecord], findings: Iterable[Finding], now_ns: int, rule: AlarmRule
) -> tuple[list[AlarmRecord], list[Change]]:
    """Observe every finding at event time `now_ns` [ns]; return the alarms that changed and their transitions.

    `alarms` (by kind) is brought up to date. A kind that never held has no alarm.
    """
    touched, changes = [], []
    for finding in findings:
        kind = finding.kind.value
        known = alarms.get(kind)
        if known is None and not finding.holds:
            continue
        before = known or AlarmRecord(kind)
        event = Event.HOLDS if finding.holds else Event.GONE
        after, transition = advance(before.alarm, event, now_ns, rule)
        record = _told(site, axis, before, after, finding, now_ns)
        if record == known:
            continue
        alarms[kind] = record
        touched.append(record)
        if transition is not None:
            changes.append(Change(transition, record))
    return touched, changes


def command(
    record: AlarmRecord, event: Event, now_ns: int, rule: AlarmRule, author: str, until_ns: int | None = None
) -> tuple[AlarmRecord, Change | None]:
    """An operator's command to one alarm; nothing changes where it means nothing."""
    after, transition = advance(record.alarm, event, now_ns, rule, until_ns=until_ns)
    alert = {**record.alert, "state": after.state.value} if record.alert else None
    moved = AlarmRecord(record.kind, after, record.occurrence, alert)
    return moved, None if transition is None else Change(transition, moved, author)


def _told(site: str, axis: str, before: AlarmRecord, after: Alarm, finding: Finding, now_ns: int) -> AlarmRecord:
    """The record with its alert: new evidence while the condition holds, the last evidence after that."""
    fresh = after.state is State.UNACKNOWLEDGED and before.alarm.state not in (*RAISED, State.RETURNED_UNACKNOWLEDGED)
    occurrence = before.occurrence + 1 if fresh else before.occurrence
    alert = before.alert
    if finding.holds and occurrence:
        since_ns = int(alert["since_ns"]) if alert and not fresh else now_ns
        alert = compose(site, axis, Kind(before.kind), occurrence, after.state.value, since_ns, finding.evidence)
    elif alert is not None:
        alert = {**alert, "state": after.state.value}
    return AlarmRecord(before.kind, after, occurrence, alert)
