"""Is a recording good enough to identify friction from, and if not, which motion would be?"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from identify.audit_fit import Fit, Floats, fit, velocities
from plant.axis import Axis
from plant.recording import Recording

MOVING = 0.05  # of the 95 % speed: slower counts as rest
FEWEST_SAMPLES = 200  # in motion, after averaging: two seconds at 100 Hz
FEWEST_STROKES = 4  # two each way: one pair more than it takes to tell friction from a constant force
BOTH_WAYS = 0.2  # of the moving time at least in the rarer direction
SPEEDS = 3.0  # fastest over slowest: half a decade, or the parts of eq. (1) cannot be told apart
KNOWN = 0.25  # standard error over friction
STROKE_SAMPLES = 15  # per stroke at least: fewer and the reversal itself is not seen
STROKES_EACH_SPEED = 6
SLOW_STROKE = 4.0  # s, longest that a slow stroke is asked to last


@dataclass(frozen=True, slots=True)
class Suitability:
    """The verdict with its numbers.

    Attributes:
        good: friction can be identified from this.
        reasons: what is missing, each with number and need; empty when good.
        motion: the motion that would do, None when good.
        duration: in motion. [s]
        samples: in motion, at the sample time of the analysis.
        strokes: between reversals.
        rarer_way: share of the moving time in the rarer direction. 0 ... 0.5
        slowest: 10 % quantile of the speeds in motion. [m/s or rad/s]
        fastest: 95 % quantile. [m/s or rad/s]
        friction: rough, at the median speed. [N or N·m] or None
        friction_error: its standard error. [N or N·m] or None
    """

    good: bool
    reasons: tuple[str, ...]
    motion: str | None
    duration: float
    samples: int
    strokes: int
    rarer_way: float
    slowest: float
    fastest: float
    friction: float | None
    friction_error: float | None
    speed_unit: str

    @property
    def text(self) -> str:
        """One line: good enough and why, or what is missing and what to do."""
        if self.good:
            return (
                f"good enough: {self.strokes} strokes, {self.duration:.3g} s of motion, "
                f"speeds {self.slowest:.3g} to {self.fastest:.3g} {self.speed_unit}"
            )
        return f"not good enough: {'; '.join(self.reasons)}. Do this motion: {self.motion}"

    def to_dict(self) -> dict[str, Any]:
        """The verdict as JSON."""
        return asdict(self) | {"reasons": list(self.reasons), "text": self.text}


def suitability(recording: Recording, axis: Axis) -> Suitability:
    """Judge strokes, speeds and duration of `recording` against what telling the friction parameters apart takes."""
    stretches = velocities(recording)
    whole = np.concatenate([v for _, v in stretches]) if stretches else np.zeros(1)
    period = stretches[0][0] if stretches else 0.0
    fastest = float(np.quantile(np.abs(whole), 0.95))
    moving = np.abs(whole) > MOVING * fastest
    share = float(np.mean(whole[moving] > 0)) if moving.any() else 0.0
    slowest = float(np.quantile(np.abs(whole[moving]), 0.1)) if moving.any() else 0.0
    strokes = sum(_strokes(v, 0.1 * fastest) for _, v in stretches)
    duration = float(moving.sum()) * period
    step = max(period, axis.analysis_sample_time or 0.0)
    result = fit(recording)
    known = result is not None and np.isfinite(result.friction_error)
    counted = _Counted(
        duration, int(duration / step) if step else 0, strokes, min(share, 1 - share), slowest, fastest, period
    )
    reasons = tuple(_missing(counted, result if known else None, axis))
    return Suitability(
        good=not reasons,
        reasons=reasons,
        motion=_motion(recording, axis, fastest, larger=reasons[0].startswith("friction")) if reasons else None,
        duration=duration,
        samples=counted.samples,
        strokes=strokes,
        rarer_way=counted.rarer_way,
        slowest=slowest,
        fastest=fastest,
        friction=result.friction if result is not None and known else None,
        friction_error=result.friction_error if result is not None and known else None,
        speed_unit=f"{axis.position_unit}/s",
    )


@dataclass(frozen=True, slots=True)
class _Counted:
    duration: float
    samples: int
    strokes: int
    rarer_way: float
    slowest: float
    fastest: float
    period: float


def _strokes(velocity: Floats, slow: float) -> int:
    """Runs of one direction, rests in between not counted."""
    ways = np.sign(velocity[np.abs(velocity) > slow])
    return int(np.count_nonzero(np.diff(ways))) + 1 if len(ways) else 0


def _missing(counted: _Counted, result: Fit | None, axis: Axis) -> list[str]:
    unit = f"{axis.position_unit}/s"
    if counted.fastest == 0 or counted.samples == 0:
        return ["the axis does not move"]
    found = []
    if counted.samples < FEWEST_SAMPLES:
        found.append(f"{counted.samples} samples in motion, at least {FEWEST_SAMPLES} are needed")
    if counted.strokes < FEWEST_STROKES:
        found.append(f"{counted.strokes} strokes between reversals, at least {FEWEST_STROKES} are needed")
    if counted.rarer_way < BOTH_WAYS:
        found.append(f"{100 * counted.rarer_way:.0f} % of the motion goes one way, {100 * BOTH_WAYS:.0f} % are needed")
    if counted.fastest < SPEEDS * counted.slowest:
        found.append(
            f"speeds lie between {counted.slowest:.3g} and {counted.fastest:.3g} {unit}, "
            f"a factor of {counted.fastest / counted.slowest:.2g}; {SPEEDS:g} is needed"
        )
    if counted.strokes and counted.duration / counted.strokes < STROKE_SAMPLES * counted.period:
        found.append(f"a stroke has {counted.duration / counted.strokes / counted.period:.0f} samples, sample faster")
    if not found:
        found += _invisible(result, axis)
    return found


def _invisible(result: Fit | None, axis: Axis) -> list[str]:
    """The motion is right; does the friction show?"""
    unit = axis.force_unit
    if result is None:
        return ["friction and a constant force cannot be told apart"]
    if result.friction_error > KNOWN * abs(result.friction):
        return [f"friction shows only as {result.friction:.3g} +- {result.friction_error:.2g} {unit}"]
    if 0 < result.friction < axis.drive.force_resolution:
        step = axis.drive.force_resolution
        return [f"friction of {result.friction:.3g} {unit} is below the force's step of {step:g} {unit}"]
    return []


def _motion(recording: Recording, axis: Axis, fastest: float, *, larger: bool) -> str:
    """Strokes at three speeds, within the travel and no faster than was seen."""
    travel, unit = axis.mechanics.travel, axis.position_unit
    seen = recording.position[np.isfinite(recording.position)]
    used = float(np.ptp(seen)) if len(seen) else 0.0
    stroke = 0.6 * (travel[1] - travel[0]) if travel else 10 * used if larger else used
    if stroke == 0:
        return "move back and forth over most of the travel at three speeds, 1 : 3 : 10, six strokes each"
    top = fastest if fastest > 0.05 * stroke else 0.5 * stroke
    parts, seconds = [], 0.0
    for speed in (top, top / 3, top / 10):
        length = min(stroke, speed * SLOW_STROKE)
        seconds += STROKES_EACH_SPEED * length / speed
        parts.append(f"{STROKES_EACH_SPEED} strokes of {length:.2g} {unit} at {speed:.2g} {unit}/s")
    return f"{', then '.join(parts)}, back and forth; about {seconds:.0f} s, with 100 samples/s or more"
