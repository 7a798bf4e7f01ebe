"""The life-cycle of an alarm after ISA-18.2 / IEC 62682. Pure: time comes in as an argument, what changed goes out.

::

    normal -> unacknowledged -> acknowledged -> normal
              unacknowledged -> returned_unacknowledged -> normal (acknowledged late) | unacknowledged (again)
    any -> shelved (an operator, for a time), suppressed (by design), out_of_service (maintenance) -> back

While shelved, suppressed or out of service the condition is still followed: coming back shows what is true then.
A condition counts when `count` of the last `of` observations say so and the first of them is `delay` old.
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
        on_count: observations among the last `on_of` that raise the alarm. [1] >= 1
        off_count: observations among the last `off_of` that let it return. [1] >= 1
        on_of, off_of: how far back is looked; never less than the count, which then means "in a row". [1]
        on_delay_ns: time the condition must hold besides. [ns]
        off_delay_ns: time it must be gone besides. [ns]
        latch: it does not return by itself, only when acknowledged while its condition is gone.
    """

    on_count: int = 1
    off_count: int = 1
    on_delay_ns: int = 0
    off_delay_ns: int = 0
    latch: bool = False
    on_of: int = 1
    off_of: int = 1


@dataclass(frozen=True, slots=True)
class Alarm:
    """One alarm.

    Attributes:
        state: where it is.
        since_ns: when it came there. [ns]
        active: its condition, after the delays.
        recent: the latest observations, newest in the lowest bit; 1 contradicts `active`.
        against_ns: stamp of the first contradiction among them. [ns]
        until_ns: event time at which shelving ends, None = not by event time. [ns]
        until_wall_ns: wall clock at which it ends at the latest, should the stream stop. [ns]
        inhibitor: the axis fault that keeps it suppressed; empty where an operator or a program did.
    """

    state: State = State.NORMAL
    since_ns: int = 0
    active: bool = False
    recent: int = 0
    against_ns: int = 0
    until_ns: int | None = None
    until_wall_ns: int | None = None
    inhibitor: str = ""


@dataclass(frozen=True, slots=True)
class Transition:
    """A change of state, worth an audit row."""

    before: State
    after: State
    event: Event
    at_ns: int


def advance(
    alarm: Alarm,
    event: Event,
    now_ns: int,
    rule: AlarmRule,
    *,
    until_ns: int | None = None,
    wall_ns: int | None = None,
    until_wall_ns: int | None = None,
    inhibitor: str = "",
) -> tuple[Alarm, Transition | None]:
    """One step. An event that means nothing in this state changes nothing (acknowledging twice, say).

    Args:
        alarm: the alarm as it is.
        event: what happened.
        now_ns: when; stamps may step back, states may not. [ns]
        rule: delays and latch.
        until_ns: with `SHELVE`, event time at which it comes back by itself. [ns]
        wall_ns: the wall clock, where shelving may end by it. [ns]
        until_wall_ns: with `SHELVE`, wall clock at which it comes back at the latest. [ns]
        inhibitor: with `SUPPRESS`, the axis fault that does it.
    """
    if event in (Event.HOLDS, Event.GONE):
        alarm = _observe(alarm, event is Event.HOLDS, now_ns, rule)
    after = _next_state(alarm, event, rule, _expired(alarm, now_ns, wall_ns))
    shelved_anew = event is Event.SHELVE and after is State.SHELVED
    if after is alarm.state and not shelved_anew:
        return alarm, None
    moved = dataclasses.replace(
        alarm,
        state=after,
        since_ns=now_ns,
        until_ns=until_ns if shelved_anew else None,
        until_wall_ns=until_wall_ns if shelved_anew else None,
        inhibitor=inhibitor if after is State.SUPPRESSED else "",
    )
    return moved, Transition(alarm.state, after, event, now_ns)


def _observe(alarm: Alarm, holds: bool, now_ns: int, rule: AlarmRule) -> Alarm:
    """Remember one observation; turn the condition when enough of the latest say so for long enough."""
    if alarm.active:
        count, of, delay = rule.off_count, rule.off_of, rule.off_delay_ns
    else:
        count, of, delay = rule.on_count, rule.on_of, rule.on_delay_ns
    contradicts = holds != alarm.active
    recent = (alarm.recent << 1 | contradicts) & ((1 << max(count, of)) - 1)
    since = min(alarm.against_ns, now_ns) if alarm.recent else now_ns  # a clock that steps back starts the delay anew
    if contradicts and recent.bit_count() >= count and now_ns - since >= delay:
        return dataclasses.replace(alarm, active=holds, recent=0, against_ns=now_ns)
    return dataclasses.replace(alarm, recent=recent, against_ns=since if recent else 0)


def _expired(alarm: Alarm, now_ns: int, wall_ns: int | None) -> bool:
    """Whether shelving is over: by the axis' own time, or by the wall clock where the axis fell silent.

    A wall clock that stepped back by more than the time of shelving ends it too: hidden for ever would be worse.
    """
    if alarm.until_ns is not None and now_ns >= alarm.until_ns:
        return True
    if alarm.until_wall_ns is None or wall_ns is None:
        return False
    left = alarm.until_wall_ns - wall_ns
    return left <= 0 or (alarm.until_ns is not None and left > 2 * (alarm.until_ns - alarm.since_ns))


def _next_state(alarm: Alarm, event: Event, rule: AlarmRule, expired: bool) -> State:
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
