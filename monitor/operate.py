"""What commands do: a table from action to function. Runs in the supervising thread, or offline under the lock.

An action checks its arguments, changes store and memory together, and returns what a person is told. To add one, write
a function and name it in `ACTIONS`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import structlog

from monitor.alarm_desk import AlarmDesk
from monitor.alarms import Alarm, Event
from monitor.axis_run import AxisRun
from monitor.commands import Command, CommandBox
from monitor.config import Config
from monitor.drift import DriftState, Kind
from monitor.errors import DatabaseError, QueryError
from monitor.fleet import Fleet
from monitor.promotion import with_effect, without_effect
from monitor.query_rows import SCHEMA_VERSION
from monitor.store import Store
from monitor.store_records import EventRecord, VersionRecord
from monitor.times import iso, parse_duration, parse_time, span
from plant import keys
from plant.checks import nearest
from plant.errors import ParameterError, TribowatchError

log = structlog.get_logger()

LONGEST_TEXT = 1000  # characters of an event's text, an author, a reason


@dataclass(frozen=True, slots=True)
class Floor:
    """What commands act on; `wall` is Unix time. [ns]"""

    config: Config
    store: Store
    fleet: Fleet
    alarms: AlarmDesk
    wall: Callable[[], int]

    def now_ns(self, run: AxisRun) -> int:
        """Event time of an axis: its latest sample; the wall clock before the first one. [ns]"""
        return self.wall() if run.record.last_ns is None else run.record.last_ns


Action = Callable[[Floor, AxisRun, Command], dict[str, Any]]


def serve(floor: Floor, box: CommandBox) -> None:
    """Execute everything that waits in `box`; every command is answered.

    Raises:
        DatabaseError: after those who asked were told; the daemon cannot go on without its history.
    """
    out_of_reach: DatabaseError | None = None
    for command, answer in box.take():
        if out_of_reach is not None:
            answer.set_exception(out_of_reach)
            continue
        try:
            answer.set_result(operate(floor, command))
        except TribowatchError as error:
            answer.set_exception(error)
            out_of_reach = error if isinstance(error, DatabaseError) else None
        except Exception as error:
            log.exception("a command tripped an error of ours", action=command.action, axis=command.axis)
            answer.set_exception(QueryError(f"this command failed ({type(error).__name__}); the daemon's log says why"))
    if out_of_reach is not None:
        raise out_of_reach


def operate(floor: Floor, command: Command) -> dict[str, Any]:
    """Execute one command; what it did, as JSON.

    Raises:
        QueryError: unknown action or axis, missing or wrong arguments, or an action that is not possible now.
    """
    action = ACTIONS.get(command.action)
    if action is None:
        raise QueryError(f"action {command.action!r} is not known; {nearest(command.action, ACTIONS)}")
    run = floor.fleet.runs.get(command.axis)
    if run is None:
        known = sorted(floor.fleet.runs)
        hint = nearest(command.axis, known) if known else "no axis is listed or was heard"
        raise QueryError(f"axis {command.axis!r} is not known; {hint}")
    done = action(floor, run, command)
    log.info("command", action=command.action, axis=command.axis, author=command.author, **command.arguments)
    return {"schema_version": SCHEMA_VERSION, "action": command.action, "axis": run.record.name, **done}


# --- arguments ------------------------------------------------------------------------------------------------


def text_of(command: Command, name: str, default: str | None = None) -> str:
    """A text argument.

    Raises:
        QueryError: missing without a default, no text, or too long.
    """
    value = command.arguments.get(name, default)
    if value is None:
        raise QueryError(f"{command.action} needs {name!r}")
    if not isinstance(value, str) or len(value) > LONGEST_TEXT:
        raise QueryError(f"{name!r} must be a text of at most {LONGEST_TEXT} characters")
    return value


def flag_of(command: Command, name: str) -> bool:
    """A yes or no; left out means no."""
    value = command.arguments.get(name, False)
    return value.lower() not in ("", "false", "0", "no") if isinstance(value, str) else bool(value)


def only(command: Command, *names: str) -> None:
    """Refuse arguments that the action does not take, so that a misspelt one is noticed."""
    for name in command.arguments:
        if name not in names:
            raise QueryError(f"{command.action} does not take {name!r}; it takes {', '.join(names) or 'nothing'}")


def author_of(command: Command) -> str:
    """Who wants it.

    Raises:
        QueryError: nobody said so; an audit without a name is none.
    """
    author = command.author.strip()
    if not author or len(author) > LONGEST_TEXT:
        raise QueryError(f"{command.action} needs an author: say who does this")
    return author


# --- alarms ---------------------------------------------------------------------------------------------------

ALARM_EVENTS = {
    "acknowledge": Event.ACKNOWLEDGE,
    "shelve": Event.SHELVE,
    "unshelve": Event.UNSHELVE,
    "suppress": Event.SUPPRESS,
    "unsuppress": Event.UNSUPPRESS,
    "out-of-service": Event.REMOVE,
    "in-service": Event.RETURN,
}


def move_alarm(floor: Floor, run: AxisRun, command: Command) -> dict[str, Any]:
    """Acknowledge, shelve, unshelve, suppress, unsuppress, out-of-service, in-service: `kind`, shelving also `for`."""
    event, kind, author = ALARM_EVENTS[command.action], text_of(command, "kind"), author_of(command)
    only(command, *(("kind", "for") if event is Event.SHELVE else ("kind",)))
    if kind not in list(Kind):
        raise QueryError(f"alarm kind {kind!r} is not known; {nearest(kind, list(Kind))}")
    for_ns = parse_duration(text_of(command, "for")) if event is Event.SHELVE else None
    longest_ns = round(floor.config.alarms.longest_shelving * 1e9)
    if for_ns is not None and not 0 < for_ns <= longest_ns:
        raise QueryError(
            f"for {span(for_ns)} is not possible: more than 0, at most {span(longest_ns)} (longest_shelving)"
        )
    changed = floor.alarms.command(run, kind, event, author, for_ns)
    alarm = run.alarms[kind].alarm if kind in run.alarms else Alarm()
    return {"kind": kind, "changed": changed, "state": alarm.state.value, "until": iso(alarm.until_ns)}


# --- life of an axis ------------------------------------------------------------------------------------------


def note_event(floor: Floor, run: AxisRun, command: Command) -> dict[str, Any]:
    """Something worth remembering: `text`, `kind`, `at`; with `new_baseline` the watch learns anew."""
    only(command, "text", "kind", "at", "new_baseline")
    at = text_of(command, "at", "")
    event = EventRecord(
        parse_time(at) if at else floor.now_ns(run),
        text_of(command, "kind", "maintenance"),
        text_of(command, "text"),
        author_of(command),
        flag_of(command, "new_baseline"),
    )
    return _store_event(floor, run, event)


def relearn(floor: Floor, run: AxisRun, command: Command) -> dict[str, Any]:
    """Forget the baseline; the next informative windows make a new one. `text` says why."""
    only(command, "text")
    text = text_of(command, "text", "") or "learn anew"
    return _store_event(floor, run, EventRecord(floor.now_ns(run), "relearn", text, author_of(command), True))


def _store_event(floor: Floor, run: AxisRun, event: EventRecord) -> dict[str, Any]:
    if event.new_baseline:
        run.drift = DriftState()
        run.record.drift = run.drift.to_dict()
    number = floor.store.add_event(run.record, event)
    return {"number": number, "at": iso(event.at_ns), "kind": event.kind, "new_baseline": event.new_baseline}


def rename(floor: Floor, run: AxisRun, command: Command) -> dict[str, Any]:
    """Give the axis another name: `to`. Its stream must come under the new name from now on."""
    only(command, "to")
    author, old = author_of(command), run.record.name
    try:
        new = keys.check_id("axis", text_of(command, "to"))
    except ParameterError as error:
        raise QueryError(str(error)) from None
    floor.store.rename_axis(run.record, new)
    floor.fleet.rename(old, new)
    floor.store.add_event(run.record, EventRecord(floor.now_ns(run), "renamed", f"{old} -> {new}", author))
    note = f'write name = "{new}" into its axis file before the next start, and send its stream under the new name'
    return {"from": old, "to": new, "note": note if run.axis is not None else None}


def delete(floor: Floor, run: AxisRun, command: Command) -> dict[str, Any]:
    """Delete the axis with its whole history; only one that the configuration does not list."""
    only(command)
    author_of(command)
    if run.axis is not None:
        raise QueryError(
            f"axis {run.record.name!r} is listed in the configuration: take it out there and start again, then delete "
            "it; to begin a new baseline use relearn"
        )
    floor.store.delete_axis(run.record.id)
    floor.fleet.forget(run.record.name)
    return {"samples": run.record.samples, "deleted": True}


def promote(floor: Floor, run: AxisRun, command: Command) -> dict[str, Any]:
    """Make `effect` part of the axis' model; stored windows are identified again: the trend stays comparable."""
    only(command, "effect")
    effect = text_of(command, "effect")
    return _remodel(floor, run, with_effect(run, effect, floor.now_ns(run), author_of(command)))


def demote(floor: Floor, run: AxisRun, command: Command) -> dict[str, Any]:
    """Take `effect` out of the axis' model again."""
    only(command, "effect")
    effect = text_of(command, "effect")
    return _remodel(floor, run, without_effect(run, effect, floor.now_ns(run), author_of(command)))


def _remodel(floor: Floor, run: AxisRun, version: VersionRecord) -> dict[str, Any]:
    floor.store.add_version(run.record, version)
    run.remodel = True
    return {"version": version.version, "effects": sorted(version.effects), "why": version.why}


ACTIONS: dict[str, Action] = {
    **dict.fromkeys(ALARM_EVENTS, move_alarm),
    "event": note_event,
    "relearn": relearn,
    "rename": rename,
    "delete": delete,
    "promote": promote,
    "demote": demote,
}
