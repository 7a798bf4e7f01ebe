"""What the daemon says on its keys, as plain values for JSON. Pure."""

from __future__ import annotations

from typing import Any

from monitor.axis_run import AxisRun
from monitor.config import Config
from monitor.estimate import Estimate
from monitor.store_records import DiagnosisRecord
from monitor.times import iso
from plant.axis import Axis

SCHEMA_VERSION = 1


def estimate_payload(site: str, axis: str, estimate: Estimate, indicators: list[dict[str, Any]]) -> dict[str, Any]:
    """`.../parameters`: what `tribowatch identify` prints, which window it is, where it stands against the baseline."""
    window = estimate.window
    return {
        **estimate.result,
        "schema_version": SCHEMA_VERSION,
        "site": site,
        "axis": axis,
        "window": {
            **estimate.result.get("window", {}),
            "epoch": window.id.epoch,
            "first_seq": window.id.first_seq,
            "raw_samples": window.id.samples,
            "start_time": iso(window.start_ns),
            "end_time": iso(window.end_ns),
            "start_ns": window.start_ns,
            "end_ns": window.end_ns,
        },
        "seconds": estimate.seconds,
        "software": estimate.software,
        "data_sha256": estimate.data_sha256,
        "conditions": estimate.conditions,
        "indicators": indicators,
    }


def model_payload(site: str, axis: str, estimate: Estimate, known: Axis | None) -> dict[str, Any]:
    """`.../model`: the latest friction law, for feed-forward users."""
    values = {one.name: {"value": one.value, "unit": one.unit} for one in estimate.parameters}
    effects = sorted({name.split(".")[0] for name in values if "." in name})
    return {
        "schema_version": SCHEMA_VERSION,
        "site": site,
        "axis": axis,
        "law": "stribeck",
        "equation": "F(v) = (F_c + (F_s - F_c) exp(-|v|/v_s)) sign(v) + F_v v + F_0",
        "effects": effects,
        "parameters": values,
        "curve": estimate.curve.to_dict() if estimate.curve else None,
        "units": {
            "force": known.force_unit if known else "N",
            "speed": f"{known.position_unit if known else 'm'}/s",
        },
        "valid_from": iso(estimate.window.end_ns),
        "valid_from_ns": estimate.window.end_ns,
    }


def mismatch_payload(
    site: str, axis: str, number: int, diagnosis: DiagnosisRecord, words: dict[str, Any]
) -> dict[str, Any]:
    """`.../mismatch`: a diagnosis, as `tribowatch diagnose` prints it, with what it was made of and what it offers."""
    told = {name: value for name, value in diagnosis.result.items() if name != "pictures"}
    return {
        **told,
        "schema_version": SCHEMA_VERSION,
        "site": site,
        "axis": axis,
        "number": number,
        "at": iso(diagnosis.at_ns),
        "at_ns": diagnosis.at_ns,
        "finding": words["finding"],
        "promote": words["promote"],
        "windows": diagnosis.windows,
        "seconds": diagnosis.seconds,
        "software": diagnosis.software,
    }


def status_payload(config: Config, run: AxisRun, now: float, wall_ns: int, *, kept: bool = True) -> dict[str, Any]:
    """`.../status`: what was received, refused and committed, and what waits.

    Args:
        config: of the daemon.
        run: the axis.
        now: on the monotonic clock. [s]
        wall_ns: the same moment in Unix time. [ns]
        kept: whether answers are kept in the history; false while its disk is almost full.
    """
    record, baseline = run.record, run.drift.baseline
    return {
        "schema_version": SCHEMA_VERSION,
        "site": config.site,
        "axis": record.name,
        "listed": run.axis is not None,
        "state": _state(run),
        "committed": run.committed,
        "samples": record.samples,
        "missing": record.missing,
        "gaps": dict(run.gaps),
        "rejected": dict(record.rejected),
        "held_blocks": run.assembler.held if run.assembler else 0,
        "pending_windows": len(run.order),
        "lag": {"intake_seconds": round(run.delay, 3), "windows_seconds": round(run.behind(now), 3)},
        "hop": {
            "samples": run.assembler.rule.hop * run.assembler.stretch if run.assembler else None,
            "stretched": run.assembler.stretch if run.assembler else 1,
            "left_out": run.left_out,
        },
        "clock": run.clock.to_dict(),
        "audit": {"state": run.audit.state, "refused": run.audit.finding},
        "complaint": run.complaint,
        "history_kept": kept,
        "baseline": {
            "complete": baseline is not None,
            "windows": baseline.windows if baseline else len(run.drift.learned),
            "needed": config.drift.baseline_windows,
        },
        "alarms": {kind: one.alarm.state.value for kind, one in run.alarms.items() if one.alarm.state != "normal"},
        "last_sample": iso(record.last_ns),
        "last_sample_ns": record.last_ns,
        "silent_seconds": None if run.heard is None else now - run.heard,
        "time": iso(wall_ns),
    }


def _state(run: AxisRun) -> str:
    if run.axis is None:
        return "unknown axis: not listed in the configuration, counted, not identified"
    return "watching" if run.drift.baseline else "learning"
