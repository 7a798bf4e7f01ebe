"""CAN logs as recordings: `.blf`, `.asc` and candump's `.log`, decoded by a DBC or a bridge file. By python-can.

The time base of a log is worth a doubt: dates without a time zone, stamps relative to the start or to the frame before,
clocks set back, several buses in one file, a file that was cut off. What was found is said in `Recording.remarks`.
"""

from __future__ import annotations

import dataclasses
import datetime as dt
import itertools
import re
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import can
import numpy as np

from plant.axis import Axis, RecordingEntry
from plant.bus_can import raw_frame
from plant.can_assembly import Assembler, Clock, TimeRule
from plant.can_axis import Piece
from plant.can_batch import DATA, Frames, RawFrame, batch, join
from plant.can_layout import AxisLayout
from plant.cia402 import SYNC
from plant.errors import InputError, RecordingError
from plant.recording import Floats

UNIX = 10**17  # ns, 1973: smaller stamps are no Unix time
BACKWARDS = 10**9  # ns; a larger step back is a clock that was set, a smaller one two frames that changed places
CHUNK = 100_000  # frames at a time
SAME_PERIOD = 0.02  # SYNC and sample_time that differ by more are not of one machine


@dataclass(frozen=True, slots=True, eq=False)
class Log:
    """What a log holds.

    Attributes:
        frames: in the order of the file.
        begin_ns: Unix time of the first frame, None where the log does not say. [ns]
        remarks: what was odd about its time base.
    """

    frames: Frames
    begin_ns: int | None
    remarks: tuple[str, ...]


# --- the file ---------------------------------------------------------------------------------------------------


def read_log(path: Path, channel: str | None = None) -> Log:
    """Read all frames of a log, of one bus where `channel` names it.

    Raises:
        RecordingError: no such file, damaged, empty, or no frame of that channel.
    """
    if not path.exists():
        raise RecordingError(f"{path}: no such recording")
    kind = path.suffix.lower()
    found: list[RawFrame] = []
    whole: list[Frames] = []  # arrays take a tenth of the memory of tuples
    channels: Counter[str] = Counter()
    remarks: list[str] = []
    try:
        with path.open("rb") if kind == ".blf" else path.open(encoding="utf-8", errors="replace") as file:
            reader = _READERS[kind](file)  # opened here: a reader that refuses the file leaves it open
            for message in reader:
                channels[str(message.channel)] += 1
                if channel is None or str(message.channel) == channel:
                    found.append(raw_frame(message, round(message.timestamp * 1e9)))
                    if len(found) == CHUNK:
                        whole.append(batch(found))
                        found.clear()
    except (OSError, EOFError) as error:
        raise RecordingError(f"{path}: cannot be read: {getattr(error, 'strerror', None) or error}") from None
    except Exception as error:  # the readers raise whatever a damaged byte leads them to
        if not found and not whole:
            if path.stat().st_size == 0:
                raise RecordingError(f"{path}: empty, no frames") from None
            why = str(error)[:200] or type(error).__name__
            raise RecordingError(f"{path}: not a {kind} log, or damaged at its beginning ({why})") from None
        said = str(error)[:80] or type(error).__name__
        count = len(found) + len(whole) * CHUNK
        remarks.append(f"damaged after {count} frames ({said}): what comes after is lost")
    if not found and not whole:
        there = f"; it has the channels {', '.join(sorted(channels))}" if channels else ""
        raise RecordingError(f"{path}: no frames{f' of channel {channel}' if channels else ''}{there}")
    if channel is None and len(channels) > 1:
        _refuse_mixed(path, channels)
    frames = join(*whole, batch(found))
    begin_ns, more, frames = _time_base(reader, kind, path, frames)
    return Log(frames, begin_ns, (*remarks, *more))


# dates are read below: python-can takes the time zone of whoever reads the file
_READERS: dict[str, Callable[[Any], Any]] = {
    ".blf": can.BLFReader,
    ".asc": lambda file: can.ASCReader(file, relative_timestamp=True),
    ".log": can.CanutilsLogReader,
}


def _refuse_mixed(path: Path, channels: Counter[str]) -> None:
    """Two buses in one log have the same ids for different drives."""
    names = ", ".join(f"{name} ({count} frames)" for name, count in channels.most_common(6))
    raise RecordingError(
        f"{path}: holds several buses: {names}; choose one in [[recording]]: "
        f'select = {{ channel = "{channels.most_common(1)[0][0]}" }}'
    )


def _time_base(reader: Any, kind: str, path: Path, frames: Frames) -> tuple[int | None, list[str], Frames]:
    """When the log begins, what is odd about its stamps, and the frames with stamps counted from one origin."""
    remarks: list[str] = []
    stamps = frames.t_ns
    if kind == ".asc" and getattr(reader, "timestamps_format", None) == "relative":
        stamps = np.cumsum(stamps)
        remarks.append("stamps are relative to the frame before: added up")
    begin: int | None = int(stamps[0]) if stamps[0] > UNIX else None
    if kind == ".asc":
        begin = _asc_begin(_asc_date(path) or getattr(reader, "date", None), int(stamps[0]), remarks)
    elif kind == ".blf" and begin is not None:
        remarks.append("a BLF date has no time zone: taken as UTC")
    elif begin is None:
        remarks.append("stamps are no Unix time: the date of the recording is unknown")
    if stamps[0] < 0:
        remarks.append(f"stamps begin at {stamps[0] * 1e-9:g} s, before zero")
    steps = np.diff(stamps)
    if (back := int(np.sum(steps < 0))) > 0:
        worst = float(steps.min()) * -1e-9
        remarks.append(f"time runs backwards {back} times, by up to {worst:g} s")
    size = getattr(reader, "file_size", None)
    if kind == ".blf" and size and path.stat().st_size < size:
        remarks.append(f"cut off: {path.stat().st_size} of {size} bytes are there")
    return begin, remarks, dataclasses.replace(frames, t_ns=stamps)


_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
_GERMAN = {"mär": "mar", "mrz": "mar", "mai": "may", "okt": "oct", "dez": "dec"}


def _asc_date(path: Path) -> str | None:
    """The date of the first trigger block, which stamps count from; None where there is none."""
    with path.open(encoding="utf-8", errors="replace") as file:
        for line in itertools.islice(file, 50):
            if match := re.match(r"\s*Begin Trigger ?block\s+\w+\s+(.+)", line, re.IGNORECASE):
                return match[1].strip()
    return None


def _asc_begin(date: str | None, first: int, remarks: list[str]) -> int | None:
    """The date of an ASC file, `Sep 30 15:06:13.191 2017` or with am/pm; written in local time, taken as UTC."""
    match = re.match(r"(\S{3})\w* +(\d+) +(\d+):(\d+):(\d+)(\.\d+)? *([AaPp][Mm])? +(\d{4})", date or "")
    month = _GERMAN.get(match[1].lower(), match[1].lower()) if match else ""
    if match is None or month not in _MONTHS:
        remarks.append("the date of the file cannot be read: when it was recorded is unknown")
        return None
    hour = int(match[3])
    if match[7]:
        hour = hour % 12 + (12 if match[7].lower() == "pm" else 0)
    try:
        moment = dt.datetime(
            int(match[8]), _MONTHS.index(month) + 1, int(match[2]), hour, int(match[4]), int(match[5]), tzinfo=dt.UTC
        )
    except ValueError:
        remarks.append(f"the date {date!r} cannot be: when it was recorded is unknown")
        return None
    remarks.append("an ASC date has no time zone: taken as UTC")
    return round(moment.timestamp()) * 10**9 + round(float(match[6] or 0) * 1e9) + first


# --- the samples ------------------------------------------------------------------------------------------------


def read_can_log(entry: RecordingEntry, axis: Axis) -> tuple[dict[str, Floats], int | None, tuple[str, ...]]:
    """Read one axis' samples: channels in SI with `t` [s], the Unix time of `t` = 0, and what was odd.

    Raises:
        RecordingError: unreadable, no DBC or bridge file, no frame of this axis, or a layout that does not fit.
    """
    if set(entry.select) - {"channel"}:
        raise RecordingError(f'{entry.file}: a CAN log is selected by channel alone: select = {{ channel = "can0" }}')
    layout, rule = _layout(entry, axis)
    chosen = str(entry.select["channel"]) if "channel" in entry.select else None
    log = read_log(entry.file, chosen)
    rule, remarks = _clock(entry, log, rule)
    assembler = Assembler([layout], rule)
    pieces: list[Piece] = []
    for first in range(0, len(log.frames), CHUNK):
        pieces += [piece for _, piece in assembler.take(log.frames.take(slice(first, first + CHUNK)))]
    pieces += [piece for _, piece in assembler.finish()]
    if not pieces:
        raise _nothing(entry, layout, assembler)
    stamps = np.concatenate([piece.t_ns for piece in pieces])
    channels = {name: np.concatenate([piece.channels[name] for piece in pieces]) for name in pieces[0].channels}
    origin = int(stamps[0])
    channels["t"] = np.asarray((stamps - origin) / 1e9, dtype=np.float64)
    if rule.origin == "time_object":
        begin: int | None = origin if origin > UNIX else None
    else:
        begin = None if log.begin_ns is None else log.begin_ns + origin - int(log.frames.t_ns[0])
    return channels, begin, (*log.remarks, *remarks, *_losses(assembler, layout))


def _layout(entry: RecordingEntry, axis: Axis) -> tuple[AxisLayout, TimeRule | None]:
    from plant.bridge_file import read_bridge
    from plant.dbc_cantools import dbc_layout

    if entry.bridge is not None:
        settings = read_bridge(entry.bridge)
        layout = settings.layout(axis.name)
        if layout is None:
            raise RecordingError(f"{entry.bridge}: does not list axis {axis.name!r}, whose log {entry.file} is")
        return layout, settings.time.rule()
    if entry.dbc is None:
        raise RecordingError(
            f"{entry.file}: a CAN log needs to be told what its frames mean: in the axis file, [[recording]] "
            'dbc = "plant.dbc" with columns = { torque = "Message.Signal", ... }, or bridge = "bridge.toml"'
        )
    try:
        return dbc_layout(entry.dbc, axis.name, entry.columns, {}), None
    except InputError as error:
        raise RecordingError(str(error)) from None


def _clock(entry: RecordingEntry, log: Log, rule: TimeRule | None) -> tuple[TimeRule, list[str]]:
    """SYNC where the log has it, else the arrival of the frames."""
    if rule is not None and rule.clock is Clock.ARRIVAL:
        return rule, []
    key = rule.sync_key if rule is not None else SYNC
    syncs = log.frames.t_ns[(log.frames.keys == key) & (log.frames.kinds == DATA)]
    if len(syncs) < 2:
        if rule is not None:
            raise RecordingError(f'{entry.file}: no SYNC in it; set [time] clock = "arrival" in {entry.bridge}')
        return TimeRule(Clock.ARRIVAL), []
    seen = float(np.median(np.diff(syncs))) * 1e-9
    wanted = rule.period if rule is not None else entry.sample_time
    in_time_lapse = rule is not None and rule.origin == "time_object"
    if wanted is not None and abs(seen - wanted) > SAME_PERIOD * wanted and not in_time_lapse:
        raise RecordingError(
            f"{entry.file}: SYNC comes every {seen:.4g} s, but {'period' if rule else 'sample_time'} is {wanted:g} s"
        )
    if rule is not None:
        return rule, []
    return TimeRule(period=wanted or round(seen, 6)), [f"SYNC every {wanted or round(seen, 6):g} s is the clock"]


def _losses(assembler: Assembler, layout: AxisLayout) -> list[str]:
    count, clock = assembler.axes[layout.axis].counters, assembler.clock.counters
    said = []
    if count.lost or count.filled or count.absent:
        said.append(f"samples missing in the log: {count.filled} single ones, {count.lost + count.absent} in gaps")
    if clock.syncs_lost:
        said.append(f"{clock.syncs_lost} SYNCs missing in the log")
    if assembler.frames.wrong_length:
        said.append(f"{assembler.frames.wrong_length.total()} frames of another length than the layout's left out")
    if count.suspicion:
        said.append(count.suspicion)
    return said


def _nothing(entry: RecordingEntry, layout: AxisLayout, assembler: Assembler) -> RecordingError:
    said = assembler.refused(layout.axis)
    if said is None:
        from plant.can_layout import show_id

        wanted = ", ".join(f"{show_id(frame.key)} ({frame.name})" for frame in layout.frames)
        seen = ", ".join(show_id(key) for key, _ in assembler.frames.unknown.most_common(8))
        said = f"no complete sample; wanted {wanted}; other ids in the log: {seen or 'none'}"
    return RecordingError(f"{entry.file}: {said}")
