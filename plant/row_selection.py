"""Which rows of a table are wanted: those whose cells say given values, as text or as numbers."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from plant.errors import RecordingError

Floats = NDArray[np.float64]
Choose = Callable[[Sequence[str]], Mapping[str, str]]
"""Given the file's column names, say which to read: our name -> the file's; raises where one is missing."""
Select = Mapping[str, str | float]


def matches(cell: str, wanted: str | float) -> bool:
    """True when `cell` says `wanted`: as the same text, or as the same number (2 selects 2, 2.0 and "2")."""
    if cell == str(wanted):
        return True
    try:
        return float(cell) == float(wanted)
    except ValueError:
        return False


def check_selected(path: Path, columns: Sequence[str], select: Select) -> None:
    """Refuse a selection by a column that the file has not.

    Raises:
        RecordingError: names the column and those that are there.
    """
    for name in select:
        if name not in columns:
            raise RecordingError(f"{path}: select names column {name!r}; the file has: {', '.join(columns)}")


def nothing_selected(path: Path, select: Select, seen: Mapping[str, Iterable[str]]) -> RecordingError:
    """The complaint that no row matches, with the values that are there."""

    def some(values: Iterable[str]) -> str:
        listed = list(dict.fromkeys(values))
        return ", ".join(listed[:12]) + (f" and {len(listed) - 12} more" if len(listed) > 12 else "")

    asked = ", ".join(f"{name} = {value}" for name, value in select.items())
    there = "; ".join(f"{name} has: {some(values)}" for name, values in seen.items())
    return RecordingError(f"{path}: no row with {asked}; {there}")


def keep_rows(path: Path, cells: Mapping[str, Sequence[str]], select: Select) -> slice | NDArray[np.bool_]:
    """Mask of the rows whose `cells` match `select`, all rows where nothing is selected.

    Raises:
        RecordingError: no row matches; lists the values that are there.
    """
    if not select:
        return slice(None)
    verdicts = []
    for name, value in select.items():
        known = {cell: matches(cell, value) for cell in set(cells[name])}
        verdicts.append(np.array([known[cell] for cell in cells[name]], dtype=bool))
    keep: NDArray[np.bool_] = np.logical_and.reduce(verdicts)
    if not keep.any():
        raise nothing_selected(path, select, cells)
    return keep
