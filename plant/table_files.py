"""Tables in files: `.csv`, `.csv.gz`, `.parquet`, `.mat`. Named columns in, arrays of floats out, precise complaints.

The wanted columns come out as float64; an empty cell is NaN (readable, if unusable), text in a number is an error
that names line, column and text. `select` keeps the rows whose cells equal the given values, as text or as numbers.
"""

from __future__ import annotations

import csv
import zlib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from plant.csv_files import read_csv, write_csv
from plant.errors import RecordingError
from plant.mat_files import read_mat, write_mat
from plant.parquet_files import read_parquet, write_parquet
from plant.row_selection import Choose, Floats, Select


def read_table(path: Path, choose: Choose, select: Select) -> dict[str, Floats]:
    """Read the columns that `choose` asks for, from the rows that match `select`.

    Returns:
        Our name -> values (n,), n >= 1.

    Raises:
        RecordingError: no such file, unknown kind, damaged, bad header, text in a number, no row selected, empty.
    """
    reader = _READERS.get(_kind(path))
    if reader is None:
        raise RecordingError(
            f"{path}: not a kind of recording we read; known are {', '.join(_READERS)}, .blf, .asc, .log"
        )
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
    ".csv.gz": read_csv,
    ".csv": read_csv,
    ".parquet": read_parquet,
    ".mat": read_mat,
}
