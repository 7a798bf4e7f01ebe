"""The scenario file: TOML that says what axis, what moves it, what it sends and how it ages; every key is checked.

Scenarios that come with the package are called by name: see `names()`.
"""

from __future__ import annotations

import dataclasses
import datetime as dt
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import Any

from plant import ageing_climate, ageing_damage, ageing_lubricant
from plant.ageing import Ageing, Stage
from plant.axis import Axis, Drive, Sensor, Stream
from plant.axis_file import read_axis
from plant.checks import as_table, as_tables, check_keys, is_number
from plant.effects import EffectValues
from plant.effects import find as find_effect
from plant.effects import names as effect_names
from plant.errors import AxisFileError, InputError, ParameterError
from plant.excitation import FORMS, Excitation, holding_torque
from plant.friction import StribeckFriction
from plant.motion import Cascade, ClosedLoop
from plant.presets import READINGS, paper_axis, paper_friction
from plant.profiles import REFERENCES
from plant.scenario import SAMPLE_TIME, Bursts, Fault, Scenario
from plant.sensors import PER_MILLE, Sensors
from plant.tables import build, pick
from plant.toml_files import parse_toml, read_toml

TOP = (
    "name",
    "description",
    "seed",
    "axis",
    "friction",
    "effects",
    "excitation",
    "motion",
    "sensors",
    "fault",
    "ageing",
    "bursts",
)
FOLDER = resources.files("plant") / "scenarios"
CAUSES: dict[str, type[Stage]] = {
    cause.kind: cause
    for cause in (
        ageing_lubricant.Relubrication,
        ageing_lubricant.LubricantChange,
        ageing_lubricant.LubricantLoss,
        ageing_climate.Ambient,
        ageing_climate.WarmUp,
        ageing_climate.Viscosity,
        ageing_climate.Load,
        ageing_damage.Wear,
        ageing_damage.GrowingRailDefect,
        ageing_damage.Jam,
        ageing_damage.Scatter,
    )
}


def names() -> list[str]:
    """Name the scenarios that come with the package."""
    return sorted(file.name.removesuffix(".toml") for file in FOLDER.iterdir() if file.name.endswith(".toml"))


def read_scenario(path_or_name: str | Path) -> Scenario:
    """Read a scenario file, or one that comes with the package by its name.

    Raises:
        InputError: no such file or name, not TOML, unknown key (with the nearest allowed one), missing key, wrong type,
            value out of range: one line with file, table, key, value and unit.
    """
    path = Path(path_or_name)
    known = names()
    if str(path_or_name) in known:
        text = (FOLDER / f"{path_or_name}.toml").read_text(encoding="utf-8")
        return parse_scenario(text, str(path_or_name), Path())
    missing = f"no such scenario file; those that come with tribowatch: {', '.join(known)}"
    return _composed(read_toml(path, "scenario file", missing=missing), str(path), path.parent)


def parse_scenario(text: str, where: str, folder: Path) -> Scenario:
    """Compose a scenario from TOML `text`; `where` stands in messages, files are named relative to `folder`.

    Raises:
        InputError: as `read_scenario`.
    """
    return _composed(parse_toml(text, where), where, folder)


def _composed(content: Mapping[str, Any], where: str, folder: Path) -> Scenario:
    """The scenario of a file's `content`."""
    check_keys(content, TOP, where)
    for table in ("axis", "bursts"):
        if table not in content:
            raise InputError(f"{where}: table [{table}] is missing")
    if ("excitation" in content) == ("motion" in content):
        raise InputError(f"{where}: give a table [excitation] (open loop) or [motion] (closed loop), one of them")
    sensors = build(Sensors, content.get("sensors", {}), f"{where} [sensors]")
    axis, new = _axis(content["axis"], f"{where} [axis]", folder)
    ageing = _ageing(content.get("ageing", []), where)
    drive: Excitation | ClosedLoop
    if "motion" in content:
        drive = _motion(content["motion"], f"{where} [motion]")
        axis = _recorded_by(drive, axis, f"{where} [motion]")
    else:
        drive = _excitation(content["excitation"], axis, f"{where} [excitation]")
    return Scenario(
        name=_text(content, "name", where, Path(where).stem),
        axis=_resolving(axis, sensors),
        friction=_friction(content.get("friction", {}), new, f"{where} [friction]"),
        drive=drive,
        bursts=_bursts(content["bursts"], f"{where} [bursts]"),
        sensors=sensors,
        ageing=ageing,
        faults=_faults(content.get("fault", []), where),
        effects=_effects(content.get("effects", {}), axis, ageing, f"{where} [effects]"),
        seed=_seed(content, where),
        description=_text(content, "description", where, ""),
    )


def _text(content: Mapping[str, Any], key: str, where: str, default: str) -> str:
    value = content.get(key, default)
    if not isinstance(value, str):
        raise InputError(f"{where}: {key} is {value!r}, but must be a text in quotes")
    return value


def _seed(content: Mapping[str, Any], where: str) -> int:
    seed = content.get("seed", 0)
    if not isinstance(seed, int) or isinstance(seed, bool) or seed < 0:
        raise InputError(f"{where}: seed is {seed!r}, but must be an integer >= 0")
    return seed


def _axis(value: object, where: str, folder: Path) -> tuple[Axis, StribeckFriction | None]:
    """Axis and, for a preset, its friction."""
    table = as_table(value, where)
    check_keys(table, ("preset", "file", "name", "sample_time"), where)
    if ("preset" in table) == ("file" in table):
        raise InputError(
            f'{where}: give preset = "{READINGS[0]}" (or "{READINGS[1]}"), or file = "axis.toml", one of them'
        )
    new: StribeckFriction | None = None
    if "preset" in table:
        reading = pick({reading: reading for reading in READINGS}, table["preset"], f"{where} preset")
        axis, new = paper_axis(reading), paper_friction(reading)
    else:
        axis = read_axis(folder / _text(table, "file", where, ""))
    try:
        axis = dataclasses.replace(axis, name=_text(table, "name", where, axis.name))
    except AxisFileError as error:
        raise InputError(f"{where}: {error}") from None
    if "sample_time" in table:
        if not (is_number(table["sample_time"]) and table["sample_time"] > 0):
            raise InputError(f"{where}: sample_time is {table['sample_time']!r} s, but must be a number > 0 s")
        axis = dataclasses.replace(
            axis, stream=dataclasses.replace(axis.stream, sample_time=float(table["sample_time"]))
        )
    return axis, new


def _resolving(axis: Axis, sensors: Sensors) -> Axis:
    """`axis` with the resolutions of `sensors`, where its file does not give them."""
    rated = axis.drive.rated_force
    step = sensors.torque_resolution * abs(axis.mechanics.gain)
    step = max(step, sensors.torque_per_mille * PER_MILLE * (rated or 0.0))
    return dataclasses.replace(
        axis,
        drive=Drive(rated, axis.drive.force_resolution or step),
        sensor=Sensor(axis.sensor.position_resolution or sensors.position_resolution, axis.sensor.side),
    )


def _friction(value: object, new: StribeckFriction | None, where: str) -> StribeckFriction:
    preset = {} if new is None else dataclasses.asdict(new)
    return build(StribeckFriction, {**preset, **as_table(value, where)}, where)


def _excitation(value: object, axis: Axis, where: str) -> Excitation:
    """The torque; on a vertical axis it swings about the one that holds the weight unless the file gives an offset."""
    table = as_table(value, where)
    form = pick(FORMS, table.pop("form", None), f"{where} form")
    return build(form, {"offset": holding_torque(axis.mechanics), **table}, where)


def _motion(value: object, where: str) -> ClosedLoop:
    """Reference, its controller in the sub-table `cascade`, and what is recorded of the torque."""
    table = as_table(value, where)
    form = pick(REFERENCES, table.pop("form", None), f"{where} form")
    torque = pick({"sample": "sample", "mean": "mean"}, table.pop("torque", "sample"), f"{where} torque")
    cascade = build(Cascade, table.pop("cascade", {}), f"{where[:-1]}.cascade]")
    return ClosedLoop(build(form, table, where), cascade, torque)  # type: ignore[arg-type]  # one of the two words


def _recorded_by(loop: ClosedLoop, axis: Axis, where: str) -> Axis:
    """`axis` with a stream that says what a torque sample of `loop` means."""
    period = axis.stream.sample_time or SAMPLE_TIME
    try:
        return dataclasses.replace(axis, stream=Stream(period, loop.hold(period)))
    except ParameterError as error:
        raise InputError(f"{where}: {error}") from None


def _effects(tables: object, axis: Axis, ageing: Ageing, where: str) -> EffectValues:
    """Effects that are there from the start; one that grows with age cannot be there as well."""
    if not isinstance(tables, Mapping):
        raise InputError(f"{where}: must be tables like [effects.rail_defect], is {tables!r}")
    growing = [stage.kind for stage in ageing.stages if stage.kind in effect_names()]
    effects: dict[str, dict[str, float]] = {}
    for name, table in tables.items():
        pick({known: known for known in effect_names()}, name, where)
        if not isinstance(table, Mapping) or not all(map(is_number, table.values())):
            raise InputError(f"{where[:-1]}.{name}]: must be a table of numbers, is {table!r}")
        effects[name] = {key: float(value) for key, value in table.items()}
        try:
            find_effect(name).values(effects[name], axis.mechanics)
        except InputError as error:
            raise InputError(f"{where}: {error}") from None
    for name in growing:
        if name in effects or growing.count(name) > 1:
            raise InputError(f"{where}: {name} can be there only once, by [effects] or by one [[ageing]]")
    return effects


def _bursts(value: object, where: str) -> Bursts:
    table = as_table(value, where)
    start = table.pop("start", None)
    if not isinstance(start, dt.datetime) or start.tzinfo is None:
        raise InputError(f"{where}: start is {start!r}, but must be a time with zone, like 2026-01-05T06:00:00Z")
    return build(Bursts, table, where, start=start)


def _faults(tables: object, where: str) -> tuple[Fault, ...]:
    """Days and the keys of [sensors] that hold then; reported channels do not change."""
    sensors = (f.name for f in dataclasses.fields(Sensors) if f.type == "float")
    allowed = ("from_day", "to_day", *sensors, "dropout_length")
    faults = []
    for place, table in as_tables(tables, "fault", where):
        days = {key: table.pop(key) for key in ("from_day", "to_day") if key in table}
        check_keys(table, allowed, place)
        faults.append(build(Fault, days, place, sensors=build(Sensors, table, place)))
    return tuple(faults)


def _ageing(tables: object, where: str) -> Ageing:
    stages = []
    for place, table in as_tables(tables, "ageing", where):
        cause = pick(CAUSES, table.pop("kind", None), f"{place} kind")
        stages.append(build(cause, table, place))
    return Ageing(tuple(stages))
