"""Options that several commands share, and how they are resolved."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperGroup

from plant.errors import InputError

if TYPE_CHECKING:
    from monitor.config import Config
    from monitor.queries import Reader


class DefaultGroup(TyperGroup):
    """A command with sub-commands that also works without naming one: then it means the first."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Put the first sub-command's name where none is given."""
        if not args or (args[0] not in self.commands and args[0] not in ctx.help_option_names):
            args = [next(iter(self.commands)), *args]
        return super().parse_args(ctx, args)


AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object on stdout and nothing else there.")]
AsCsv = Annotated[bool, typer.Option("--csv", help="Print CSV on stdout, units in the header.")]
ConfigFile = Annotated[
    Path | None, typer.Option("--config", help="The daemon's configuration file (TOML).", show_default=False)
]
StateDir = Annotated[
    Path | None,
    typer.Option(
        "--state-dir",
        help="Folder of the daemon's database; default: the configuration's state_dir, else var.",
        show_default=False,
    ),
]

ENDPOINT = "tcp/127.0.0.1:7447"  # where a daemon listens by default
Endpoints = Annotated[
    list[str] | None,
    typer.Option(
        "--connect", help=f"Zenoh endpoint of the daemon; may be repeated. Default {ENDPOINT}.", show_default=False
    ),
]
StreamSite = Annotated[str, typer.Option("--site", help="Site in the key of the stream.")]
StreamPrefix = Annotated[str, typer.Option("--prefix", help="Prefix of the key.")]


def open_history(config_file: Path | None, state_dir: Path | None) -> Reader:
    """The history to read: of --state-dir, else of what --config says, else of the folder `var`. Close it.

    Raises:
        ConfigError: the configuration cannot be used.
        DatabaseError: no history there, or it cannot be read.
    """
    from monitor.queries import Reader

    return Reader(history_url(config_file, state_dir)[0])


def history_url(config_file: Path | None, state_dir: Path | None, *, must_exist: bool = True) -> tuple[str, Path]:
    """URL of the history and the daemon's folder, found as `open_history` does.

    Raises:
        ConfigError: the configuration cannot be used.
        DatabaseError: no history there, though there must be one.
    """
    from monitor.errors import DatabaseError

    if state_dir is None and config_file is not None:
        config = read_configuration(config_file)
        return config.database_url, config.state_dir
    folder = (state_dir or Path("var")).resolve()
    path = folder / "tribowatch.db"
    if must_exist and not path.exists():
        raise DatabaseError(f"{path}: no history here; say where the daemon keeps it: --state-dir DIR or --config FILE")
    return f"sqlite:///{path}", folder


def read_configuration(path: Path) -> Config:
    """The configuration at `path`; imported late, it takes a quarter of a second."""
    from monitor.config import read_config

    return read_config(path)


def one_format(as_json: bool, as_csv: bool) -> None:
    """Refuse two output formats at once."""
    if as_json and as_csv:
        raise InputError("--json and --csv exclude each other: choose one")
