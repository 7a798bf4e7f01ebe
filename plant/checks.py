"""What every reader of a file asks of a value: is it a number, a table, a known key? Pure."""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable, Mapping
from typing import Any

from plant.errors import InputError

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
    """True for a TOML integer or float that a float can hold; a TOML boolean is a Python int, but not a number."""
    try:
        return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    except OverflowError:  # an integer of hundreds of digits
        return False


def check_keys(found: Iterable[str], allowed: Iterable[str], where: str, error: type[InputError] = InputError) -> None:
    """Refuse the first key of `found` that is not `allowed`, naming the nearest that is.

    Raises:
        InputError: of the kind `error`: the key, `where` (file and table), and the nearest allowed key.
    """
    names = list(allowed)
    for key in found:
        if key not in names:
            raise error(f"{where}: unknown key {key!r}; {nearest(key, names)}")


def as_table(value: object, where: str, error: type[InputError] = InputError) -> dict[str, Any]:
    """`value`, which must be a table.

    Raises:
        InputError: of the kind `error`: it is none.
    """
    if not isinstance(value, Mapping):
        raise error(f"{where}: must be a table, is {value!r}")
    return dict(value)


def as_tables(value: object, name: str, where: str) -> list[tuple[str, dict[str, Any]]]:
    """The tables of `value`, written [[name]] in the file, each with its place in words.

    Raises:
        InputError: it is no list, or holds something else than tables.
    """
    if not isinstance(value, list):
        raise InputError(f"{where}: {name} must be written [[{name}]], with two brackets")
    places = [f"{where} [[{name}]] {number}" for number in range(1, len(value) + 1)]
    return [(place, as_table(one, place)) for place, one in zip(places, value, strict=True)]
