"""`tribowatch alerts`: what deserves attention, why, and what to do; `--watch` follows every change."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Annotated, Any

import typer

from monitor.cli.options import AsJson, ConfigFile, DefaultGroup, StateDir, open_history

if TYPE_CHECKING:
    from rich.console import RenderableType

    from monitor.queries import Reader

POLL = 0.5  # s between two looks at the audit
STYLES = {"high": "bold red", "medium": "bold yellow", "low": "bold cyan"}


alerts_app = typer.Typer(
    name="alerts",
    cls=DefaultGroup,
    help="What deserves attention, and what to do with it; without a sub-command: list.",
)


def alerts_list_command(
    axis: Annotated[str | None, typer.Argument(help="Only of this axis.", show_default=False)] = None,
    active: Annotated[bool, typer.Option("--active", help="Only those that are not back to normal.")] = False,
    watch: Annotated[
        bool, typer.Option("--watch", help="Stay, and print every change of state (with --json, one object a line).")
    ] = False,
    config: ConfigFile = None,
    state_dir: StateDir = None,
    as_json: AsJson = False,
) -> None:
    """List the alerts, newest first, each with its evidence, likely cause and recommended action."""
    from monitor.alarm_groups import groups_of

    with open_history(config, state_dir) as reader:
        if watch:
            _watch(reader, axis, as_json)
        found = reader.alerts(axis, active=active)
        if as_json:
            from monitor.cli.output import emit_json

            groups = groups_of([one for one in found if one["state"] != "normal"])
            emit_json({"axis": axis, "alerts": found, "groups": groups, "transitions": reader.transitions(axis)})
            return
    _show(found)


def _watch(reader: Reader, axis: str | None, as_json: bool) -> None:
    """Print transitions as they are stored; ends with ^C only."""
    from monitor.cli.output import emit_json, note, screen

    latest = reader.transitions(axis, limit=1)
    number = latest[-1]["number"] if latest else 0
    note("waiting for changes; stop with ^C")
    while True:
        for change in reader.transitions(axis, after=number):
            number = change["number"]
            if as_json:
                emit_json(change)
            else:
                moved = change["transition"]
                author = f" by {moved['author']}" if moved["author"] else ""
                line = f"{moved['at'][:19]}Z  {change['axis']}  {change['kind']}"
                screen().print(f"{line}: {moved['before']} -> {moved['after']}{author}")
                if moved["after"] == "unacknowledged":
                    screen().print(describe(change["alert"]))
        time.sleep(POLL)


def _show(found: list[dict[str, Any]]) -> None:
    """Print alerts for people."""
    from monitor.cli.output import screen

    out = screen()
    if not found:
        out.print("No alerts.")
    from monitor.alarm_groups import groups_of

    hidden: set[str] = set()
    for group in groups_of([one for one in found if one["state"] != "normal"]):
        if len(group["axes"]) > 1:  # one cause, said once
            out.print(f"[bold]{group['about']}[/bold]: {', '.join(group['axes'])}; the first of them:")
            hidden |= set(group["alerts"][1:])
    for alert in found:
        if alert["id"] not in hidden:
            out.print(describe(alert))
            out.print()


def describe(alert: dict[str, Any]) -> RenderableType:
    """One alert as a person reads it: what and since when, evidence, cause, action."""
    from rich.console import Group
    from rich.table import Table
    from rich.text import Text

    state = alert["state"].replace("_", " ")
    head = Text.assemble(
        (f"{alert['kind'].replace('_', ' ').upper()}  {alert['axis']}", STYLES.get(alert["priority"], "bold")),
        f"  {state}, priority {alert['priority']}, since {alert['since'][:19]}Z",
    )
    body = Table.grid(padding=(0, 2, 0, 0))
    body.add_column(style="dim", no_wrap=True)
    body.add_column(overflow="fold")
    body.add_row("  evidence", alert["text"])
    body.add_row("  likely cause", alert["likely_cause"])
    body.add_row("  do", alert["recommended_action"])
    body.add_row("  otherwise", alert["consequence"])
    return Group(head, body)
