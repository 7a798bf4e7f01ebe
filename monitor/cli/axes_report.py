"""`tribowatch axes report`: what happened to one axis, as a page to file or to send."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from monitor.cli.options import AsJson, ConfigFile, StateDir, history_url


def axes_report_command(
    axis: Annotated[str, typer.Argument(help="Name of the axis.")],
    since: Annotated[str, typer.Option(help="This far back from the axis' latest sample: 90d, 2w, 1y.")] = "90d",
    report: Annotated[
        Path | None, typer.Option(help="The page; default: AXIS.html in this folder.", show_default=False)
    ] = None,
    config: ConfigFile = None,
    state_dir: StateDir = None,
    as_json: AsJson = False,
) -> None:
    """Write what the history holds of AXIS as one HTML page: friction, trends, alarms, maintenance, data quality."""
    from monitor.cli.output import emit_json, screen
    from monitor.query_page import PageReader
    from monitor.report_file import check_folder, write_axis_report

    path = report or Path(f"{axis}.html")
    check_folder(path)
    with PageReader(history_url(config, state_dir)[0]) as reader:
        write_axis_report(path, reader, axis, since)
    if as_json:
        emit_json({"axis": axis, "since": since, "report": str(path)})
    else:
        screen().print(f"report: {path}")
