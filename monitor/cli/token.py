"""`tribowatch token`: who may see the page, who may operate."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from monitor.cli.options import AsJson, ConfigFile
from plant.errors import InputError

token_app = typer.Typer(name="token", help="Make, list and take back the tokens of the page and the HTTP API.")
TokenFile = Annotated[
    Path | None,
    typer.Option("--file", help="The token file; default: [page] token_file of --config.", show_default=False),
]
HolderName = Annotated[str, typer.Argument(help="Whose token it is; the author of what is done with it.")]


@token_app.command("add")
def add_command(
    name: HolderName,
    role: Annotated[str, typer.Option(help="view: look at everything; operate: acknowledge, shelve, promote too.")] = (
        "view"
    ),
    file: TokenFile = None,
    config: ConfigFile = None,
    as_json: AsJson = False,
) -> None:
    """Make a token for NAME and print it, once: only its hash is kept. A running daemon takes it at once."""
    from monitor.token_files import add_token
    from monitor.tokens import Role

    if role not in list(Role):
        raise InputError(f"--role {role!r} is not known; it is view or operate")
    path = _path(file, config)
    token = add_token(path, name, Role(role))
    if as_json:
        from monitor.cli.output import emit_json

        emit_json({"name": name, "role": role, "token": token, "file": str(path)})
        return
    from monitor.cli.output import note, screen

    screen().print(token, soft_wrap=True)
    note(f"{name} may {role}; the token cannot be shown again. Kept in {path} as a hash.")


@token_app.command("list")
def list_command(file: TokenFile = None, config: ConfigFile = None, as_json: AsJson = False) -> None:
    """List who has a token; the tokens themselves are not kept."""
    from monitor.cli.output import emit_json, make_table, screen
    from monitor.token_files import read_tokens

    found = read_tokens(_path(file, config))
    if as_json:
        emit_json({"tokens": [{"name": one.name, "role": one.role.value, "made": one.made} for one in found]})
    elif not found:
        screen().print("Nobody has a token.")
    else:
        screen().print(make_table(("name", "role", "made (UTC)"), [(one.name, one.role, one.made) for one in found]))


@token_app.command("remove")
def remove_command(name: HolderName, file: TokenFile = None, config: ConfigFile = None) -> None:
    """Take back the token of NAME; it stops working at once."""
    from monitor.cli.output import screen
    from monitor.token_files import remove_token

    remove_token(_path(file, config), name)
    screen().print(f"The token of {name} works no more.")


def _path(file: Path | None, config: Path | None) -> Path:
    """The token file that is meant.

    Raises:
        InputError: none is named.
    """
    if file is not None:
        return file
    if config is None:
        raise InputError("which tokens? give --file FILE, or --config with token_file in its [page] section")
    from monitor.cli.options import read_configuration

    page = read_configuration(config).page
    if not page.token_file:
        raise InputError(f'{config}: no token file is named; write token_file = "tokens.toml" in its [page] section')
    return Path(page.token_file)
