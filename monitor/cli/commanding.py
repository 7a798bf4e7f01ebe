"""How a command line gives a command to the daemon, or does it itself where no daemon runs."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from monitor.cli.options import AsJson, ConfigFile
from plant.errors import InputError

DEFAULT_CONFIG = Path("tribowatch.toml")


@dataclass(frozen=True)
class Order:
    """Who gives a command to which daemon, and how the answer is shown."""

    author: Annotated[
        str | None, typer.Option("--author", help="Who does this; default: your login name.", show_default=False)
    ] = None
    config: ConfigFile = None
    connect: Annotated[
        str | None,
        typer.Option(
            "--connect",
            help="Zenoh endpoint of a daemon elsewhere, instead of --config; then --site.",
            show_default=False,
        ),
    ] = None
    site: Annotated[str, typer.Option("--site", help="Site of the daemon elsewhere.")] = "plant-1"
    prefix: Annotated[str, typer.Option("--prefix", help="Prefix of its keys.")] = "tribowatch"
    as_json: AsJson = False

    def give(self, action: str, axis: str, arguments: dict[str, Any]) -> dict[str, Any]:
        """Have one command executed: by the daemon where one runs, else here, under its lock.

        Raises:
            InputError: refused, or nobody said which daemon.
            ReachError: the daemon, or its history, is out of reach.
        """
        from monitor.commands import Command
        from monitor.errors import AlreadyRunningError

        command = Command(action, axis, arguments, self.author or _login())
        if self.connect is not None:
            return _ask(command, self.site, self.prefix, self.connect)
        if self.config is None and not DEFAULT_CONFIG.exists():
            raise InputError(
                "say which daemon: --config FILE of a daemon on this machine, or --connect ENDPOINT --site S"
            )
        from monitor.config import read_config
        from monitor.logs import configure_logging
        from monitor.offline import operate_offline

        settings = read_config(self.config or DEFAULT_CONFIG)
        configure_logging("error", "console")
        try:
            return operate_offline(settings, command)
        except AlreadyRunningError:
            return _ask(command, settings.site, settings.zenoh.prefix, *settings.zenoh.listen)

    def report(self, done: dict[str, Any], text: str) -> None:
        """Print what the command did."""
        from monitor.cli.output import emit_json, screen

        if self.as_json:
            emit_json(done)
        else:
            screen().print(text)


def ordered(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command line the options of an `Order`, which it gets as its first argument."""
    shared = list(inspect.signature(Order, eval_str=True).parameters.values())
    own = list(inspect.signature(command, eval_str=True).parameters.values())[1:]

    def run(**given: Any) -> None:
        order = Order(**{option.name: given.pop(option.name) for option in shared})
        command(order, **given)

    parameters = [one.replace(kind=inspect.Parameter.KEYWORD_ONLY) for one in [*own, *shared]]
    run.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]  # what typer reads
    run.__annotations__ = {one.name: one.annotation for one in parameters}
    run.__doc__ = command.__doc__
    return run


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
