"""`tribowatch doctor`: is everything in place, and if not, what to do."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from monitor.cli.options import AsJson, ConfigFile, read_configuration

EXIT_CODES = {"bad_input": 2, "out_of_reach": 3}


def doctor_command(
    config: ConfigFile = None,
    bridge: Annotated[
        Path | None, typer.Option(help="A bridge file: look at its bus and its way to the daemon too.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Look at installation, kernels, clock, disk; with --config at axis files, database, workers, daemon, streams too.

    With --bridge it looks at a CAN bridge: its file, frames on the bus, the bridge at work and what it says.
    Exits with 2 when an input is bad, with 3 when the daemon or its database is out of reach.
    """
    from monitor.doctor import examine

    settings = read_configuration(config) if config else None
    checks = []
    for check in examine(settings, bridge):
        checks.append(check)
        if not as_json:
            _show(check.outcome.value, check.name, check.finding)
    if as_json:
        from monitor.cli.output import emit_json

        rows = [{"name": check.name, "outcome": check.outcome.value, "finding": check.finding} for check in checks]
        emit_json({"verdict": _worst([row["outcome"] for row in rows]), "checks": rows})
    elif settings is None and bridge is None:
        typer.echo("Give --config FILE to look at a daemon, its database and its streams too.")
    code = EXIT_CODES.get(_worst([check.outcome.value for check in checks]), 0)
    if code:
        raise typer.Exit(code)


def _worst(outcomes: list[str]) -> str:
    """The outcome that decides."""
    return next((one for one in ("bad_input", "out_of_reach", "warning") if one in outcomes), "ok")


def _show(outcome: str, name: str, finding: str) -> None:
    from rich.text import Text

    from monitor.cli.output import screen

    style = {"ok": "green", "warning": "yellow"}.get(outcome, "red")
    line = Text.assemble((f"{outcome.replace('_', ' '):13}", style), f"{name:18}{finding}")
    screen().print(line)
