"""Tables in files: `.csv`, `.csv.gz`, `.parquet`, `.mat`. Named columns in, arrays of floats out, precise complaints.

The wanted columns come out as float64; an empty cell is NaN (readable, if unusable), text in a number is an error
that names line, column and text. `select` keeps the rows whose cells equal the given values, as text or as numbers.
"""

from __future__ import annotations

import csv
import gzip
import operator
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TextIO

import numpy as np
from numpy.typing import NDArray

from plant.errors import RecordingError

Floats = NDArray[np.float64]
Choose = Callable[[Sequence[str]], Mapping[str, str]]
"""Given the file's column names, say which to read: our name -> the file's; raises where one is missing."""
Select = Mapping[str, str | float]


def read_table(path: Path, choose: Choose, select: Select) -> dict[str, Floats]:
    """Read the columns that `choose` asks for, from the rows that match `select`.

    Returns:
        Our name -> values (n,), n >= 1.

    Raises:
        RecordingError: no such file, unknown kind, damaged, bad header, text in a number, no row selected, empty.
    """
    reader = _READERS.get(_kind(path))
    if reader is None:
        raise RecordingError(f"{path}: not a kind of recording we read; known are {', '.join(_READERS)}")
    if not path.exists():
        raise RecordingError(f"{path}: no such recording")
    try:
        columns = reader(path, choose, select)
    except (OSError, EOFError, zlib.error, UnicodeDecodeError, csv.Error) as error:
        said = getattr(error, "strerror", None) or str(error)
        raise RecordingError(f"{path}: cannot be read as {_kind(path)}: {said}") from None
    if not len(next(iter(columns.values()))):
        raise RecordingError(f"{path}: no samples below the header")
    return columns


def _kind(path: Path) -> str:
    name = path.name.lower()
    return next((kind for kind in _READERS if name.endswith(kind)), path.suffix)


def matches(cell: str, wanted: str | float) -> bool:
    """True when `cell` says `wanted`: as the same text, or as the same number (2 selects 2, 2.0 and "2")."""
    if cell == str(wanted):
        return True
    try:
        return float(cell) == float(wanted)
    except ValueError:
        return False


def _check_selected(path: Path, columns: Sequence[str], select: Select) -> None:
    for name in select:
        if name not in columns:
            raise RecordingError(f"{path}: select names column {name!r}; the file has: {', '.join(columns)}")


def _nothing_selected(path: Path, select: Select, seen: Mapping[str, Iterable[str]]) -> RecordingError:
    def some(values: Iterable[str]) -> str:
        listed = list(dict.fromkeys(values))
        return ", ".join(listed[:12]) + (f" and {len(listed) - 12} more" if len(listed) > 12 else "")

    asked = ", ".join(f"{name} = {value}" for name, value in select.items())
    there = "; ".join(f"{name} has: {some(values)}" for name, values in seen.items())
    return RecordingError(f"{path}: no row with {asked}; {there}")


def column_names(path: Path, select: Select | None = None) -> tuple[str, ...]:
    """Names of the columns of a file; reads it as `read_table` does, and complains alike."""
    seen: list[str] = []

    def remember(names: Sequence[str]) -> Mapping[str, str]:
        seen.extend(names)
        raise _Enough

    try:
        read_table(path, remember, select or {})
    except _Enough:
        return tuple(seen)
    raise AssertionError("a reader that does not choose its columns")


class _Enough(Exception):  # noqa: N818 - no error
    """Only the names were wanted."""


# --- comma separated ------------------------------------------------------------------------------------------


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


def _read_csv(path: Path, choose: Choose, select: Select) -> dict[str, Floats]:
    with _open_text(path) as file:
        names, delimiter, first = _header(path, file)
        _check_selected(path, names, select)
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
        raise _nothing_selected(path, select, {names[i]: [cell for j, cell in known if j == i] for i in at})


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


# --- parquet --------------------------------------------------------------------------------------------------


def _pyarrow(path: Path) -> Any:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise RecordingError(f"{path}: Parquet needs the extra: pip install 'tribowatch[parquet]'") from None
    return pyarrow


def _read_parquet(path: Path, choose: Choose, select: Select) -> dict[str, Floats]:
    arrow = _pyarrow(path)
    try:
        names = [str(name) for name in arrow.parquet.read_schema(path).names]
        _check_selected(path, names, select)
        wanted = choose(names)
        table = arrow.parquet.read_table(path, columns=list(dict.fromkeys([*wanted.values(), *select])))
    except arrow.ArrowException as error:
        raise RecordingError(f"{path}: cannot be read as .parquet: {str(error).splitlines()[0]}") from None
    keep = _keep(path, {name: list(map(str, table.column(name).to_pylist())) for name in select}, select)
    return {ours: _arrow_floats(arrow, path, name, table.column(name))[keep] for ours, name in wanted.items()}


def _arrow_floats(arrow: Any, path: Path, name: str, column: Any) -> Floats:
    nanoseconds = arrow.types.is_timestamp(column.type) or arrow.types.is_duration(column.type)
    numeric = arrow.types.is_floating(column.type) or arrow.types.is_integer(column.type)
    if not (nanoseconds or numeric or arrow.types.is_decimal(column.type)):
        raise RecordingError(f"{path}: column {name!r} holds {column.type}, not numbers")
    if nanoseconds:  # counted from the first stamp, else float64 keeps only 0.2 us of a date
        maker = arrow.timestamp if arrow.types.is_timestamp(column.type) else arrow.duration
        stamps = column.cast(maker("ns")).cast(arrow.int64()).to_numpy()
        return np.asarray((stamps - stamps[:1]) / 1e9, dtype=np.float64)
    return np.asarray(column.cast(arrow.float64()).to_numpy(), dtype=np.float64)


def _keep(path: Path, cells: Mapping[str, Sequence[str]], select: Select) -> slice | NDArray[np.bool_]:
    if not select:
        return slice(None)
    verdicts = []
    for name, value in select.items():
        known = {cell: matches(cell, value) for cell in set(cells[name])}
        verdicts.append(np.array([known[cell] for cell in cells[name]], dtype=bool))
    keep: NDArray[np.bool_] = np.logical_and.reduce(verdicts)
    if not keep.any():
        raise _nothing_selected(path, select, cells)
    return keep


def write_parquet(path: Path, columns: Mapping[str, Floats]) -> None:
    """Write columns under their names as 64-bit floats."""
    arrow = _pyarrow(path)
    arrow.parquet.write_table(arrow.table(dict(columns)), path)


# --- MATLAB ---------------------------------------------------------------------------------------------------


def _read_mat(path: Path, choose: Choose, select: Select) -> dict[str, Floats]:
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    try:
        content = loadmat(path, simplify_cells=True)
    except NotImplementedError:
        raise RecordingError(f"{path}: MATLAB 7.3 file; save it with -v7, or as csv") from None
    except (MatReadError, ValueError, TypeError, KeyError, IndexError) as error:
        raise RecordingError(f"{path}: cannot be read as .mat: {error}") from None
    vectors = dict(_vectors(content))
    _check_selected(path, list(vectors), select)
    wanted = choose(list(vectors))
    used = {name: vectors[name] for name in [*wanted.values(), *select]}
    if len({len(vector) for vector in used.values()}) > 1:
        lengths = ", ".join(f"{name} {len(vector)}" for name, vector in used.items())
        raise RecordingError(f"{path}: columns differ in length: {lengths} samples")
    keep = _keep(path, {name: [str(cell).strip() for cell in used[name]] for name in select}, select)
    try:
        return {ours: np.asarray(used[name], dtype=np.float64)[keep] for ours, name in wanted.items()}
    except (ValueError, TypeError) as error:
        raise RecordingError(f"{path}: a column is not made of numbers: {error}") from None


def _vectors(content: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, NDArray[Any]]]:
    """Yield vectors by name, those in structs as `struct.field`."""
    for name, value in content.items():
        if name.startswith("__"):
            continue
        if isinstance(value, Mapping):
            yield from _vectors(value, f"{prefix}{name}.")
        elif isinstance(value, np.ndarray) and value.size == max(value.shape, default=0) and value.size > 1:
            yield f"{prefix}{name}", value.ravel()


def write_mat(path: Path, columns: Mapping[str, Floats]) -> None:
    """Write columns as MATLAB vectors of their names."""
    from scipy.io import savemat

    savemat(path, dict(columns), oned_as="column", appendmat=False)


_WRITERS: dict[str, Callable[[Path, Mapping[str, Floats]], None]] = {
    ".csv.gz": write_csv,
    ".csv": write_csv,
    ".parquet": write_parquet,
    ".mat": write_mat,
}


def write_table(path: Path, columns: Mapping[str, Floats]) -> None:
    """Write columns under their names, in the format that the file's name says.

    Raises:
        RecordingError: unknown kind of file, or it cannot be written.
    """
    writer = _WRITERS.get(_kind(path))
    if writer is None:
        raise RecordingError(f"{path}: recordings are written as {', '.join(_WRITERS)}")
    try:
        writer(path, columns)
    except OSError as error:
        raise RecordingError(f"{path}: cannot write the recording: {error.strerror or error}") from None


_READERS: dict[str, Callable[[Path, Choose, Select], dict[str, Floats]]] = {
    ".csv.gz": _read_csv,
    ".csv": _read_csv,
    ".parquet": _read_parquet,
    ".mat": _read_mat,
}
