"""`tribowatch run`: the daemon, in the foreground."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def run_command(
    config: Annotated[Path, typer.Option("--config", help="The daemon's configuration file (TOML).")],
) -> None:
    """Run the daemon until SIGTERM or ^C: streams in; history, alerts and status out. Logs go to stderr."""
    from monitor.service import run_daemon

    raise typer.Exit(run_daemon(config))
