"""`tribowatch history backup|restore`: a copy of the whole history, and back."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from monitor.cli.options import AsJson, ConfigFile, StateDir, history_url

Target = Annotated[Path, typer.Argument(help="File of the back-up.")]


def backup_command(
    file: Target, config: ConfigFile = None, state_dir: StateDir = None, as_json: AsJson = False
) -> None:
    """Copy the whole history to FILE, as of one moment; the daemon may run on."""
    from rich.progress import Progress

    from monitor.cli.output import emit_json, screen
    from monitor.store_backup import back_up

    url, _ = history_url(config, state_dir)
    console = screen(stderr=True)
    with Progress(console=console, disable=not console.is_terminal, transient=True) as bar:
        task = bar.add_task("copying", total=None)
        size = back_up(url, file, lambda done, total: bar.update(task, completed=done, total=total))
    if as_json:
        emit_json({"file": str(file), "bytes": size})
    else:
        screen().print(f"{file}: {size} bytes")


def restore_command(
    file: Target,
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask.")] = False,
    config: ConfigFile = None,
    state_dir: StateDir = None,
    as_json: AsJson = False,
) -> None:
    """Put the back-up FILE in the place of the history; what was there is moved aside. No daemon may run there."""
    from monitor.cli.output import emit_json, screen
    from monitor.service import own
    from monitor.store_backup import restore

    url, folder = history_url(config, state_dir, must_exist=False)
    if not yes:
        typer.confirm(f"Put {file} in the place of the history in {folder}?", abort=True, err=True)
    with own(folder):
        moved = restore(file, url)
    if as_json:
        emit_json({"file": str(file), "moved": str(moved) if moved else None})
    else:
        screen().print(f"{file} is the history now" + (f"; what was there is {moved}" if moved else ""))
