"""Constants of an axis as they are kept with its history, and what changed from one version to the next. Pure."""

from __future__ import annotations

import dataclasses
import enum
from typing import Any

from plant.axis import Axis, Drive, Mechanics, Orientation, Sensor, Stream, TorqueHold

UNITS = {
    "mechanics.M": "kg",
    "mechanics.J": "kg*m^2",
    "mechanics.Rc": "m",
    "mechanics.Re": "m",
    "mechanics.Rm": "m",
    "mechanics.force_per_torque": "N per N*m",
    "mechanics.g": "m/s^2",
    "stream.sample_time": "s",
    "analysis_sample_time": "s",
}


def constants_of(axis: Axis) -> dict[str, Any]:
    """What identification takes from the axis file, as JSON: groups of SI values."""
    groups = {name: dataclasses.asdict(getattr(axis, name)) for name in ("mechanics", "drive", "sensor", "stream")}
    plain: dict[str, Any] = _plain({**groups, "analysis_sample_time": axis.analysis_sample_time})
    return plain


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(one) for key, one in value.items()}
    if isinstance(value, enum.Enum):
        return value.value
    return list(value) if isinstance(value, tuple) else value


def axis_of(name: str, constants: dict[str, Any]) -> Axis:
    """The axis that `constants_of` was asked about, without its recordings."""
    mechanics = dict(constants["mechanics"])
    mechanics["orientation"] = Orientation(mechanics["orientation"])
    mechanics["travel"] = None if mechanics["travel"] is None else tuple(mechanics["travel"])
    stream = {**constants["stream"], "hold": TorqueHold(constants["stream"]["hold"])}
    return Axis(
        name,
        Mechanics(**mechanics),
        Drive(**constants["drive"]),
        Sensor(**constants["sensor"]),
        Stream(**stream),
        constants["analysis_sample_time"],
    )


def differences(old: dict[str, Any], new: dict[str, Any]) -> list[str]:
    """What changed, in words: `mechanics.M 20 -> 25 kg`. What `old` does not know (an older program) is no change."""
    before, after = _flat(old), _flat(new)
    return [
        f"{name} {_show(before[name])} -> {_show(value)} {UNITS.get(name, '')}".rstrip()
        for name, value in after.items()
        if name in before and before[name] != value
    ]


def _flat(groups: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    found: dict[str, Any] = {}
    for name, value in groups.items():
        found |= _flat(value, f"{name}.") if isinstance(value, dict) else {prefix + name: value}
    return found


def _show(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else "none" if value is None else str(value)
