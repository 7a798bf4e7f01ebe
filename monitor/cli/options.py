"""Options that several commands share, and how they are resolved."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from plant.errors import InputError

if TYPE_CHECKING:
    from monitor.config import Config

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


def database_url(config_file: Path | None, state_dir: Path | None) -> str:
    """URL of the history to read: --state-dir, else what --config says, else `var`.

    Raises:
        ConfigError: the configuration cannot be used.
    """
    if state_dir is None and config_file is not None:
        return read_configuration(config_file).database_url
    return f"sqlite:///{(state_dir or Path('var')).resolve() / 'tribowatch.db'}"


def read_configuration(path: Path) -> Config:
    """The configuration at `path`; imported late, it takes a quarter of a second."""
    from monitor.config import read_config

    return read_config(path)


def one_format(as_json: bool, as_csv: bool) -> None:
    """Refuse two output formats at once."""
    if as_json and as_csv:
        raise InputError("--json and --csv exclude each other: choose one")
