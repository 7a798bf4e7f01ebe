"""TOML from files and texts: whatever they hold, one line says why they cannot be read."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from plant.errors import InputError


def read_toml(path: Path, what: str, error: type[InputError] = InputError, missing: str = "") -> dict[str, Any]:
    """Read the TOML file at `path`; a byte order mark does no harm.

    Args:
        path: the file.
        what: it is, in words, like "axis file".
        error: kind of error to raise.
        missing: what to say where there is no such file.

    Raises:
        InputError: of the kind `error`: it cannot be read, is no text in UTF-8, or no TOML.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError as problem:
        raise error(f"{path}: {missing or f'cannot read the {what}: {problem.strerror}'}") from None
    except OSError as problem:
        raise error(f"{path}: cannot read the {what}: {problem.strerror}") from None
    except UnicodeDecodeError as problem:
        raise error(f"{path}: not text in UTF-8 (byte {problem.start}); the {what} is TOML") from None
    except ValueError as problem:  # no path at all
        raise error(f"{str(path)!r}: cannot read the {what}: {problem}") from None
    return parse_toml(text, str(path), error)


def parse_toml(text: str, where: str, error: type[InputError] = InputError) -> dict[str, Any]:
    """Read TOML; `where` stands in messages.

    Raises:
        InputError: of the kind `error`: it is no TOML.
    """
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as problem:  # ValueError alone: a number of thousands of digits
        raise error(f"{where}: not valid TOML: {problem}") from None
