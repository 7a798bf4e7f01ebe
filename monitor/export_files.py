"""Every answer of an axis as a table, in CSV or Parquet: one row per window and parameter."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from plant.errors import InputError

COLUMNS = {
    "t_ns": "int64", "time": "string", "parameter": "string", "unit": "string", "value": "float64",
    "ci95_low": "float64", "ci95_high": "float64", "identifiable": "bool", "at_bound": "bool", "axis_version": "int64",
    "seed": "int64", "software": "string", "data_sha256": "string",
}  # fmt: skip
ROWS = 50_000  # of one row group


def export(rows: Iterable[dict[str, Any]], path: Path) -> int:
    """Write `rows` (keys are `COLUMNS`) to `path`, `.csv` or `.parquet`; how many there were.

    Raises:
        InputError: another ending, or a file that cannot be written.
    """
    writers = {".csv": _write_csv, ".parquet": _write_parquet}
    write = writers.get(path.suffix.lower())
    if write is None:
        raise InputError(f"{path}: exports end in .csv or .parquet")
    try:
        return write(rows, path)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror or error}") from None


def _write_csv(rows: Iterable[dict[str, Any]], path: Path) -> int:
    count = 0
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        for row in rows:
            writer.writerow({name: "" if one is None else one for name, one in row.items()})
            count += 1
    return count


def _write_parquet(rows: Iterable[dict[str, Any]], path: Path) -> int:
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError:
        raise InputError(f"{path}: Parquet needs pyarrow: pip install 'tribowatch[parquet]'") from None
    types = {"int64": pa.int64(), "float64": pa.float64(), "string": pa.string(), "bool": pa.bool_()}
    schema = pa.schema([(name, types[kind]) for name, kind in COLUMNS.items()])
    count = 0
    with pq.ParquetWriter(path, schema) as writer:
        for part in _parts(rows):
            writer.write_table(pa.Table.from_pylist(part, schema))
            count += len(part)
    return count


def _parts(rows: Iterable[dict[str, Any]]) -> Iterator[list[dict[str, Any]]]:
    part: list[dict[str, Any]] = []
    for row in rows:
        part.append(row)
        if len(part) == ROWS:
            yield part
            part = []
    yield part
