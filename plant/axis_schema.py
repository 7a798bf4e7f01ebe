"""What an axis file may say: its tables and keys with type, range and unit; reading is only checking against this."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from plant.checks import as_table, check_keys, is_number
from plant.errors import AxisFileError

CHANNELS = ("t", "torque", "force", "position", "velocity", "temperature", "load")


@dataclass(frozen=True, slots=True)
class Key:
    """One key: a check of its value, what is wanted in words, and the unit those words are in."""

    accepts: Callable[[Any], bool]
    wanted: str
    unit: str = ""


def number(unit: str, *, above: float = -math.inf, least: float = -math.inf) -> Key:
    """Describe a finite number in `unit`, `> above` or `>= least`."""
    suffix = f" > {above:g}" if above > -math.inf else f" >= {least:g}" if least > -math.inf else ""
    return Key(lambda v: is_number(v) and v > above and v >= least, f"a finite number{suffix}", unit)


def word(*choices: str) -> Key:
    """Describe a string, one of `choices` where given."""
    wanted = " or ".join(f'"{choice}"' for choice in choices) if choices else "a text in quotes"
    return Key(lambda v: isinstance(v, str) and (not choices or v in choices), wanted)


def _channel_map(value: object, accepts: Callable[[Any], bool]) -> bool:
    return isinstance(value, Mapping) and all(accepts(v) for v in value.values())


_FLAG = Key(lambda v: isinstance(v, bool), "true or false")
_TRAVEL = Key(
    lambda v: isinstance(v, list) and len(v) == 2 and all(map(is_number, v)) and v[0] < v[1],
    "[lowest, highest], two rising numbers",
    "m or rad",
)
_COLUMNS = Key(lambda v: _channel_map(v, lambda x: isinstance(x, str)), 'a table like { t = "time_s" }')
_SCALE = Key(
    lambda v: _channel_map(v, lambda x: is_number(x) and x != 0),
    "a table of numbers other than 0, like { torque = 0.0934 }",
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
        "M": number("kg", least=0),
        "J": number("kg*m^2", least=0),
        "Rc": number("m", above=0),
        "Re": number("m", above=0),
        "Rm": number("m", above=0),
        "force_per_torque": Key(lambda v: is_number(v) and v != 0, "a finite number other than 0", "N per N*m"),
        "g": number("m/s^2", least=0),
        "travel": _TRAVEL,
        "inertia_known": _FLAG,
    },
    "drive": {
        "rated_torque": number("N*m", above=0),
        "rated_force": number(_FORCE, above=0),
        "torque_resolution": number("N*m", least=0),
        "force_resolution": number(_FORCE, least=0),
    },
    "sensor": {"position_resolution": number("m or rad", least=0), "side": word("load", "motor")},
    "stream": {"sample_time": number("s", above=0), "torque": word()},
    "analysis": {"sample_time": number("s", above=0)},
    "recording": {
        "file": _PATH,
        "columns": _COLUMNS,
        "scale": _SCALE,
        "select": _SELECT,
        "sample_time": number("s", above=0),
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
