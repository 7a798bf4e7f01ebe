"""Recordings in files: column names, units and run selection of the axis file applied at the edge; SI inside."""

from __future__ import annotations

import dataclasses
import difflib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from plant.axis import Axis, RecordingEntry
from plant.errors import RecordingError
from plant.record_files import begin_of
from plant.recording import Floats, Recording
from plant.table_files import read_table, write_table

CAN_LOGS = (".blf", ".asc", ".log")
_REQUIRED = ("t", "position")
_OPTIONAL = ("velocity", "temperature", "load")


def read_recording(path: str | Path, axis: Axis) -> Recording:
    """Read the recording at `path` as the axis file describes it.

    A file that the axis file does not list has the standard column names and [stream]'s words; a CAN log is read as
    the first one listed. Of several entries on one file the first counts.

    Raises:
        RecordingError: unreadable: no file, missing column, text in a number, no row selected, empty.
    """
    path = Path(path)
    resolved = path.resolve()
    listed = next((entry for entry in axis.recordings if entry.file == resolved), None)
    unlisted = RecordingEntry(file=path, sample_time=axis.stream.sample_time, hold=axis.stream.hold)
    if listed is None and is_can_log(path):
        described = next((entry for entry in axis.recordings if entry.dbc or entry.bridge), None)
        if described is not None:
            unlisted = dataclasses.replace(described, file=path, note="")
    return read_recording_entry(listed or unlisted, axis)


def read_recording_entry(entry: RecordingEntry, axis: Axis) -> Recording:
    """Read one [[recording]]: its file, columns, scale and selection; torque becomes force at the belt.

    Raises:
        RecordingError: as `read_recording`.
    """
    begin_ns: int | None = None
    remarks: tuple[str, ...] = ()
    if is_can_log(entry.file):
        from plant.log_files_can import read_can_log

        columns, begin_ns, remarks = read_can_log(entry, axis)
    else:
        columns = read_table(entry.file, _chooser(entry), entry.select)
        begin_ns = begin_of(entry.file)
    drive = "torque" if "torque" in columns else "force"
    for name in ("torque", "force"):
        if name in entry.scale and name != drive:
            raise RecordingError(f"{entry.file}: scale names {name}, but the recording gives {drive}; scale {drive}")
    si = {name: values * entry.scale.get(name, 1.0) for name, values in columns.items()}
    force = si[drive] * axis.mechanics.gain if drive == "torque" else si[drive]
    return Recording(
        t=si["t"],
        force=force,
        position=si["position"],
        velocity=si.get("velocity"),
        temperature=si.get("temperature"),
        load=si.get("load"),
        sample_time=entry.sample_time,
        hold=entry.hold,
        loop=entry.loop,
        note=entry.note,
        source=_source(entry),
        begin_ns=begin_ns,
        remarks=tuple(f"{entry.file.name}: {remark}" for remark in remarks),
    )


def is_can_log(path: Path) -> bool:
    """True for CAN logs, by their names."""
    return path.name.lower().endswith(CAN_LOGS)


def _source(entry: RecordingEntry) -> str:
    chosen = ", ".join(f"{name}={value}" for name, value in entry.select.items())
    return f"{entry.file} [{chosen}]" if chosen else str(entry.file)


def _chooser(entry: RecordingEntry) -> Callable[[Sequence[str]], Mapping[str, str]]:
    """Make the function that finds our channels among a file's columns."""

    def choose(there: Sequence[str]) -> dict[str, str]:
        drive = _drive_channel(entry, there)
        names = (*_REQUIRED[:1], drive, *_REQUIRED[1:], *_OPTIONAL)
        asked = {name: entry.columns.get(name, name) for name in names}
        for name, column in asked.items():
            if column not in there and (name in entry.columns or name not in _OPTIONAL):
                raise _missing(entry, name, column, there)
        return {name: column for name, column in asked.items() if column in there}

    return choose


def _drive_channel(entry: RecordingEntry, there: Sequence[str]) -> str:
    """Say whether the file gives torque or force: what the axis file maps, else what is there."""
    mapped = [name for name in ("torque", "force") if name in entry.columns]
    if mapped:
        return mapped[0]
    found = [name for name in ("torque", "force") if name in there]
    if len(found) == 2:
        raise RecordingError(
            f'{entry.file}: has both torque and force; choose one in [[recording]]: columns = {{ torque = "torque" }}'
        )
    if not found:
        raise _missing(entry, "torque", "torque' or 'force", there)
    return found[0]


def _missing(entry: RecordingEntry, name: str, column: str, there: Sequence[str]) -> RecordingError:
    listed = ", ".join(there[:20]) + (f" and {len(there) - 20} more" if len(there) > 20 else "")
    close = difflib.get_close_matches(column.split("'")[0], there, n=1, cutoff=0.5) or ["..."]
    return RecordingError(
        f"{entry.file}: no column '{column}'; the file has: {listed or 'none'}; "
        f'name it in the axis file, [[recording]] columns = {{ {name} = "{close[0]}" }}'
    )


def write_recording(recording: Recording, path: str | Path, axis: Axis) -> None:
    """Write `recording` with standard column names; as torque where the axis has a gain other than 1, else as force.

    Raises:
        RecordingError: unknown kind of file, or it cannot be written.
    """
    path = Path(path)
    gain = axis.mechanics.gain
    columns: dict[str, Floats] = {}
    for name in recording.channels():
        values = np.asarray(getattr(recording, name), dtype=np.float64)
        if name == "force" and gain != 1.0:
            columns["torque"] = values / gain
        else:
            columns[name] = values
    write_table(path, columns)
