"""A stream in files: blocks go into a journal that survives a crash, whole journals become recordings.

A journal is `<axis>.part`: records of length, checksum and payload, each written at once. When it is long enough, when
the epoch or the channels change, or at the end, it becomes `<axis>-<begin>-<epoch>.csv` (or .csv.gz, .parquet) with the
columns `seq`, `t` and the channels as they were sent, and beside it a `.json` with the absolute begin and the gaps. A
journal that a crash has left is read up to its last whole record when the recorder starts again.
"""

from __future__ import annotations

import json
import os
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import IO, Any

import numpy as np

from plant.errors import ParameterError, PayloadError, RecordingError
from plant.recording import Floats
from plant.table_files import write_table
from plant.wire import CBOR, Block, decode_block, encode_block

FORMATS = ("csv", "csv.gz", "parquet")
PART = ".part"
SCHEMA_VERSION = 1
_HEAD = struct.Struct("<II")  # length and CRC-32 of what follows
JUMP = 1.5  # sample times between two stamps that are a pause


@dataclass(frozen=True, slots=True)
class RollRule:
    """When a file is full.

    Attributes:
        format: of the files, one of `FORMATS`.
        megabytes: of payload. [MB] > 0
        minutes: of event time. [min] > 0
    """

    format: str = "csv.gz"
    megabytes: float = 64.0
    minutes: float = 60.0

    def __post_init__(self) -> None:
        """Check ranges."""
        if self.format not in FORMATS:
            raise ParameterError("format", self.format, " or ".join(FORMATS))
        for name, unit in (("megabytes", "MB"), ("minutes", "min")):
            if not getattr(self, name) > 0:
                raise ParameterError(name, getattr(self, name), "> 0", unit)


@dataclass(slots=True)
class RecordCounters:
    """What became of one axis' stream.

    Attributes:
        samples: written.
        blocks: written, whole or in part.
        duplicates: samples that had been written before.
        missing: samples that never came, by their numbers.
        gaps: places where samples are missing or time makes a pause.
        files: finished, in order.
        recovered: samples of a journal that an earlier run left behind.
    """

    samples: int = 0
    blocks: int = 0
    duplicates: int = 0
    missing: int = 0
    gaps: int = 0
    files: list[str] = field(default_factory=list)
    recovered: int = 0


class AxisRecorder:
    """Writes the stream of one axis. A context manager: leaving it finishes the last file."""

    def __init__(self, folder: Path, axis: str, rule: RollRule) -> None:
        """Finish what an earlier run left behind.

        Raises:
            RecordingError: the folder cannot be written.
        """
        self.counters = RecordCounters()
        self._folder, self._axis, self._rule = folder, axis, rule
        self._part = folder / f"{axis}{PART}"
        self._journal: IO[bytes] | None = None
        self._bytes = 0
        self._first: Block | None = None
        self._next: tuple[int, int] | None = None  # epoch and number of the sample to come
        self._last_ns: int | None = None
        self._step: float | None = None
        if self._part.exists():
            self.counters.recovered = self._finish_part()

    def __enter__(self) -> AxisRecorder:
        """Return the recorder."""
        return self

    def __exit__(self, *_: object) -> None:
        """Finish the last file."""
        self.roll()

    def misses(self, block: Block) -> bool:
        """Whether samples of its epoch before `block` were not written."""
        epoch, seq = self._next or (-1, 0)
        return block.epoch >= epoch and block.seq > (seq if block.epoch == epoch else 0)

    def take(self, block: Block, fetched: bool = False) -> None:
        """Write what is new of `block`; what is known of a `fetched` one was asked for, and is no duplicate.

        Raises:
            RecordingError: it cannot be written.
        """
        fresh, known = self._fresh(block)
        if not fetched:
            self.counters.duplicates += known
        if fresh is None:
            return
        if self._first is not None and self._full(fresh):
            self.roll()
        self._note_gap(fresh)
        payload = encode_block(fresh, CBOR)
        try:
            if self._journal is None:
                self._journal = self._part.open("wb")
            self._journal.write(_HEAD.pack(len(payload), zlib.crc32(payload)) + payload)
            self._journal.flush()
        except OSError as error:
            raise RecordingError(f"{self._part}: cannot write: {error.strerror}") from None
        self._first = self._first or fresh
        self._bytes += len(payload)
        self._next = fresh.epoch, fresh.seq + len(fresh)
        self._last_ns = int(fresh.t_ns[-1])
        self.counters.samples += len(fresh)
        self.counters.blocks += 1

    def roll(self) -> None:
        """Turn the journal into a recording."""
        if self._journal is not None:
            self._journal.flush()
            os.fsync(self._journal.fileno())
            self._journal.close()
            self._journal = None
            self._finish_part()
        self._first, self._bytes = None, 0

    def _fresh(self, block: Block) -> tuple[Block | None, int]:
        """The part of `block` that was not written yet, None where all of it was; and how many samples were."""
        if self._next is None or block.epoch > self._next[0]:
            return block, 0
        known = len(block) if block.epoch < self._next[0] else max(0, min(len(block), self._next[1] - block.seq))
        return (None if known == len(block) else _tail(block, known)), known

    def _full(self, block: Block) -> bool:
        first = self._first
        if first is None:
            return False
        return (
            block.epoch != first.epoch
            or block.channels() != first.channels()
            or self._bytes >= self._rule.megabytes * 1e6
            or int(block.t_ns[-1]) - int(first.t_ns[0]) > self._rule.minutes * 60e9
            or int(block.t_ns[0]) <= (self._last_ns or 0)  # a clock set back begins a new file
        )

    def _note_gap(self, block: Block) -> None:
        if len(block) > 1:
            self._step = float(np.median(np.diff(block.t_ns)))
        if self._next is None or self._next[0] != block.epoch:
            return
        missing = block.seq - self._next[1]
        paused = (
            self._last_ns is not None
            and self._step is not None
            and (int(block.t_ns[0]) - self._last_ns > JUMP * self._step)
        )
        self.counters.missing += missing
        self.counters.gaps += bool(missing or paused)

    def _finish_part(self) -> int:
        """Make a recording of the journal and remove it; gives its samples."""
        blocks = list(read_journal(self._part))
        if blocks:
            self.counters.files.append(write_blocks(self._folder, blocks, self._rule.format).name)
        self._part.unlink()
        return sum(map(len, blocks))


def read_journal(path: Path) -> Iterator[Block]:
    """Yield the blocks of a journal up to the last whole record."""
    content = path.read_bytes()
    at = 0
    while at + _HEAD.size <= len(content):
        length, checksum = _HEAD.unpack_from(content, at)
        payload = content[at + _HEAD.size : at + _HEAD.size + length]
        if len(payload) < length or zlib.crc32(payload) != checksum:
            return
        try:
            yield decode_block(payload, CBOR)
        except PayloadError:
            return
        at += _HEAD.size + length


def write_blocks(folder: Path, blocks: list[Block], kind: str) -> Path:
    """Write blocks of one epoch as a recording with its `.json`; writing them twice gives the same file.

    Raises:
        RecordingError: it cannot be written.
    """
    first = blocks[0]
    stamps = np.concatenate([block.t_ns for block in blocks])
    seq = np.concatenate([block.seq + np.arange(len(block)) for block in blocks])
    columns: dict[str, Floats] = {"seq": seq.astype(np.float64), "t": (stamps - stamps[0]) / 1e9}
    for name in first.channels():
        columns[name] = np.concatenate([np.asarray(getattr(block, name), dtype=np.float64) for block in blocks])
    begin = int(stamps[0])
    moment = datetime.fromtimestamp(begin // 10**9, UTC)
    stem = f"{first.axis}-{moment:%Y%m%dT%H%M%S}.{begin % 10**9:09d}Z-{first.epoch}"
    path, draft = folder / f"{stem}.{kind}", folder / f".{stem}.{kind}"
    write_table(draft, columns)
    about = {
        "schema_version": SCHEMA_VERSION,
        "axis": first.axis,
        "epoch": first.epoch,
        "begin_ns": begin,
        "end_ns": int(stamps[-1]),
        "first_seq": int(seq[0]),
        "samples": len(seq),
        "channels": list(first.channels()),
        "gaps": gaps(seq, stamps),
    }
    try:
        draft.replace(path)
        about_file(path).write_text(json.dumps(about, indent=1) + "\n", encoding="utf-8")
    except OSError as error:
        raise RecordingError(f"{path}: cannot write: {error.strerror}") from None
    return path


def gaps(seq: Any, stamps: Any) -> list[dict[str, int]]:
    """Where samples are missing, or time makes a pause: last sample before, first after."""
    if len(seq) < 2:
        return []
    steps = np.diff(stamps)
    at = np.flatnonzero((np.diff(seq) != 1) | (steps > JUMP * np.median(steps)))
    return [
        {
            "after_seq": int(seq[row]),
            "before_seq": int(seq[row + 1]),
            "missing": int(seq[row + 1] - seq[row] - 1),
            "after_ns": int(stamps[row]),
            "before_ns": int(stamps[row + 1]),
        }
        for row in at.tolist()
    ]


def about_file(recording: Path) -> Path:
    """The `.json` beside a recording."""
    return recording.with_name(recording.name + ".json")


def begin_of(recording: Path) -> int | None:
    """Unix time of `t` = 0 of a recording that `tribowatch record` wrote; None for others. [ns]"""
    try:
        begin = json.loads(about_file(recording).read_text(encoding="utf-8"))["begin_ns"]
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return begin if type(begin) is int and begin >= 0 else None


def _tail(block: Block, known: int) -> Block:
    import dataclasses

    cut = {name: getattr(block, name)[known:] for name in (*block.channels(), "t_ns")}
    return dataclasses.replace(block, seq=block.seq + known, **cut)
