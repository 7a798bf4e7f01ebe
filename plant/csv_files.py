"""Comma separated tables, `.csv` and `.csv.gz`: read fast, and complained about with line, column and text.

Semicolons and tabs are understood as well, with them decimal commas; lines that begin with `#` before the header are
comments; an empty cell is NaN.
"""

from __future__ import annotations

import csv
import gzip
import operator
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TextIO

import numpy as np

from plant.errors import RecordingError
from plant.row_selection import Choose, Floats, Select, check_selected, matches, nothing_selected


def _open_text(path: Path) -> TextIO:
    if path.name.lower().endswith(".gz"):
        return gzip.open(path, "rt", encoding="utf-8-sig", newline="")
    return path.open(encoding="utf-8-sig", newline="")


def _header(path: Path, file: TextIO) -> tuple[list[str], str, int]:
    """Read the first line that is no `#` comment: column names, delimiter, line number."""
    number = 0
    for line in file:
        number += 1
        if line.strip() and not line.startswith("#"):
            delimiter = max(",;\t", key=line.count)
            names = [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter))]
            break
    else:
        raise RecordingError(f"{path}: empty; a header line with the column names is needed")
    if all(_is_float(name) for name in names):
        raise RecordingError(f"{path}: line {number} should name the columns, but holds numbers: {', '.join(names)}")
    twice = next((name for name in names if name and names.count(name) > 1), None)
    if twice is not None:
        raise RecordingError(f"{path}: line {number} names column {twice!r} twice")
    return names, delimiter, number


def _is_float(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def read_csv(path: Path, choose: Choose, select: Select) -> dict[str, Floats]:
    """Read the columns that `choose` asks for, from the rows that match `select`; errors as `read_table`."""
    with _open_text(path) as file:
        names, delimiter, first = _header(path, file)
        check_selected(path, names, select)
        wanted = choose(names)
        reader = csv.reader(file, delimiter=delimiter)
        rows = list(filter(None, reader)) if not select else list(_selected(path, names, reader, select))
    at = [names.index(column) for column in wanted.values()]
    try:
        pick = operator.itemgetter(*at)
        texts = list(zip(*map(pick, rows), strict=True)) or [()] * len(at)
        return {ours: _to_floats(column, delimiter) for ours, column in zip(wanted, texts, strict=True)}
    except (ValueError, IndexError):
        raise _complaint(path, wanted, select, first) from None


def _selected(path: Path, names: Sequence[str], rows: Iterable[list[str]], select: Select) -> Iterator[list[str]]:
    """Keep the rows that match; each distinct cell is compared once."""
    at = {names.index(name): value for name, value in select.items()}
    known: dict[tuple[int, str], bool] = {}
    found = False
    for row in rows:
        for i, value in at.items():
            cell = row[i] if i < len(row) else ""
            if (same := known.get((i, cell))) is None:
                same = known[i, cell] = matches(cell, value)
            if not same:
                break
        else:
            found = True
            yield row
    if not found:
        raise nothing_selected(path, select, {names[i]: [cell for j, cell in known if j == i] for i in at})


def _to_floats(column: Sequence[str], delimiter: str) -> Floats:
    try:
        values = list(map(float, column))
    except ValueError:
        return np.array([_to_float(cell, delimiter) for cell in column])
    if any("_" in cell for cell in column):  # Python reads 1_000, no data logger writes it
        raise ValueError
    return np.array(values, dtype=np.float64)


def _to_float(cell: str, delimiter: str) -> float:
    cell = cell.strip()
    if not cell:
        return float("nan")
    if delimiter != ",":
        cell = cell.replace(",", ".")  # a decimal comma
    if "_" in cell:
        raise ValueError
    return float(cell)


def _complaint(path: Path, wanted: Mapping[str, str], select: Select, first: int) -> RecordingError:
    """Read the file again, slowly, and say which line, column and text is not a number."""
    with _open_text(path) as file:
        names, delimiter, _ = _header(path, file)
        reader = csv.reader(file, delimiter=delimiter)
        chosen = {names.index(name): value for name, value in select.items()}
        for row in filter(None, reader):
            line = first + reader.line_num
            if not all(i < len(row) and matches(row[i], value) for i, value in chosen.items()):
                continue
            for column in wanted.values():
                if (i := names.index(column)) >= len(row):
                    return RecordingError(
                        f"{path}: line {line} has {len(row)} cells, the header names {len(names)} columns"
                    )
                try:
                    _to_float(row[i], delimiter)
                except ValueError:
                    return RecordingError(f"{path}: line {line}, column {column!r}: {row[i]!r} is not a number")
    return RecordingError(f"{path}: a cell is not a number")


def _open_for_writing(path: Path) -> TextIO:
    if path.name.lower().endswith(".gz"):
        return gzip.open(path, "wt", encoding="utf-8", newline="")
    return path.open("w", encoding="utf-8", newline="")


def write_csv(path: Path, columns: Mapping[str, Floats]) -> None:
    """Write columns under their names; every float keeps its 64 bits, NaN becomes an empty cell."""
    cells = [["" if value != value else repr(value) for value in column.tolist()] for column in columns.values()]
    with _open_for_writing(path) as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(zip(*cells, strict=True))
