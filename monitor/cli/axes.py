"""`tribowatch axes`: the axes of a history at a glance."""

from __future__ import annotations

from typing import Any

import typer

from monitor.cli.options import AsJson, ConfigFile, StateDir, history_url

WIDE = 110  # columns of a screen that holds everything
LONGEST_STATE = 14  # characters of "unacknowledged"

axes_app = typer.Typer(
    name="axes",
    help="List the axes; init describes a new one, check looks at its signals.",
    invoke_without_command=True,
)


@axes_app.callback()
def axes_command(
    context: typer.Context, config: ConfigFile = None, state_dir: StateDir = None, as_json: AsJson = False
) -> None:
    """List the axes of the history, the most urgent first: alarms, latest friction, change, trend, gaps."""
    if context.invoked_subcommand is not None:
        return
    from monitor.cli.output import emit_json
    from monitor.query_page import PageReader

    with PageReader(history_url(config, state_dir)[0]) as reader:
        if as_json:
            emit_json({"axes": [axis.to_dict() for axis in reader.axes()]})
        else:
            _show(reader.fleet())


def _show(found: list[dict[str, Any]]) -> None:
    """Print one row per axis, the most urgent first."""
    from monitor.cli.output import make_table, screen, show_time, sparkline

    out = screen()
    if not found:
        out.print("No axis is listed or was heard yet.")
        return
    narrow = out.width < WIDE  # there the date goes without year and seconds, and the trend is left to the page
    rows = [
        {
            "axis": axis["axis"],
            "how it is": _how(axis),
            "Coulomb friction": _latest(axis["friction"]),
            ">change": "–" if axis["change"] is None else f"{100 * axis['change']:+.1f} %",
            **({} if narrow else {"30 days": sparkline(axis["trend"], 8)}),
            ">to alarm": _height(axis),
            ">missing": str(axis["missing"]),
            "latest (UTC)": show_time(axis["last_sample_ns"])[5:16] if narrow else show_time(axis["last_sample_ns"]),
        }
        for axis in found
    ]
    table = make_table(tuple(rows[0]), [tuple(row.values()) for row in rows])
    for column in table.columns[1:-1]:
        column.no_wrap = False  # or a screen of 80 columns cuts the last ones away
    table.columns[-1].min_width = len(rows[0]["latest (UTC)"])
    table.columns[1].min_width = LONGEST_STATE
    out.print(table)


def _how(axis: dict[str, Any]) -> str:
    """What to do about it, and why."""
    alarms = ", ".join(f"{one['kind'].replace('_', ' ')} {one['state'].replace('_', ' ')}" for one in axis["alarms"])
    return f"{axis['urgency']['word']}: {alarms}" if alarms else str(axis["urgency"]["word"])


def _height(axis: dict[str, Any]) -> str:
    """How far its charts have come towards an alarm, or how far learning has."""
    if axis["height"] is not None:
        return f"{100 * axis['height']:.0f} %"
    return f"{axis['baseline']['windows']} learned" if axis["listed"] else "not identified"


def _latest(friction: dict[str, Any] | None) -> str:
    """Latest Coulomb friction with its interval."""
    from monitor.cli.output import show_interval, show_number

    if friction is None:
        return "–"
    return f"{show_number(friction['value'])} {friction['unit']} {show_interval(friction['ci95'])}"
