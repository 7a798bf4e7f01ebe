"""The life-cycle of an alarm after ISA-18.2 / IEC 62682. Pure: time comes in as an argument, what changed goes out.

::

    normal -> unacknowledged -> acknowledged -> normal
              unacknowledged -> returned_unacknowledged -> normal (acknowledged late) | unacknowledged (again)
    any -> shelved (an operator, for a time), suppressed (by design), out_of_service (maintenance) -> back

While shelved, suppressed or out of service the condition is still followed: coming back shows what is true then.
"""

from __future__ import annotations

import dataclasses
import enum
from dataclasses import dataclass


class State(enum.StrEnum):
    """Where an alarm can be."""

    NORMAL = "normal"
    UNACKNOWLEDGED = "unacknowledged"
    ACKNOWLEDGED = "acknowledged"
    RETURNED_UNACKNOWLEDGED = "returned_unacknowledged"
    SHELVED = "shelved"
    SUPPRESSED = "suppressed"
    OUT_OF_SERVICE = "out_of_service"


class Event(enum.StrEnum):
    """What can happen to it: `HOLDS` and `GONE` observe its condition, `TICK` is time, the others are commands."""

    HOLDS = "holds"
    GONE = "gone"
    TICK = "tick"
    ACKNOWLEDGE = "acknowledge"
    SHELVE = "shelve"
    UNSHELVE = "unshelve"
    SUPPRESS = "suppress"
    UNSUPPRESS = "unsuppress"
    REMOVE = "remove_from_service"
    RETURN = "return_to_service"


ASIDE = (State.SHELVED, State.SUPPRESSED, State.OUT_OF_SERVICE)
RAISED = (State.UNACKNOWLEDGED, State.ACKNOWLEDGED)  # the condition is true and shown


@dataclass(frozen=True, slots=True)
class AlarmRule:
    """When an observation counts.

    Attributes:
        on_count: observations in a row that raise the alarm. [1] >= 1
        off_count: observations in a row that let it return. [1] >= 1
        on_delay_ns: time the condition must hold besides. [ns]
        off_delay_ns: time it must be gone besides. [ns]
        latch: it does not return by itself, only when acknowledged while its condition is gone.
    """

    on_count: int = 1
    off_count: int = 1
    on_delay_ns: int = 0
    off_delay_ns: int = 0
    latch: bool = False


@dataclass(frozen=True, slots=True)
class Alarm:
    """One alarm.

    Attributes:
        state: where it is.
        since_ns: when it came there. [ns]
        active: its condition, after the delays.
        against: observations in a row that contradict `active`. [1]
        against_ns: stamp of the first of them. [ns]
        until_ns: end of shelving, None = until unshelved. [ns]
    """

    state: State = State.NORMAL
    since_ns: int = 0
    active: bool = False
    against: int = 0
    against_ns: int = 0
    until_ns: int | None = None


@dataclass(frozen=True, slots=True)
class Transition:
    """A change of state, worth an audit row."""

    before: State
    after: State
    event: Event
    at_ns: int


def advance(
    alarm: Alarm, event: Event, now_ns: int, rule: AlarmRule, *, until_ns: int | None = None
) -> tuple[Alarm, Transition | None]:
    """One step. An event that means nothing in this state changes nothing (acknowledging twice, say).

    Args:
        alarm: the alarm as it is.
        event: what happened.
        now_ns: when; stamps may step back, states may not. [ns]
        rule: delays and latch.
        until_ns: with `SHELVE`, when it comes back by itself. [ns]
    """
    if event in (Event.HOLDS, Event.GONE):
        alarm = _observe(alarm, event is Event.HOLDS, now_ns, rule)
    after = _next_state(alarm, event, now_ns, rule)
    if after is alarm.state:
        return alarm, None
    moved = dataclasses.replace(
        alarm, state=after, since_ns=now_ns, until_ns=until_ns if after is State.SHELVED else None
    )
    return moved, Transition(alarm.state, after, event, now_ns)


def _observe(alarm: Alarm, holds: bool, now_ns: int, rule: AlarmRule) -> Alarm:
    """Count observations against the present condition; turn it when they last long enough."""
    if holds == alarm.active:
        return dataclasses.replace(alarm, against=0)
    against, since = alarm.against + 1, alarm.against_ns if alarm.against else now_ns
    count, delay = (rule.on_count, rule.on_delay_ns) if holds else (rule.off_count, rule.off_delay_ns)
    if against >= count and now_ns - since >= delay:
        return dataclasses.replace(alarm, active=holds, against=0, against_ns=now_ns)
    return dataclasses.replace(alarm, against=against, against_ns=since)


def _next_state(alarm: Alarm, event: Event, now_ns: int, rule: AlarmRule) -> State:
    shown = State.UNACKNOWLEDGED if alarm.active else State.NORMAL
    match alarm.state, event:
        case _, Event.REMOVE:
            return State.OUT_OF_SERVICE
        case State.OUT_OF_SERVICE, Event.RETURN:
            return shown
        case State.OUT_OF_SERVICE, _:
            return State.OUT_OF_SERVICE
        case _, Event.SUPPRESS:
            return State.SUPPRESSED
        case State.SUPPRESSED, Event.UNSUPPRESS:
            return shown
        case State.SUPPRESSED, _:
            return State.SUPPRESSED
        case _, Event.SHELVE:
            return State.SHELVED
        case State.SHELVED, Event.UNSHELVE:
            return shown
        case State.SHELVED, _:
            expired = alarm.until_ns is not None and now_ns >= alarm.until_ns
            return shown if expired else State.SHELVED
        case State.NORMAL, _:
            return shown
        case State.UNACKNOWLEDGED, Event.ACKNOWLEDGE:
            return State.ACKNOWLEDGED if alarm.active else State.NORMAL
        case State.UNACKNOWLEDGED, _ if not alarm.active and not rule.latch:
            return State.RETURNED_UNACKNOWLEDGED
        case State.ACKNOWLEDGED, _ if not alarm.active:
            return State.NORMAL
        case State.RETURNED_UNACKNOWLEDGED, Event.ACKNOWLEDGE:
            return State.NORMAL
        case State.RETURNED_UNACKNOWLEDGED, _ if alarm.active:
            return State.UNACKNOWLEDGED
    return alarm.state
