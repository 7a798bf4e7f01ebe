"""From rows of the history to values and back; see `store.py`."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from monitor.alarms import Alarm, State
from monitor.estimate import Estimate, Parameter
from monitor.samples import Gap, Samples, StreamState, Window, WindowId
from monitor.store_records import AxisRecord

AXIS_COLUMNS = ("samples", "missing", "last_ns", "rejected", "stream")  # what the intake moves on
CHANNELS = ("drive", "position", "velocity", "temperature", "load")


def axis_record(row: Any) -> AxisRecord:
    """An axis as the pipeline takes it up."""
    stream = StreamState()
    if row["stream"]:
        stream = stream_of(row["stream"])
    return AxisRecord(
        row["id"],
        row["name"],
        row["listed"],
        stream,
        row["samples"],
        row["missing"],
        row["last_ns"],
        dict(row["rejected"]),
        row["drift"],
        dict(row["verdicts"]),
    )


def axis_row(axis: AxisRecord) -> dict[str, Any]:
    """An axis' columns that the intake moves on, as parameters of its update."""
    new = {f"new_{name}": getattr(axis, name) for name in AXIS_COLUMNS if name != "stream"}
    return {"row": axis.id, **new, "new_stream": dataclasses.asdict(axis.stream)}


def stream_of(stored: dict[str, Any]) -> StreamState:
    """Where a stream stood; what an older program stored knows of no epoch before."""
    pairs = {
        name: tuple((int(one), int(other)) for one, other in stored.get(name, ())) for name in ("starts", "former")
    }
    return StreamState(**{"floor": stored["epoch"], **stored, **pairs})


def gap_row(axis_id: int, gap: Gap) -> dict[str, Any]:
    """A gap as its row."""
    return {"axis_id": axis_id, "missing": gap.missing, **dataclasses.asdict(gap)}


def window_of(row: Any) -> Window:
    """A window from its row."""
    return Window(WindowId(row["epoch"], row["first_seq"], row["samples"]), row["start_ns"], row["end_ns"])


def alarm_of(machine: dict[str, Any]) -> Alarm:
    """An alarm's state machine, as it was left; what an older program kept besides is dropped."""
    known = {field.name for field in dataclasses.fields(Alarm)}
    return Alarm(**{name: one for name, one in machine.items() if name in known} | {"state": State(machine["state"])})


def estimate_row(
    axis: AxisRecord, window_row: int, estimate: Estimate, indicators: list[dict[str, Any]]
) -> dict[str, Any]:
    """An answer as its row."""
    direct = ("verdict", "reason", "criterion", "held_out_criterion", "method", "evaluations", "seed", "software")
    return {
        **{name: getattr(estimate, name) for name in (*direct, "data_sha256", "seconds", "result", "conditions")},
        "window_id": window_row,
        "axis_id": axis.id,
        "axis_version": axis.version,
        "start_ns": estimate.window.start_ns,
        "end_ns": estimate.window.end_ns,
        "curve": estimate.curve.to_dict() if estimate.curve else None,
        "drift": indicators,
    }


def as_parameters(indicators: list[dict[str, Any]]) -> tuple[Parameter, ...]:
    """What is watched is trended too: `friction_at_mid_speed` and so on."""
    return tuple(
        Parameter(one["name"].replace(" ", "_").lower(), one["value"], one["unit"], *(one["ci95"] or (None, None)))
        for one in indicators
    )


def block_row(axis_id: int, part: Samples) -> dict[str, Any]:
    """Samples as a row of the journal."""
    arrays = {name: getattr(part, name) for name in CHANNELS}
    return {
        "axis_id": axis_id,
        "epoch": part.epoch,
        "seq": part.seq,
        "n": len(part),
        "is_force": part.is_force,
        "t_ns": part.t_ns.astype("<i8").tobytes(),
        **{name: None if values is None else values.astype("<f8").tobytes() for name, values in arrays.items()},
    }


def samples_of(row: Any) -> Samples:
    """Samples from a row of the journal."""
    arrays = {name: np.frombuffer(row[name], "<f8") for name in CHANNELS if row[name] is not None}
    return Samples(row["epoch"], row["seq"], np.frombuffer(row["t_ns"], "<i8"), is_force=row["is_force"], **arrays)


def join(parts: list[Samples]) -> Samples | None:
    """Concatenate; a channel that not every part has is left out."""
    if not parts:
        return None
    joined: dict[str, Any] = {"t_ns": np.concatenate([part.t_ns for part in parts])}
    for name in CHANNELS:
        arrays = [getattr(part, name) for part in parts]
        if all(values is not None for values in arrays):
            joined[name] = np.concatenate(arrays)
    return dataclasses.replace(parts[0], **{**dict.fromkeys(("velocity", "temperature", "load")), **joined})
