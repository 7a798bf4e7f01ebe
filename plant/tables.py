"""From a TOML table to a frozen value, checked by the fields' types: unknown keys are errors with the nearest key."""

from __future__ import annotations

import dataclasses
import enum
import types
import typing
from collections.abc import Mapping
from typing import Any, TypeVar

from plant.checks import as_table, check_keys, is_number, nearest
from plant.errors import InputError, ParameterError

T = TypeVar("T")


def build(kind: type[T], value: object, where: str, **given: Any) -> T:
    """Make a `kind` from a table; fields in `given` are set by the caller and not allowed in the table.

    Args:
        kind: a dataclass whose fields are numbers, texts, flags, enums, tuples of them, or None.
        value: what the file says.
        where: file and table, for the message.
        given: fields that the caller fills.

    Raises:
        InputError: unknown key (with the nearest allowed one), missing key, wrong type, value out of range.
    """
    table = as_table(value, where)
    hints = typing.get_type_hints(kind)
    fields = {f.name: f for f in dataclasses.fields(kind) if f.init and f.name not in given}  # type: ignore[arg-type]
    check_keys(table, fields, where)
    for name, field in fields.items():
        if name not in table and field.default is field.default_factory is dataclasses.MISSING:
            raise InputError(f"{where}: key {name!r} is missing")
    values = {key: _convert(value, hints[key], f"{where}: {key}") for key, value in table.items()}
    try:
        return kind(**values, **given)
    except ParameterError as error:
        raise InputError(f"{where}: {error}") from None


def pick(choices: Mapping[str, T], word: object, where: str) -> T:
    """Look `word` up in `choices`.

    Raises:
        InputError: not one of them; names the nearest.
    """
    if not isinstance(word, str):
        raise InputError(f"{where} is {word!r}, but must be one of " + ", ".join(choices))
    if word not in choices:
        raise InputError(f"{where}: unknown {word!r}; {nearest(word, choices)}")
    return choices[word]


def _convert(value: object, hint: Any, where: str) -> Any:
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin in (types.UnionType, typing.Union):
        return _convert(value, next(a for a in arguments if a is not type(None)), where)
    if origin is tuple:
        return _convert_list(value, arguments, where)
    if hint is float and is_number(value):
        return float(value)  # type: ignore[arg-type]  # a number, just checked
    if hint is int and isinstance(value, int) and not isinstance(value, bool):
        return value
    if hint in (str, bool) and isinstance(value, hint):
        return value
    if isinstance(hint, type) and issubclass(hint, enum.Enum) and value in [member.value for member in hint]:
        return hint(value)
    raise InputError(f"{where} is {value!r}, but must be {_wanted(hint)}")


def _convert_list(value: object, items: tuple[Any, ...], where: str) -> tuple[Any, ...]:
    any_length = len(items) == 2 and items[1] is Ellipsis
    if not isinstance(value, list) or not (any_length or len(value) == len(items)):
        length = "" if any_length else f"{len(items)} "
        raise InputError(f"{where} is {value!r}, but must be a list of {length}values")
    hints = [items[0]] * len(value) if any_length else list(items)
    return tuple(_convert(v, hint, f"{where}[{i}]") for i, (v, hint) in enumerate(zip(value, hints, strict=True)))


def _wanted(hint: Any) -> str:
    if isinstance(hint, type) and issubclass(hint, enum.Enum):
        return "one of " + ", ".join(str(member.value) for member in hint)
    return {float: "a finite number", int: "an integer", str: "a text in quotes", bool: "true or false"}.get(
        hint, str(hint)
    )
