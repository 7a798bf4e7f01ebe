"""From findings to alarms: each finding moves its alarm's state machine; what changed comes out. Pure.

While an axis cannot be trusted (its data are bad, or nothing arrives) its wear alarms are *inhibited*: a condition that
becomes true meanwhile is suppressed with the fault's name, and shown when the fault is over and it still holds. What
was shown before stays shown: missing data never resolve anything. A jam is never inhibited.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Mapping

from monitor.alarms import RAISED, Alarm, AlarmRule, Event, State, Transition, advance
from monitor.alerts import compose
from monitor.drift import Finding, Kind
from monitor.store_records import AlarmRecord, Change

FAULTS = (Kind.STALE, Kind.DATA_QUALITY)
INHIBITED = (Kind.WEAR, Kind.LUBRICATION, Kind.OPERATING_POINT, Kind.MODEL_MISMATCH)
BY_INHIBITION = "inhibition"  # author of what a fault does to other alarms

Alarms = dict[str, AlarmRecord]


def apply(
    site: str,
    axis: str,
    alarms: Alarms,
    findings: Iterable[Finding],
    now_ns: int,
    rule_of: Callable[[str], AlarmRule],
    *,
    wall_ns: int | None = None,
    release_ns: int | None = None,
) -> tuple[list[AlarmRecord], list[Change]]:
    """Observe every finding at event time `now_ns` [ns]; return the alarms that changed and their transitions.

    `alarms` (by kind) is brought up to date. A kind that never held has no alarm. `rule_of` gives a kind's rule;
    `wall_ns` is the wall clock, by which shelving ends where the stream stopped; `release_ns` the event time for alarms
    that are inhibited no more, where `now_ns` is none (staleness). [ns]
    """
    before, changes = dict(alarms), []
    for finding in findings:
        kind = finding.kind.value
        if kind not in alarms and not finding.holds:
            continue
        record = alarms.get(kind) or AlarmRecord(kind)
        fault = inhibitor_of(finding.kind, alarms)
        if finding.holds and fault and record.alarm.state is State.NORMAL:
            alarm, transition = advance(record.alarm, Event.SUPPRESS, now_ns, rule_of(kind), inhibitor=fault)
            record = _restated(record, alarm)
            changes += _change(transition, record, BY_INHIBITION)
        event = Event.HOLDS if finding.holds else Event.GONE
        alarm, transition = advance(record.alarm, event, now_ns, rule_of(kind), wall_ns=wall_ns)
        record = _told(site, axis, record, alarm, finding, now_ns)
        if record.alarm != Alarm():
            alarms[kind] = record
        changes += _change(transition, record)
    changes += _release(alarms, now_ns if release_ns is None else release_ns, rule_of)
    return [record for kind, record in alarms.items() if record != before.get(kind)], changes


def tick(
    alarms: Alarms, now_ns: int, wall_ns: int, rule_of: Callable[[str], AlarmRule]
) -> tuple[list[AlarmRecord], list[Change]]:
    """Let time pass: shelving ends by the event clock or, where the stream stopped, by the wall clock. [ns]"""
    before, changes = dict(alarms), []
    for kind, record in before.items():
        alarm, transition = advance(record.alarm, Event.TICK, now_ns, rule_of(kind), wall_ns=wall_ns)
        if transition is not None:
            alarms[kind] = _restated(record, alarm)
            changes += _change(transition, alarms[kind])
    changes += _release(alarms, now_ns, rule_of)
    return [record for kind, record in alarms.items() if record != before.get(kind)], changes


def command(
    record: AlarmRecord,
    event: Event,
    now_ns: int,
    rule: AlarmRule,
    author: str,
    until_ns: int | None = None,
    until_wall_ns: int | None = None,
) -> tuple[AlarmRecord, Change | None]:
    """An operator's command to one alarm; nothing changes where it means nothing."""
    alarm, transition = advance(record.alarm, event, now_ns, rule, until_ns=until_ns, until_wall_ns=until_wall_ns)
    moved = _restated(record, alarm)
    return moved, next(iter(_change(transition, moved, author)), None)


def inhibitor_of(kind: Kind, alarms: Mapping[str, AlarmRecord]) -> str:
    """The axis fault that inhibits alarms of `kind` now; empty where none does."""
    if kind not in INHIBITED:
        return ""
    return next((fault.value for fault in FAULTS if fault.value in alarms and alarms[fault.value].alarm.active), "")


def _release(alarms: Alarms, now_ns: int, rule_of: Callable[[str], AlarmRule]) -> list[Change]:
    """Give back the alarms that a fault inhibited, once no fault does any more."""
    changes = []
    for kind, record in list(alarms.items()):
        if record.alarm.inhibitor and not inhibitor_of(Kind(kind), alarms):
            alarm, transition = advance(record.alarm, Event.UNSUPPRESS, now_ns, rule_of(kind))
            alarms[kind] = _restated(record, alarm)
            changes += _change(transition, alarms[kind], BY_INHIBITION)
    return changes


def _change(transition: Transition | None, record: AlarmRecord, author: str = "") -> list[Change]:
    return [] if transition is None else [Change(transition, record, author)]


def _restated(record: AlarmRecord, alarm: Alarm) -> AlarmRecord:
    """The record after a step that brought no new evidence."""
    alert = {**record.alert, "state": alarm.state.value} if record.alert else None
    return dataclasses.replace(record, alarm=alarm, alert=alert)


def _told(site: str, axis: str, before: AlarmRecord, after: Alarm, finding: Finding, now_ns: int) -> AlarmRecord:
    """The record with its alert: new evidence while the condition holds, the last evidence after that.

    It is a new occurrence when its condition becomes true, unless the previous one still waits to be acknowledged. That
    holds while it is put aside too, so that an alarm that comes back has its evidence.
    """
    risen = after.active and not before.alarm.active
    fresh = risen and before.alarm.state not in (*RAISED, State.RETURNED_UNACKNOWLEDGED)
    occurrence = before.occurrence + 1 if fresh else before.occurrence
    restated = _restated(before, after)
    if not (finding.holds and after.active and occurrence):
        return restated
    alert = before.alert
    since_ns = int(alert["since_ns"]) if alert and not fresh else now_ns
    alert = compose(site, axis, Kind(before.kind), occurrence, after.state.value, since_ns, finding.evidence)
    return AlarmRecord(before.kind, after, occurrence, alert)
