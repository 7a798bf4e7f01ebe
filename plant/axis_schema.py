"""What an axis file may say: its tables and keys with type, range and unit; reading is only checking against this."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from plant.checks import as_table, check_keys, is_number
from plant.errors import AxisFileError

SMALLEST, LARGEST = 1e-12, 1e9  # of any number of any machine, in SI: beyond them arithmetic fails before physics
CHANNELS = ("t", "torque", "force", "position", "velocity", "temperature", "load")


@dataclass(frozen=True, slots=True)
class Key:
    """One key: a check of its value, what is wanted in words, and the unit those words are in."""

    accepts: Callable[[Any], bool]
    wanted: str
    unit: str = ""


def number(unit: str, *, positive: bool = False) -> Key:
    """Describe a number in `unit` that a machine can have, >= 0 or > 0."""
    least, words = (SMALLEST, "> 0") if positive else (0.0, ">= 0")
    return Key(lambda v: is_number(v) and least <= v <= LARGEST, f"a number {words} and up to {LARGEST:g}", unit)


def _is_sane(value: Any) -> bool:
    return is_number(value) and abs(value) <= LARGEST


def word(*choices: str) -> Key:
    """Describe a string, one of `choices` where given."""
    wanted = " or ".join(f'"{choice}"' for choice in choices) if choices else "a text in quotes"
    return Key(lambda v: isinstance(v, str) and (not choices or v in choices), wanted)


def _channel_map(value: object, accepts: Callable[[Any], bool]) -> bool:
    return isinstance(value, Mapping) and all(accepts(v) for v in value.values())


_FLAG = Key(lambda v: isinstance(v, bool), "true or false")
_TRAVEL = Key(
    lambda v: isinstance(v, list) and len(v) == 2 and all(map(_is_sane, v)) and v[0] < v[1],
    f"[lowest, highest], two rising numbers up to {LARGEST:g}",
    "m or rad",
)
_COLUMNS = Key(lambda v: _channel_map(v, lambda x: isinstance(x, str)), 'a table like { t = "time_s" }')
_SCALE = Key(
    lambda v: _channel_map(v, lambda x: _is_sane(x) and x != 0),
    f"a table of numbers other than 0 up to {LARGEST:g}, like {{ torque = 0.0934 }}",
    "SI per file unit",
)
_SELECT = Key(
    lambda v: _channel_map(v, lambda x: isinstance(x, str | bool) or is_number(x)),
    'a table like { run = "0m20" }',
)
_PATH = Key(lambda v: isinstance(v, str) and bool(v) and "\0" not in v, "a path in quotes")
_FORCE = "N (N*m rotary)"

TABLES: Mapping[str, Mapping[str, Key]] = {
    "mechanics": {
        "axis": word("vertical", "horizontal", "rotary"),
        "M": number("kg"),
        "J": number("kg*m^2"),
        "Rc": number("m", positive=True),
        "Re": number("m", positive=True),
        "Rm": number("m", positive=True),
        "force_per_torque": Key(
            lambda v: _is_sane(v) and v != 0, f"a number other than 0 up to {LARGEST:g}", "N per N*m"
        ),
        "g": number("m/s^2"),
        "travel": _TRAVEL,
        "inertia_known": _FLAG,
    },
    "drive": {
        "rated_torque": number("N*m", positive=True),
        "rated_force": number(_FORCE, positive=True),
        "torque_resolution": number("N*m"),
        "force_resolution": number(_FORCE),
    },
    "sensor": {"position_resolution": number("m or rad"), "side": word("load", "motor")},
    "stream": {"sample_time": number("s", positive=True), "torque": word()},
    "analysis": {"sample_time": number("s", positive=True)},
    "recording": {
        "file": _PATH,
        "columns": _COLUMNS,
        "scale": _SCALE,
        "select": _SELECT,
        "sample_time": number("s", positive=True),
        "dbc": _PATH,
        "bridge": _PATH,
        "loop": word("open", "closed"),
        "torque": word(),
        "note": word(),
    },
}
TOP = ("name", *TABLES)


def check_table(value: object, name: str, where: str) -> dict[str, Any]:
    """Check one table's keys, types and ranges and return it.

    Raises:
        AxisFileError: one line with `where`, the key, its value with unit, and what is wanted.
    """
    table, keys = as_table(value, where, AxisFileError), TABLES[name]
    check_keys(table, keys, where, AxisFileError)
    for key, value in table.items():
        rule = keys[key]
        if not rule.accepts(value):
            unit = f" {rule.unit}" if rule.unit and not isinstance(value, str | bool | Mapping) else ""
            in_unit = f" [{rule.unit}]" if rule.unit else ""
            raise AxisFileError(f"{where}: {key} is {value!r}{unit}, but must be {rule.wanted}{in_unit}")
    for key in ("columns", "scale"):
        check_keys(table.get(key, {}), CHANNELS, f"{where} {key}", AxisFileError)
    return table
