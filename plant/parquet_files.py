"""Parquet tables, by pyarrow, which is an extra: time stamps become seconds, nulls NaN."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from plant.errors import RecordingError
from plant.row_selection import Choose, Floats, Select, check_selected, keep_rows


def _pyarrow(path: Path) -> Any:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise RecordingError(f"{path}: Parquet needs the extra: pip install 'tribowatch[parquet]'") from None
    return pyarrow


def read_parquet(path: Path, choose: Choose, select: Select) -> dict[str, Floats]:
    """Read the columns that `choose` asks for, from the rows that match `select`; errors as `read_table`."""
    arrow = _pyarrow(path)
    try:
        names = [str(name) for name in arrow.parquet.read_schema(path).names]
        check_selected(path, names, select)
        wanted = choose(names)
        table = arrow.parquet.read_table(path, columns=list(dict.fromkeys([*wanted.values(), *select])))
    except arrow.ArrowException as error:
        raise RecordingError(f"{path}: cannot be read as .parquet: {str(error).splitlines()[0]}") from None
    keep = keep_rows(path, {name: list(map(str, table.column(name).to_pylist())) for name in select}, select)
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


def write_parquet(path: Path, columns: Mapping[str, Floats]) -> None:
    """Write columns under their names as 64-bit floats."""
    arrow = _pyarrow(path)
    arrow.parquet.write_table(arrow.table(dict(columns)), path)
