"""The axis file `axis.toml`: read it, checked to the last key, and write it with a comment beside every value."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from plant.axis import Axis, Drive, Mechanics, Orientation, RecordingEntry, Sensor, Stream, TorqueHold
from plant.axis_schema import TOP, check_table
from plant.checks import check_keys
from plant.errors import AxisFileError, ParameterError
from plant.toml_files import read_toml

_WORDS = {
    TorqueHold.HOLD: "held over the sample",
    TorqueHold.LINEAR: "linear between samples",
    TorqueHold.MEAN: "mean of the sample",
    TorqueHold.UNKNOWN: "unknown",
}


def read_axis(path: str | Path) -> Axis:
    """Read an axis file; torques of [drive] become forces at the belt, recordings' paths become absolute.

    Args:
        path: the TOML file, as in docs/axis-file.md.

    Returns:
        The axis, all values in SI.

    Raises:
        AxisFileError: no such file, not TOML, unknown key (with the nearest allowed one), wrong type, missing name
            or mechanics, value out of range: one line with file, table, key, value and unit.
    """
    path = Path(path)
    content = read_toml(path, "axis file", AxisFileError, "no such axis file; 'tribowatch axes init' writes one")
    check_keys(content, TOP, str(path), AxisFileError)
    name = content.get("name")
    if not isinstance(name, str):
        raise AxisFileError(f'{path}: name is {"missing" if name is None else repr(name)}; write name = "axis-0001"')
    if "mechanics" not in content:
        raise AxisFileError(f"{path}: table [mechanics] is missing; give at least M [kg] or J [kg*m^2]")
    tables = {
        key: check_table(content.get(key, {}), key, f"{path} [{key}]")
        for key in ("mechanics", "drive", "sensor", "stream", "analysis")
    }
    entries = content.get("recording", [])
    if not isinstance(entries, list):
        raise AxisFileError(f"{path}: recording must be written [[recording]], with two brackets")
    try:
        mechanics = _mechanics(tables["mechanics"])
        return Axis(
            name=name,
            mechanics=mechanics,
            drive=_drive(tables["drive"], abs(mechanics.gain), str(path)),
            sensor=Sensor(
                float(tables["sensor"].get("position_resolution", 0.0)), tables["sensor"].get("side", "load")
            ),
            stream=Stream(_optional(tables["stream"], "sample_time"), _hold(tables["stream"])),
            analysis_sample_time=_optional(tables["analysis"], "sample_time"),
            recordings=tuple(_entry(entry, path, number) for number, entry in enumerate(entries, start=1)),
        )
    except ParameterError as error:
        raise AxisFileError(f"{path} [mechanics]: {error}") from None
    except AxisFileError as error:
        raise error if str(error).startswith(str(path)) else AxisFileError(f"{path}: {error}") from None


def _optional(table: Mapping[str, Any], key: str) -> float | None:
    return float(table[key]) if key in table else None


def _hold(table: Mapping[str, Any]) -> TorqueHold:
    return TorqueHold.from_words(table.get("torque", _WORDS[TorqueHold.HOLD]))


def _mechanics(table: Mapping[str, Any]) -> Mechanics:
    numbers = {key: float(table[key]) for key in ("M", "J", "Rc", "Re", "Rm", "force_per_torque", "g") if key in table}
    travel = tuple(map(float, table["travel"])) if "travel" in table else None
    return Mechanics(
        orientation=Orientation(table.get("axis", "vertical")),
        travel=travel,  # type: ignore[arg-type]  # two numbers, checked by the schema
        inertia_known=table.get("inertia_known", True),
        **numbers,
    )


def _drive(table: Mapping[str, Any], gain: float, path: str) -> Drive:
    values: dict[str, float | None] = {}
    for force, torque in (("rated_force", "rated_torque"), ("force_resolution", "torque_resolution")):
        if force in table and torque in table:
            raise AxisFileError(f"{path} [drive]: give {force} or {torque}, not both")
        in_torque = _optional(table, torque)
        values[force] = in_torque * gain if in_torque is not None else _optional(table, force)
    return Drive(values["rated_force"], values["force_resolution"] or 0.0)


def _entry(entry: object, path: Path, number: int) -> RecordingEntry:
    where = f"{path} [[recording]] {number}"
    table = check_table(entry, "recording", where)
    if "file" not in table:
        raise AxisFileError(f'{where}: file is missing; write file = "recording.csv"')
    columns = dict(table.get("columns", {}))
    if "torque" in columns and "force" in columns:
        raise AxisFileError(f"{where}: columns names both torque and force; keep the one to use")
    if "dbc" in table and "bridge" in table:
        raise AxisFileError(f"{where}: names both dbc and bridge; keep the one that says what the frames mean")
    return RecordingEntry(
        file=(path.parent / table["file"]).resolve(),
        dbc=(path.parent / table["dbc"]).resolve() if "dbc" in table else None,
        bridge=(path.parent / table["bridge"]).resolve() if "bridge" in table else None,
        columns=columns,
        scale={key: float(value) for key, value in table.get("scale", {}).items()},
        select=dict(table.get("select", {})),
        sample_time=_optional(table, "sample_time"),
        loop=table.get("loop", "open"),
        hold=_hold(table),
        note=table.get("note", ""),
    )


def write_axis(axis: Axis, path: str | Path) -> None:
    """Write `axis` as a commented axis file that `read_axis` reads back equal.

    Raises:
        AxisFileError: the file cannot be written.
    """
    path = Path(path)
    try:
        path.write_text(axis_text(axis, path.parent.resolve()), encoding="utf-8")
    except OSError as error:
        raise AxisFileError(f"{path}: cannot write the axis file: {error.strerror}") from None


def axis_text(axis: Axis, folder: Path) -> str:
    """Compose the file's text; recordings are named relative to `folder`."""
    unit, force = axis.position_unit, axis.force_unit
    m = axis.mechanics
    lines = [f"name = {_toml(axis.name)}", "", "[mechanics]"]
    lines += _lines(
        ("axis", str(m.orientation), "vertical | horizontal | rotary; position counts upwards"),
        ("M", m.M, "kg, mass in translation"),
        ("J", m.J, "kg m^2, total inertia on the driving pulley's axis"),
        ("Rc", m.Rc, "m, driving pulley"),
        ("Re", m.Re, "m, second pulley"),
        ("Rm", m.Rm, "m, motor pulley"),
        ("force_per_torque", m.force_per_torque, "N per N m; takes precedence over 1/Rm"),
        ("g", m.g, "m/s^2"),
        ("travel", None if m.travel is None else list(m.travel), f"{unit}, lowest and highest position"),
        ("inertia_known", m.inertia_known, "false: a rough start, the inertia is estimated too"),
    )
    lines += ["", "[drive]"]
    lines += _lines(
        ("rated_force", axis.drive.rated_force, f"{force}, at the belt"),
        ("force_resolution", axis.drive.force_resolution, f"{force}, smallest step reported"),
    )
    lines += ["", "[sensor]"]
    lines += _lines(
        ("position_resolution", axis.sensor.position_resolution, f"{unit}, smallest step"),
        ("side", axis.sensor.side, "load | motor: where the position is measured"),
    )
    lines += ["", "[stream]"]
    lines += _lines(
        ("sample_time", axis.stream.sample_time, "s"),
        ("torque", _WORDS[axis.stream.hold], "held over the sample | linear between samples | mean of the sample"),
    )
    if axis.analysis_sample_time is not None:
        lines += ["", "[analysis]", *_lines(("sample_time", axis.analysis_sample_time, "s, faster data are averaged"))]
    for entry in axis.recordings:
        lines += ["", "[[recording]]", *_entry_lines(entry, folder)]
    return "\n".join(lines) + "\n"


def _entry_lines(entry: RecordingEntry, folder: Path) -> list[str]:
    return _lines(
        ("file", os.path.relpath(entry.file, folder), "relative to this file"),
        ("dbc", None if entry.dbc is None else os.path.relpath(entry.dbc, folder), "what the frames of a log mean"),
        ("bridge", None if entry.bridge is None else os.path.relpath(entry.bridge, folder), "what the frames mean"),
        ("columns", dict(entry.columns) or None, "our name = the file's column"),
        ("scale", dict(entry.scale) or None, "file unit -> SI"),
        ("select", dict(entry.select) or None, "rows of a file that holds many runs"),
        ("sample_time", entry.sample_time, "s, nominal; the column t is the clock"),
        ("loop", entry.loop, "open | closed"),
        ("torque", _WORDS[entry.hold], "what a torque sample means until the next"),
        ("note", entry.note or None, "commissioning and today mark a before/after pair"),
    )


def _lines(*items: tuple[str, object, str]) -> list[str]:
    return [f"{key} = {_toml(value)}  # {comment}" for key, value, comment in items if value is not None]


def _toml(value: object) -> str:
    """Write a value as TOML; JSON strings are TOML basic strings (but for DEL, which TOML wants escaped)."""
    match value:
        case bool():
            return "true" if value else "false"
        case str():
            return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
        case dict():
            return "{ " + ", ".join(f"{_bare(key)} = {_toml(item)}" for key, item in value.items()) + " }"
        case list():
            return "[" + ", ".join(map(_toml, value)) + "]"
        case int():
            return repr(int(value))
        case float():
            return repr(float(value))  # numpy's floats spell themselves otherwise
        case _:
            raise AxisFileError(f"cannot write {value!r} as TOML")


def _bare(key: str) -> str:
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else _toml(key)
