"""What a command prints: pure JSON or CSV for programs, tables and sparklines for people, progress on stderr."""

from __future__ import annotations

import csv
import json
import math
import sys
from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from plant.recording import Recording

BARS = "▁▂▃▄▅▆▇█"
SCHEMA_VERSION = 1
PLAIN_WIDTH = 120  # columns of a table that goes into a file or a pipe


def emit_json(result: Mapping[str, Any]) -> None:
    """Print one JSON object on stdout with `schema_version` in it; NaN and infinities become null."""
    sys.stdout.write(json.dumps(_plain({"schema_version": SCHEMA_VERSION, **result}), allow_nan=False) + "\n")
    sys.stdout.flush()


def emit_csv(header: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """Print a table as CSV on stdout; units belong into the header's names."""
    writer = csv.writer(sys.stdout, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)


def note(text: str) -> None:
    """One line of progress or advice on stderr, never on stdout."""
    sys.stderr.write(text + "\n")
    sys.stderr.flush()


def with_remarks(recordings: list[Recording]) -> list[Recording]:
    """Say what is odd about the files, each remark once; gives the recordings back."""
    for remark in dict.fromkeys(remark for recording in recordings for remark in recording.remarks):
        note(remark)
    return recordings


def screen(*, stderr: bool = False) -> Console:
    """A rich console; plain text, never cut, where it is not a terminal."""
    from rich.console import Console

    console = Console(stderr=stderr, highlight=False, markup=False)
    if not console.is_terminal:
        console.soft_wrap = True
        console.width = max(console.width, PLAIN_WIDTH)
    return console


def make_table(columns: Sequence[str], rows: Iterable[Sequence[str]], title: str | None = None) -> Table:
    """A rich table; columns whose name starts with '>' are right-aligned, the last one may wrap."""
    from rich import box
    from rich.table import Table

    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, pad_edge=False)
    for number, column in enumerate(columns, 1):
        side: Literal["left", "right"] = "right" if column.startswith(">") else "left"
        table.add_column(column.lstrip(">"), justify=side, overflow="fold", no_wrap=number < len(columns))
    for row in rows:
        table.add_row(*row)
    return table


def sparkline(values: Sequence[float | None], width: int = 24) -> str:
    """Values as bars, lowest to highest, averaged down to `width`; gaps stay blank."""
    cells = [_mean(values[i * len(values) // width : (i + 1) * len(values) // width]) for i in range(width)]
    if len(values) < width:
        cells = [_mean([value]) for value in values]
    known = [cell for cell in cells if cell is not None]
    if not known:
        return ""
    low, span = min(known), max(known) - min(known)
    scale = (len(BARS) - 1) / span if span > 0 else 0.0
    return "".join(" " if cell is None else BARS[round((cell - low) * scale)] for cell in cells)


def show_number(value: float | None, digits: int = 4) -> str:
    """A number with `digits` significant digits; a dash where there is none."""
    return "–" if value is None or not math.isfinite(value) else f"{value:.{digits}g}"


def show_interval(interval: Sequence[float | None] | None, digits: int = 4) -> str:
    """A 95 % interval in brackets; says so where the data do not give one."""
    if interval is None or any(end is None for end in interval):
        return "not identifiable"
    return f"[{show_number(interval[0], digits)}, {show_number(interval[1], digits)}]"


def show_time(moment: datetime | int | None) -> str:
    """A UTC time to the second, from a datetime or from nanoseconds since 1970."""
    if moment is None:
        return "–"
    if isinstance(moment, int):
        moment = datetime.fromtimestamp(moment / 1e9, tz=UTC)
    return f"{moment:%Y-%m-%d %H:%M:%S}Z"


def _mean(values: Sequence[float | None]) -> float | None:
    """Mean of the finite values, None without any."""
    known = [value for value in values if value is not None and math.isfinite(value)]
    return sum(known) / len(known) if known else None


def _plain(value: Any) -> Any:
    """What JSON can hold: numbers finite or null, times as ISO 8601 in UTC, numpy scalars as numbers."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, datetime):
        return value.astimezone(UTC).isoformat().replace("+00:00", "Z")
    if isinstance(value, (str, bool)) or value is None:
        return value
    if hasattr(value, "item"):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value
