"""Each channel by itself against the axis file: clock, range, step, jumps."""

from __future__ import annotations

import math

import numpy as np

from identify.audit_causes import TIME_CAUSES, VELOCITY_CAUSES, Cause, force_causes, named, position_causes
from identify.audit_finding import Finding, Severity
from identify.audit_fit import GAP, finest_step
from plant.axis import Axis
from plant.recording import LARGEST, Floats, Recording

PEAK = (3.0, 10.0)  # of rated force: servo drives give 2-3 times for seconds; ten times is another unit
SPAN = (1.1, 3.0)  # of the travel
STEP = 5.0  # of the resolution: coarser than this is another sensor or another unit
VELOCITY = (0.7, 1.4)  # of the slope of the position
WORD = 65536  # counts of 16 bits


def findings(recording: Recording, axis: Axis) -> list[Finding]:
    """All checks that look at one channel only."""
    made = [
        _samples(recording),
        _clock(recording),
        _sample_time(recording, axis),
        _position_jumps(recording, axis),
        _travel(recording, axis),
        _force_wrap(recording, axis),
        _rated(recording, axis),
        _still(recording, axis),
        _step(
            "position step",
            recording.position,
            axis.sensor.position_resolution,
            axis.position_unit,
            position_causes(axis),
        ),
        _step("force step", recording.force, axis.drive.force_resolution, axis.force_unit, force_causes(axis)),
        _velocity(recording),
        _temperature(recording),
    ]
    return [finding for finding in made if finding is not None]


def _good(values: Floats) -> Floats:
    return values[np.isfinite(values)]


def _samples(recording: Recording) -> Finding:
    bad = ~np.isfinite(recording.t) | ~np.isfinite(recording.force) | ~np.isfinite(recording.position)
    share = float(np.mean(bad))
    severity: Severity = "ok" if share == 0 else "warn" if share < 0.2 else "refuse"
    seen = f"{int(bad.sum())} of {len(bad)}"
    text = f"{seen} samples are not usable (no finite number, or beyond {LARGEST:g})"
    return Finding(severity, "samples", seen, "0", None, text)


def _clock(recording: Recording) -> Finding:
    steps = np.diff(_good(recording.t))
    if len(steps) == 0:
        return Finding("refuse", "clock", "no two stamps", "rising stamps", None, "the recording has no usable clock")
    back = int(np.count_nonzero(steps <= 0))
    if back:
        text = f"time does not rise at {back} of {len(steps)} steps; sort the samples or mend the logger's clock"
        severity: Severity = "refuse" if back > 0.01 * len(steps) or back > 10 else "warn"
        return Finding(severity, "clock", f"{back} steps back or still", "rising stamps", None, text)
    period = float(np.median(steps))
    gaps = int(np.count_nonzero(steps > GAP * period))
    jitter = float(np.std(steps[steps <= GAP * period])) / period
    seen = f"period {1e3 * period:.4g} ms, jitter {100 * jitter:.2g} %, {gaps} gaps"
    calm = jitter < 0.25 and gaps <= 0.01 * len(steps)
    return Finding("ok" if calm else "warn", "clock", seen, "jitter < 25 %, gaps < 1 %", None, f"stamps have {seen}")


def _sample_time(recording: Recording, axis: Axis) -> Finding | None:
    nominal = recording.sample_time or axis.stream.sample_time
    steps = np.diff(_good(recording.t))
    if nominal is None or len(steps) == 0 or (period := float(np.median(steps))) <= 0:
        return None
    ratio = period / nominal
    off = abs(math.log(ratio))
    severity: Severity = "ok" if off < math.log(1.2) else "warn" if off < math.log(5) else "refuse"
    likely = None if severity == "ok" else named(ratio, TIME_CAUSES)
    text = f"samples come every {period:.4g} s, the axis file says {nominal:.4g} s"
    if severity != "ok":
        text += f"; likely: {likely}" if likely else "; check the unit of t and sample_time"
    return Finding(severity, "sample time", f"{period:.4g} s", f"{nominal:.4g} s", likely, text)


def _still(recording: Recording, axis: Axis) -> Finding | None:
    for name, unit in (("position", axis.position_unit), ("force", axis.force_unit)):
        values = _good(getattr(recording, name))
        if len(values) and np.ptp(values) == 0:
            text = f"{name} is constant at {values[0]:.4g} {unit}: the axis stood still, or the channel is frozen"
            return Finding("warn", f"{name} still", f"{values[0]:.4g} {unit}", f"a changing {name}", None, text)
    return None


def _position_jumps(recording: Recording, axis: Axis) -> Finding | None:
    """A position that wraps jumps by its whole range between two samples."""
    position = _good(recording.position)
    if len(position) < 10 or (span := float(np.ptp(position))) == 0:
        return None
    jumps = np.abs(np.diff(position))
    wide = jumps > 0.5 * span
    if not wide.any() or np.quantile(jumps[~wide], 0.99) > 0.05 * span or np.mean(wide) > 0.05:
        return None
    jump = float(np.median(jumps[wide]))
    counts = jump / (axis.sensor.position_resolution or finest_step(position) or math.inf)
    likely = "a counter of 16 bits that overflows" if 0.98 < counts / WORD < 1.02 else "a wrapping angle or counter"
    unit = axis.position_unit
    text = f"position jumps {int(wide.sum())} times by about {jump:.4g} {unit}: {likely}; unwrap it before"
    return Finding("refuse", "position jumps", f"{jump:.4g} {unit}", "no jumps", likely, text)


def _travel(recording: Recording, axis: Axis) -> Finding | None:
    position, travel = _good(recording.position), axis.mechanics.travel
    if travel is None or len(position) == 0:
        return None
    low, high, span = float(position.min()), float(position.max()), travel[1] - travel[0]
    ratio = max(high - low, max(abs(low), abs(high)) - max(abs(travel[0]), abs(travel[1]))) / span
    severity: Severity = "ok" if ratio <= SPAN[0] else "warn" if ratio <= SPAN[1] else "refuse"
    outside = low < travel[0] - 0.1 * span or high > travel[1] + 0.1 * span
    if severity == "ok" and outside:
        severity = "warn"
    unit = axis.position_unit
    seen, expected = f"{low:.4g} to {high:.4g} {unit}", f"{travel[0]:.4g} to {travel[1]:.4g} {unit}"
    likely = _too_far(ratio, axis) if severity == "refuse" else "another zero of the encoder" if outside else None
    text = f"position runs from {seen}, travel is {expected}" + (f"; likely: {likely}" if likely else "")
    return Finding(severity, "travel", seen, expected, likely, text)


def _too_far(ratio: float, axis: Axis) -> str | None:
    """The mildest mistake that explains a span of `ratio` travels: nobody moves over more than all of it."""
    enough = [cause for cause in position_causes(axis) if cause.factor >= 0.9 * ratio]
    return min(enough, key=lambda cause: cause.factor).words if enough else None


def _rated(recording: Recording, axis: Axis) -> Finding | None:
    force, rated = np.abs(_good(recording.force)), axis.drive.rated_force
    if rated is None or len(force) == 0:
        return None
    peak, unit = float(np.quantile(force, 0.999)), axis.force_unit
    ratio = peak / rated
    severity: Severity = "ok" if ratio <= PEAK[0] else "warn" if ratio <= PEAK[1] else "refuse"
    if ratio < 1e-3:
        severity = "warn"
    likely = None
    if severity == "refuse":
        likely = next(
            (c.words for c in force_causes(axis) if c.factor > 1 and 0.01 < ratio / c.factor <= PEAK[0]), None
        )
    if ratio < 1e-3:
        likely = "per unit or kN taken as N, or the drive was off"
    seen, expected = f"{peak:.4g} {unit}", f"up to {PEAK[0]:g} x {rated:.4g} {unit}"
    text = f"force reaches {seen}, {100 * ratio:.3g} % of rated" + (f"; likely: {likely}" if likely else "")
    return Finding(severity, "rated force", seen, expected, likely, text)


def _force_wrap(recording: Recording, axis: Axis) -> Finding | None:
    """Negative counts read as unsigned lie a whole word above the positive ones."""
    force = np.sort(np.abs(_good(recording.force)))
    if len(force) < 100 or (span := float(force[-1] - force[0])) == 0:
        return None
    at = int(np.argmax(np.diff(force)))
    gap, below, above = float(force[at + 1] - force[at]), at + 1, len(force) - at - 1
    spread = min(np.ptp(force[: at + 1]), np.ptp(force[at + 1 :]))
    one_signed = np.all(_good(recording.force) >= 0) or np.all(_good(recording.force) <= 0)
    if gap < 0.8 * span or min(below, above) < 0.02 * len(force) or spread < 1e-6 * span or not one_signed:
        return None
    counts = float(force[-1]) / (finest_step(recording.force) or math.inf)
    bits = "16-bit " if 0.5 < counts / WORD <= 1.01 else ""
    likely = f"negative {bits}values read as unsigned"
    unit = axis.force_unit
    text = f"force leaps between two bands {gap:.4g} {unit} apart: likely {likely}; read the channel as signed"
    return Finding("refuse", "force bands", f"{gap:.4g} {unit} apart", "one band", likely, text)


def witnesses(recording: Recording, axis: Axis) -> list[float]:
    """What single channels say of the scale of force over that of position, where they say anything: factors."""
    found = []
    for values, resolution, sense in (
        (recording.force, axis.drive.force_resolution, 1),
        (recording.position, axis.sensor.position_resolution, -1),
    ):
        ratio = finest_step(values) / resolution if resolution > 0 else 0.0
        if ratio > STEP:  # finer says nothing: noise and averaging do that
            found.append(ratio**sense)
    ratio = velocity_ratio(recording) or 1.0
    return found + ([ratio] if ratio > VELOCITY[1] or 0 < ratio < VELOCITY[0] else [])


def _step(check: str, values: Floats, resolution: float, unit: str, causes: list[Cause]) -> Finding | None:
    if resolution <= 0 or (step := finest_step(values)) == 0:
        return None
    ratio = step / resolution
    coarse = ratio > STEP
    likely = named(ratio, causes) if coarse else None
    text = f"{check} seen is {step:.3g} {unit}, the axis file's resolution {resolution:.3g} {unit}"
    if coarse:
        text += f": {ratio:.3g} times coarser" + (f"; likely: {likely}" if likely else "")
    return Finding("warn" if coarse else "ok", check, f"{step:.3g} {unit}", f"{resolution:.3g} {unit}", likely, text)


def velocity_ratio(recording: Recording) -> float | None:
    """The velocity channel over the slope of the position; None where they do not go together at all."""
    velocity = recording.velocity
    if velocity is None or len(recording) < 20:
        return None
    good = np.isfinite(recording.t) & np.isfinite(recording.position) & np.isfinite(velocity)
    t, y, v = recording.t[good], recording.position[good], velocity[good]
    if len(t) < 20 or np.any(np.diff(t) <= 0):
        return None
    wide = max(1, len(t) // 400)  # the slope over some samples: quantisation is not motion
    slope = (y[2 * wide :] - y[: -2 * wide]) / (t[2 * wide :] - t[: -2 * wide])
    there = v[wide:-wide]
    fast = (np.abs(there) > 0.3 * np.quantile(np.abs(there), 0.95)) & (slope != 0)
    if fast.sum() < 10:
        return None
    ratios = there[fast] / slope[fast]
    low, ratio, high = np.quantile(ratios, (0.25, 0.5, 0.75))
    return float(ratio) if high - low < 0.5 * abs(ratio) else None


def _velocity(recording: Recording) -> Finding | None:
    ratio = velocity_ratio(recording)
    if ratio is None:
        return None
    good_enough = VELOCITY[0] < ratio < VELOCITY[1]
    likely = None if good_enough else named(ratio, VELOCITY_CAUSES)
    text = f"velocity is {ratio:.3g} times the slope of the position" + (f"; likely: {likely}" if likely else "")
    return Finding("ok" if good_enough else "warn", "velocity", f"{ratio:.3g}", "1", likely, text)


def _temperature(recording: Recording) -> Finding | None:
    if recording.temperature is None or len(values := _good(recording.temperature)) == 0:
        return None
    low, high = float(values.min()), float(values.max())
    calm = low >= -40 and high <= 150
    likely = None if calm else "kelvin" if low >= 230 and high <= 420 else "tenths of a degree" if high < 1500 else None
    text = f"temperature from {low:.4g} to {high:.4g} degC" + (f"; likely: {likely}" if likely else "")
    return Finding(
        "ok" if calm else "warn", "temperature", f"{low:.4g} to {high:.4g} degC", "-40 to 150 degC", likely, text
    )
