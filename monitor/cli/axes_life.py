"""`tribowatch axes event|events|versions|relearn|rename|delete`: the life of an axis in its history."""

from __future__ import annotations

from typing import Annotated

import typer

from monitor.cli.commanding import Order, ordered
from monitor.cli.options import AsJson, ConfigFile, StateDir, open_history

AxisName = Annotated[str, typer.Argument(help="Name of the axis.")]


@ordered
def event_command(
    order: Order,
    axis: AxisName,
    text: Annotated[str, typer.Argument(help='What was done, like "relubricated".')],
    kind: Annotated[str, typer.Option(help="Kind of event: maintenance, lubrication, repair, ...")] = "maintenance",
    at: Annotated[
        str | None, typer.Option(help="When (UTC), like 2026-03-01T12:00; default: now.", show_default=False)
    ] = None,
    new_baseline: Annotated[
        bool, typer.Option("--new-baseline", help="The axis is another one now: learn its friction anew.")
    ] = False,
) -> None:
    """Note what was done to AXIS; it shows in the trend, and with --new-baseline the watch learns anew."""
    arguments = {"text": text, "kind": kind, "new_baseline": new_baseline, **({"at": at} if at else {})}
    done = order.give("event", axis, arguments)
    anew = "; its baseline is learned anew" if done["new_baseline"] else ""
    order.report(done, f"{axis}: noted at {done['at'][:19]}Z{anew}")


@ordered
def relearn_command(
    order: Order,
    axis: AxisName,
    why: Annotated[str, typer.Option(help="Why; goes into the events.")] = "learn anew",
) -> None:
    """Forget the baseline of AXIS; its next informative windows make a new one."""
    done = order.give("relearn", axis, {"text": why})
    order.report(done, f"{axis}: its baseline is learned anew from {done['at'][:19]}Z on")


EffectName = Annotated[str, typer.Argument(help="Name of the effect, as a diagnosis gives it: rail_defect, ...")]


@ordered
def promote_command(
    order: Order,
    axis: AxisName,
    effect: EffectName,
) -> None:
    """Make EFFECT part of the model of AXIS: its size is identified with every window and watched from now on."""
    done = order.give("promote", axis, {"effect": effect})
    order.report(done, f"{axis}: version {done['version']} of its model has {', '.join(done['effects'])}")


@ordered
def demote_command(
    order: Order,
    axis: AxisName,
    effect: EffectName,
) -> None:
    """Take EFFECT out of the model of AXIS again."""
    done = order.give("demote", axis, {"effect": effect})
    has = ", ".join(done["effects"]) or "no effect"
    order.report(done, f"{axis}: version {done['version']} of its model has {has}")


@ordered
def rename_command(
    order: Order,
    axis: AxisName,
    to: Annotated[str, typer.Argument(help="Its new name.")],
) -> None:
    """Give AXIS another name; its whole history goes with it."""
    done = order.give("rename", axis, {"to": to})
    order.report(done, f"{axis} is {to} now" + (f"; {done['note']}" if done["note"] else ""))


@ordered
def delete_command(
    order: Order,
    axis: AxisName,
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask.")] = False,
) -> None:
    """Delete AXIS with its whole history: samples, estimates, alarms, audit, evidence. Not for a listed axis."""
    if not yes:
        typer.confirm(f"Delete axis {axis} with its whole history? It cannot be brought back.", abort=True, err=True)
    done = order.give("delete", axis, {})
    order.report(done, f"{axis}: deleted ({done['samples']} samples had been received)")


def events_command(
    axis: AxisName, config: ConfigFile = None, state_dir: StateDir = None, as_json: AsJson = False
) -> None:
    """List what was done to AXIS: maintenance, new baselines, changed constants, by whom."""
    with open_history(config, state_dir) as reader:
        found = reader.events(axis)
    from monitor.cli.output import emit_json, make_table, screen, show_time

    if as_json:
        emit_json({"axis": axis, "events": found})
        return
    rows = [
        (show_time(one["at_ns"]), one["kind"], one["text"], one["author"], "new" if one["new_baseline"] else "")
        for one in found
    ]
    columns = ("time (UTC)", "kind", "what", "by", "baseline")
    screen().print(make_table(columns, rows) if rows else f"{axis}: nothing was noted yet.")


def versions_command(
    axis: AxisName, config: ConfigFile = None, state_dir: StateDir = None, as_json: AsJson = False
) -> None:
    """List the versions of AXIS' constants and promoted effects: since when, what changed, by whom."""
    with open_history(config, state_dir) as reader:
        found = reader.versions(axis)
    from monitor.cli.output import emit_json, make_table, screen, show_time

    if as_json:
        emit_json({"axis": axis, "versions": found})
        return
    rows = [
        (
            str(one["version"]),
            show_time(one["from_ns"]) if one["from_ns"] else "the beginning",
            one["why"],
            one["author"],
            ", ".join(one["effects"]) or "none",
        )
        for one in found
    ]
    screen().print(make_table((">version", "from (UTC)", "what changed", "by", "effects"), rows))
