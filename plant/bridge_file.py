"""The bridge file: TOML that says which bus, which drives, what their frames mean and where the samples go."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

from plant import cia402
from plant.axis import Axis
from plant.axis_file import read_axis
from plant.bridge_settings import SECTIONS, AxisTable, BridgeSettings
from plant.can_layout import AxisLayout, show_id
from plant.checks import as_table, check_keys, is_number
from plant.errors import InputError, ParameterError
from plant.keys import check_id
from plant.tables import build
from plant.toml_files import read_toml
from plant.wire_rules import CHANNELS

TOP = ("name", "site", "axis", *SECTIONS)
LAST_ID = 0x7FF  # of 11 bits, as all PDOs are
SAME = 0.01  # two rated torques that differ by less are the same


def read_bridge(path: str | Path) -> BridgeSettings:
    """Read a bridge file, and the axis and DBC files it names.

    Raises:
        InputError: no such file, not TOML, unknown key (with the nearest allowed one), wrong type, value out of range,
            a signal or object that cannot be, an id or axis used twice: one line with file, table and key.
    """
    path = Path(path)
    content = read_toml(path, "bridge file")
    check_keys(content, TOP, str(path))
    for key in ("name", "site"):
        if not isinstance(content.get(key), str):
            raise InputError(f'{path}: {key} is missing or no text; write {key} = "{key}-1"')
    try:
        name, site = check_id("name", content["name"]), check_id("site", content["site"])
    except ParameterError as error:
        raise InputError(f"{path}: {error}") from None
    can = dict(content.get("can", {})) if isinstance(content.get("can", {}), Mapping) else content["can"]
    options = can.pop("options", {}) if isinstance(can, dict) else {}
    if not isinstance(options, Mapping):
        raise InputError(f"{path} [can]: options is {options!r}, but must be a table like {{ port = 43113 }}")
    tables = {
        key: build(kind, can if key == "can" else content.get(key, {}), f"{path} [{key}]")
        for key, kind in SECTIONS.items()
    }
    entries = content.get("axis", [])
    if not isinstance(entries, list) or not entries:
        raise InputError(f"{path}: no drive is listed; write [[axis]] with two brackets for each")
    found = [_axis(entry, path, number) for number, entry in enumerate(entries, start=1)]
    layouts = tuple(layout for layout, _ in found)
    _check_once(path, layouts, tables["time"].sync_id)
    remarks = tuple(remark for _, remark in found if remark)
    return BridgeSettings(
        name, site, options=MappingProxyType(dict(options)), layouts=layouts, remarks=remarks, **tables
    )


def is_bridge_file(path: Path) -> bool:
    """True when the TOML at `path` is a bridge file: only those have a [can] table, or axes with nodes or a DBC."""
    try:
        content = read_toml(path, "bridge file")
    except InputError:
        return False
    axes = content.get("axis")
    entries = axes if isinstance(axes, list) else []
    return "can" in content or any(isinstance(one, dict) and {"node", "dbc", "pdo"} & one.keys() for one in entries)


def _axis(entry: object, path: Path, number: int) -> tuple[AxisLayout, str]:
    """The layout of one [[axis]], and what looks odd about it."""
    where = f"{path} [[axis]] {number}"
    given = as_table(entry, where)
    nested: dict[str, Any] = {key: given.pop(key) for key in ("pdo", "signals", "scale") if key in given}
    table = build(AxisTable, given, where)
    axis = read_axis(path.parent / table.file) if table.file else None
    if axis is not None and table.name and table.name != axis.name:
        raise InputError(f"{where}: name is {table.name!r}, but {table.file} describes {axis.name!r}; keep one")
    if axis is None and not table.name:
        raise InputError(f'{where}: name is missing; write name = "axis-0001", or file = "axis.toml"')
    try:
        name = axis.name if axis is not None else check_id("axis", table.name)
        if table.dbc:
            return _by_dbc(table, nested, name, axis, path, where)
        return _by_node(table, nested, name, axis, where), ""
    except ParameterError as error:
        raise InputError(f"{where}: {error}") from None


def _by_node(table: AxisTable, nested: Mapping[str, Any], name: str, axis: Axis | None, where: str) -> AxisLayout:
    for key in ("signals", "scale"):
        if key in nested:
            raise InputError(f'{where}: {key} goes with a DBC file; add dbc = "plant.dbc", or pdo for a CiA 402 drive')
    scaling = cia402.Scaling(
        table.counts_per_unit,
        _rated_torque(table, axis, where),
        table.gear,
        table.sign,
        table.torque_sign,
        table.velocity_per_unit,
        table.temperature_scale,
    )
    try:
        return cia402.layout(name, table.node, _pdos(nested.get("pdo")), scaling)
    except ParameterError:
        raise
    except InputError as error:
        raise InputError(f"{where}: {error}") from None


def _pdos(listed: object) -> list[tuple[int, tuple[str, ...]]]:
    """The PDOs of a drive; without any, the one that most drives send."""
    if listed is None:
        return [(0, cia402.DEFAULT_TPDO1)]
    shape = 'pdo must be a list like [{ id = 0x181, objects = ["6041:16", "6064:32", "6077:16"] }]'
    if not isinstance(listed, list) or not listed:
        raise InputError(shape)
    found = []
    for pdo in listed:
        if not isinstance(pdo, Mapping) or not isinstance(pdo.get("objects"), list):
            raise InputError(shape)
        check_keys(pdo, ("id", "objects"), "pdo")
        if not all(isinstance(one, str) for one in pdo["objects"]) or type(pdo.get("id", 0)) is not int:
            raise InputError(shape)
        if not 0 <= pdo.get("id", 0) <= LAST_ID:
            raise InputError(f"pdo id is {pdo['id']:#x}, but must be 0x1 ... {LAST_ID:#x}, or left out")
        found.append((pdo.get("id", 0), tuple(pdo["objects"])))
    return found


def _rated_torque(table: AxisTable, axis: Axis | None, where: str) -> float:
    """What 6077h counts in per mille of; the axis file's word and the bridge file's must agree."""
    known = None
    if axis is not None and axis.drive.rated_force is not None:
        known = axis.drive.rated_force / abs(axis.mechanics.gain)
    if not table.rated_torque:
        if known is None:
            raise InputError(
                f"{where}: rated_torque is missing: 6077h counts in per mille of it (6076h of the drive) [N*m]"
            )
        return known
    if known is not None and abs(table.rated_torque - known) > SAME * known:
        raise InputError(
            f"{where}: rated_torque is {table.rated_torque:g} N*m, but {table.file} says {known:.4g} N*m; "
            "6076h of the drive tells which is right"
        )
    return table.rated_torque


def _by_dbc(
    table: AxisTable, nested: Mapping[str, Any], name: str, axis: Axis | None, path: Path, where: str
) -> tuple[AxisLayout, str]:
    from plant.dbc_cantools import dbc_layout

    signals, scale = nested.get("signals", {}), nested.get("scale", {})
    if "pdo" in nested or table.counts_per_unit:
        raise InputError(f"{where}: pdo and counts_per_unit go without a DBC file; the DBC says both")
    if not isinstance(signals, Mapping) or not all(isinstance(one, str) for one in signals.values()):
        raise InputError(f'{where}: signals must be a table like {{ torque = "AX1_TPDO1.TorqueActual" }}')
    if not isinstance(scale, Mapping) or not all(is_number(one) and one != 0 for one in scale.values()):
        raise InputError(f"{where}: scale must be a table of numbers other than 0, like {{ position = 0.001 }}")
    for given in (signals, scale):
        check_keys(given, (*CHANNELS, "statusword", "error_code"), where)
    layout = dbc_layout(path.parent / table.dbc, name, signals, scale, node=table.node or None, strict=table.strict)
    return layout, _per_mille_remark(layout, axis)


def _per_mille_remark(layout: AxisLayout, axis: Axis | None) -> str:
    """A DBC's torque in per mille of rated torque should count in per mille of *this* drive's."""
    if axis is None or axis.drive.rated_force is None:
        return ""
    rated = axis.drive.rated_force / abs(axis.mechanics.gain)
    for frame in layout.frames:
        for signal in frame.signals:
            count = abs(signal.scale) * 1000.0
            if signal.channel == "torque" and signal.length == 16 and not 0.05 * rated < 32.767 * count < 100 * rated:
                return (
                    f"{layout.axis}: {signal.name} reaches {32.767 * count:.3g} N*m at most, rated torque is "
                    f"{rated:.3g} N*m: is the DBC's factor right?"
                )
    return ""


def _check_once(path: Path, layouts: tuple[AxisLayout, ...], sync_id: int) -> None:
    """Refuse two axes of one name, and two drives on one id."""
    names = [layout.axis for layout in layouts]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise InputError(f"{path}: axis {twice!r} is listed twice")
    owners: dict[int, str] = {sync_id: "SYNC", cia402.TIME: "TIME"}
    for layout in layouts:
        signals: dict[int, str] = {frame.key: layout.axis for frame in layout.frames}
        if layout.node is not None:
            signals |= {base + layout.node: f"{layout.axis} (node {layout.node})" for base in (0x080, 0x700)}
        for key, owner in signals.items():
            # a frame may carry several axes where a DBC says so; a node's own ids may not
            if key in owners and (layout.node is not None or owners[key] in ("SYNC", "TIME")):
                raise InputError(f"{path}: {show_id(key)} belongs to {owners[key]} and to {owner}; give one another id")
            owners[key] = owner
