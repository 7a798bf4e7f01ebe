"""`tribowatch axes`: the axes of a history at a glance."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

from monitor.cli.options import AsJson, ConfigFile, StateDir, open_history

if TYPE_CHECKING:
    from monitor.query_rows import AxisSummary

axes_app = typer.Typer(
    name="axes",
    help="List the axes; init describes a new one, check looks at its signals.",
    invoke_without_command=True,
)


@axes_app.callback()
def axes_command(
    context: typer.Context, config: ConfigFile = None, state_dir: StateDir = None, as_json: AsJson = False
) -> None:
    """List the axes of the history: windows, latest friction, baseline, alarms, gaps."""
    if context.invoked_subcommand is not None:
        return
    with open_history(config, state_dir) as reader:
        found = reader.axes()
    if as_json:
        from monitor.cli.output import emit_json

        emit_json({"axes": [axis.to_dict() for axis in found]})
    else:
        _show(found)


def _show(found: list[AxisSummary]) -> None:
    """Print one row per axis."""
    from monitor.cli.output import make_table, screen, show_time

    out = screen()
    if not found:
        out.print("No axis is listed or was heard yet.")
        return
    columns = ("axis", "latest sample (UTC)", ">windows", ">waiting", "baseline", "Coulomb force", ">missing", "alarms")
    rows = [
        (
            axis.name,
            show_time(axis.last_ns),
            str(axis.windows),
            str(axis.pending),
            _baseline(axis),
            _latest(axis),
            str(axis.missing),
            ", ".join(f"{kind}: {state.replace('_', ' ')}" for kind, state in axis.alarms.items()) or "none",
        )
        for axis in found
    ]
    out.print(make_table(columns, rows))


def _baseline(axis: AxisSummary) -> str:
    """How far learning has come."""
    if not axis.listed:
        return "not listed: not identified"
    return f"{'learned from' if axis.learning['complete'] else 'learning,'} {axis.learning['windows']} windows"


def _latest(axis: AxisSummary) -> str:
    """Latest Coulomb friction with its interval."""
    from monitor.cli.output import show_interval, show_number

    if axis.latest is None:
        return "–"
    found = axis.latest["parameters"]["coulomb_force"]
    return f"{show_number(found['value'])} {found['unit']} {show_interval(found['ci95'])}"
