"""How a command line gives a command to the daemon, or does it itself where no daemon runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from plant.errors import InputError

DEFAULT_CONFIG = Path("tribowatch.toml")

Author = Annotated[
    str | None, typer.Option("--author", help="Who does this; default: your login name.", show_default=False)
]
Connect = Annotated[
    str | None,
    typer.Option(
        "--connect", help="Zenoh endpoint of a daemon elsewhere, instead of --config; then --site.", show_default=False
    ),
]
Site = Annotated[str, typer.Option("--site", help="Site of the daemon elsewhere.")]
Prefix = Annotated[str, typer.Option("--prefix", help="Prefix of its keys.")]


def give(
    action: str,
    axis: str,
    arguments: dict[str, Any],
    author: str | None,
    config: Path | None,
    connect: str | None = None,
    site: str = "plant-1",
    prefix: str = "tribowatch",
) -> dict[str, Any]:
    """Have one command executed: by the daemon where one runs, else here, under its lock.

    Raises:
        InputError: refused, or nobody said which daemon.
        ReachError: the daemon, or its history, is out of reach.
    """
    from monitor.commands import Command
    from monitor.errors import AlreadyRunningError

    command = Command(action, axis, arguments, author or _login())
    if connect is not None:
        return _ask(command, site, prefix, connect)
    if config is None and not DEFAULT_CONFIG.exists():
        raise InputError("say which daemon: --config FILE of a daemon on this machine, or --connect ENDPOINT --site S")
    from monitor.config import read_config
    from monitor.logs import configure_logging
    from monitor.offline import operate_offline

    settings = read_config(config or DEFAULT_CONFIG)
    configure_logging("error", "console")
    try:
        return operate_offline(settings, command)
    except AlreadyRunningError:
        return _ask(command, settings.site, settings.zenoh.prefix, *settings.zenoh.listen)


def _ask(command: Any, site: str, prefix: str, *endpoints: str) -> dict[str, Any]:
    from monitor.command_zenoh import send_command
    from plant.zenoh_session import open_session

    with open_session("client", connect=endpoints) as session:
        return send_command(session, site, prefix, command)


def _login() -> str:
    """Who is logged in; a name is better than none."""
    import getpass

    try:
        return getpass.getuser()
    except (OSError, KeyError):
        return "unknown"


def report(done: dict[str, Any], text: str, as_json: bool) -> None:
    """Print what a command did."""
    from monitor.cli.output import emit_json, screen

    if as_json:
        emit_json(done)
    else:
        screen().print(text)
