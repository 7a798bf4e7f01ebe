"""One window in, its estimate out: what a worker process runs. Pure but for the stopwatch."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field
from importlib.metadata import version
from typing import Any

import numpy as np

from identify.audit import audit_recording, worst
from identify.identification import identify_friction
from identify.result import IdentificationResult
from monitor.data_quality import faults_of
from monitor.estimate import Curve, Estimate, Parameter
from monitor.samples import Samples, Window
from plant.axis import Axis
from plant.recording import Floats, Recording

GRID_PER_DECADE = 8  # speeds 10^(k/8), the same for every window of every axis
SLOWEST, FASTEST = 0.1, 2.0  # of the fastest speed of a window; beyond it the curve is extrapolated, with its interval
SOFTWARE = version("tribowatch")
CRASHED = "identification crashed: "  # how the reason begins where it is no answer to the samples


@dataclass(frozen=True, slots=True)
class Job:
    """One window to identify.

    Attributes:
        row: its row in the history.
        axis: without its recordings, which do not travel between processes.
        window: which samples, and when.
        samples: raw, as the machine sent them.
        seed: of the search.
        method: of `identify_friction`.
        audit: check sign, unit and scale first; what is refused is not identified.
        effects: promoted effects of this axis, fitted together with friction.
        start: values their search begins with, by name.
    """

    row: int
    axis: Axis
    window: Window
    samples: Samples
    seed: int
    method: str
    audit: bool = False
    effects: tuple[str, ...] = ()
    start: dict[str, float] = field(default_factory=dict)


def recording_of(samples: Samples, axis: Axis) -> Recording:
    """The window as a recording: time from its first sample [s], force at the belt [N or N·m]."""
    return Recording(
        t=(samples.t_ns - samples.t_ns[0]) / 1e9,
        force=samples.drive * (1.0 if samples.is_force else axis.mechanics.gain),
        position=samples.position,
        velocity=samples.velocity,
        temperature=samples.temperature,
        load=samples.load,
        sample_time=axis.stream.sample_time,
        hold=axis.stream.hold,
        source=f"stream of {axis.name}",
    )


def identify_window(job: Job) -> Estimate:
    """Identify `job`; an exception of ours becomes the verdict bad_data, since it would come again."""
    started = time.perf_counter()
    recording = recording_of(job.samples, job.axis)
    try:
        audit = _audit(recording, job.axis) if job.audit else None
        if audit is not None and audit["verdict"] == "refuse":
            return _refused(job, recording, audit)
        answer = identify_friction(
            recording, job.axis, seed=job.seed, method=job.method, start=job.start or None, effects=job.effects
        )
    except Exception as error:
        return crashed(job, f"{type(error).__name__}: {error}")
    curve = curve_of(answer)
    return Estimate(
        window=job.window,
        verdict=answer.verdict.value,
        reason=answer.reason,
        method=answer.method,
        seed=answer.seed,
        software=SOFTWARE,
        data_sha256=recording.sha256(),
        result=finite(answer.to_dict() | ({} if audit is None else {"audit": audit})),
        criterion=_number(answer.criterion),
        held_out_criterion=_number(answer.held_out_criterion),
        evaluations=answer.evaluations,
        seconds=time.perf_counter() - started,
        parameters=_parameters(answer),
        curve=curve,
        conditions=_conditions(recording) | _left_over(answer),
        faults=faults_of(list(answer.preprocessing), len(recording), jitter_of(recording)),
    )


def _audit(recording: Recording, axis: Axis) -> dict[str, Any]:
    """What the audit has against the window; `judged` where there was motion enough to judge sign and scale."""
    findings = audit_recording(recording, axis)
    return {
        "verdict": worst(findings),
        "judged": not any(finding.check in ("motion", "samples", "clock") for finding in findings if finding.bad),
        "findings": [finding.to_dict() for finding in findings if finding.bad],
    }


def _refused(job: Job, recording: Recording, audit: dict[str, Any]) -> Estimate:
    """The answer to a window whose sign, unit or scale cannot be right."""
    reason = f"refused by the audit: {audit['findings'][0]['text']}"
    result = {"verdict": "bad_data", "reason": reason, "axis": job.axis.name, "parameters": {}, "audit": audit}
    return Estimate(
        job.window, "bad_data", reason, job.method, job.seed, SOFTWARE, recording.sha256(), result,
        conditions=_conditions(recording),
    )  # fmt: skip


def crashed(job: Job, reason: str) -> Estimate:
    """The answer to a window that could not be identified through no fault of its own."""
    text = CRASHED + reason
    result = {"verdict": "bad_data", "reason": text, "axis": job.axis.name, "parameters": {}}
    sha = recording_of(job.samples, job.axis).sha256()
    return Estimate(job.window, "bad_data", text, job.method, job.seed, SOFTWARE, sha, result)


def _parameters(answer: IdentificationResult) -> tuple[Parameter, ...]:
    found = []
    for one in answer.parameters.values():
        low, high = (_number(one.ci95[0]), _number(one.ci95[1])) if one.ci95 else (None, None)
        if math.isfinite(one.value):
            found.append(Parameter(one.name, float(one.value), one.unit, low, high, one.identifiable, one.at_bound))
    return tuple(found)


def curve_of(answer: IdentificationResult) -> Curve | None:
    """F(v) on the common grid, around the speeds this window visited."""
    if answer.curve is None or not answer.curve.fastest > 0:
        return None
    fastest = float(answer.curve.fastest)
    first, last = (math.ceil(math.log10(fastest * part) * GRID_PER_DECADE) for part in (SLOWEST, FASTEST))
    speeds: Floats = 10.0 ** (np.arange(first, last) / GRID_PER_DECADE)
    values, half = answer.curve_at(speeds)
    if not (np.isfinite(values).all() and np.isfinite(half).all()):
        return None
    low, high = (values - half).tolist(), (values + half).tolist()
    return Curve(tuple(speeds.tolist()), tuple(values.tolist()), tuple(low), tuple(high), fastest)


def _conditions(recording: Recording) -> dict[str, float]:
    """Where the axis was working: what later corrections for the operating point need."""
    position, t = recording.position, recording.t
    numbers = {
        "travel": float(np.nanmax(position) - np.nanmin(position)) if np.isfinite(position).any() else math.nan,
        "mean_speed": float(np.nansum(np.abs(np.diff(position))) / max(t[-1] - t[0], 1e-9)),
        "temperature": _mean(recording.temperature),
        "load": _mean(recording.load),
    }
    return {name: value for name, value in numbers.items() if math.isfinite(value)}


def _left_over(answer: IdentificationResult) -> dict[str, float]:
    latent = answer.latent_force
    return {} if latent is None or not math.isfinite(latent) else {"latent_force": float(latent)}


def jitter_of(recording: Recording) -> float:
    """Standard deviation of the time steps over their median; gaps aside. [1]"""
    steps = np.diff(recording.t)
    usual = float(np.median(steps))
    near = steps[steps < 2.5 * usual]
    return float(near.std() / usual) if len(near) > 1 and usual > 0 else 0.0


def _mean(values: Floats | None) -> float:
    return float(np.nanmean(values)) if values is not None and np.isfinite(values).any() else math.nan


def _number(value: float | None) -> float | None:
    return float(value) if value is not None and math.isfinite(value) else None


def finite(value: Any) -> Any:
    """`value` as JSON can hold it: numbers that are not finite become null, numpy scalars plain."""
    if isinstance(value, dict):
        return {str(key): finite(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [finite(one) for one in value]
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value
