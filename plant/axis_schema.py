"""What an axis file may say: its tables and keys with type, range and unit; reading is only checking against this."""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from plant.errors import AxisFileError

CHANNELS = ("t", "torque", "force", "position", "velocity", "temperature", "load")


_CALLED = {"mass": "M", "inertia": "J", "gravity": "g", "orientation": "axis", "gain": "force_per_torque"}


def nearest(word: str, allowed: Iterable[str]) -> str:
    """Say which of `allowed` was probably meant: "did you mean 'M'?"; where that is a long shot, list them all."""
    names = list(allowed)
    if _CALLED.get(word.lower()) in names:
        return f"did you mean {_CALLED[word.lower()]!r}?"
    folded = {name.lower(): name for name in names}
    best = folded[difflib.get_close_matches(word.lower(), folded, n=1, cutoff=0.0)[0]]
    sure = difflib.SequenceMatcher(None, word.lower(), best.lower()).ratio() >= 0.6
    return f"did you mean {best!r}?" + ("" if sure else f" allowed here: {', '.join(names)}")


def is_number(value: object) -> bool:
    """True for a finite TOML integer or float; a TOML boolean is a Python int, but not a number."""
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


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
        "file": Key(lambda v: isinstance(v, str) and bool(v), "a path in quotes"),
        "columns": _COLUMNS,
        "scale": _SCALE,
        "select": _SELECT,
        "sample_time": number("s", above=0),
        "dbc": Key(lambda v: isinstance(v, str) and bool(v), "a path in quotes"),
        "bridge": Key(lambda v: isinstance(v, str) and bool(v), "a path in quotes"),
        "loop": word("open", "closed"),
        "torque": word(),
        "note": word(),
    },
}
TOP = ("name", *TABLES)


def check_keys(found: Iterable[str], allowed: Iterable[str], where: str) -> None:
    """Refuse the first key of `found` that is not `allowed`.

    Raises:
        AxisFileError: names the key, `where` (file and table), and the nearest allowed key.
    """
    names = list(allowed)
    for key in found:
        if key not in names:
            raise AxisFileError(f"{where}: unknown key {key!r}; {nearest(key, names)}")


def check_table(table: object, name: str, where: str) -> dict[str, Any]:
    """Check one table's keys, types and ranges and return it.

    Raises:
        AxisFileError: one line with `where`, the key, its value with unit, and what is wanted.
    """
    if not isinstance(table, dict):
        raise AxisFileError(f"{where}: must be a table, is {table!r}")
    keys = TABLES[name]
    check_keys(table, keys, where)
    for key, value in table.items():
        rule = keys[key]
        if not rule.accepts(value):
            unit = f" {rule.unit}" if rule.unit and not isinstance(value, str | bool | Mapping) else ""
            in_unit = f" [{rule.unit}]" if rule.unit else ""
            raise AxisFileError(f"{where}: {key} is {value!r}{unit}, but must be {rule.wanted}{in_unit}")
    for key in ("columns", "scale"):
        check_keys(table.get(key, {}), CHANNELS, f"{where} {key}")
    return table
