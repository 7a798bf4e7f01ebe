"""Another model for an axis: an effect that a diagnosis named becomes part of it, or is taken out again. Pure."""

from __future__ import annotations

from typing import Any

from monitor.axis_run import AxisRun
from monitor.axis_versions import constants_of
from monitor.errors import QueryError
from monitor.store_records import VersionRecord
from plant.checks import nearest
from plant.effects import names


def with_effect(run: AxisRun, effect: str, now_ns: int, author: str) -> VersionRecord:
    """The version of the model that has `effect`, from event time `now_ns` [ns] on.

    Raises:
        QueryError: the axis is not listed, nobody knows the effect, or the model has it.
    """
    if run.axis is None:
        raise QueryError(f"axis {run.record.name!r} is not listed in the configuration: it has no model")
    if effect not in names():
        raise QueryError(f"effect {effect!r} is not known; {nearest(effect, names())}")
    if effect in run.record.effects:
        raise QueryError(f"{effect} is part of the model of {run.record.name} already")
    effects = run.record.effects | {effect: _found(run, effect)}
    return _version(run, effects, now_ns, author, f"promoted {effect}")


def without_effect(run: AxisRun, effect: str, now_ns: int, author: str) -> VersionRecord:
    """The version of the model that lacks `effect`, from event time `now_ns` [ns] on.

    Raises:
        QueryError: the model does not have it.
    """
    if effect not in run.record.effects:
        has = ", ".join(sorted(run.record.effects)) or "no effect"
        raise QueryError(f"{effect!r} is not part of the model of {run.record.name}: it has {has}")
    effects = {name: values for name, values in run.record.effects.items() if name != effect}
    return _version(run, effects, now_ns, author, f"demoted {effect}")


def _found(run: AxisRun, effect: str) -> dict[str, float]:
    """Values of the latest diagnosis, from which every later search starts; empty where it did not name the effect."""
    if run.mismatch.latest is None:
        return {}
    for one in run.mismatch.latest.result.get("effects", []):
        if one["name"] == effect:
            return {name: quantity["value"] for name, quantity in one["parameters"].items()}
    return {}


def _version(run: AxisRun, effects: dict[str, Any], now_ns: int, author: str, why: str) -> VersionRecord:
    assert run.axis is not None
    return VersionRecord(run.record.version + 1, now_ns, constants_of(run.axis), effects, author, why)
