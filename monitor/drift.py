"""From estimates to findings: has this axis' friction changed, and what does the change look like? Pure.

Every non-overlapping informative window takes one step of a two-sided CUSUM per indicator (`baseline.py`), against a
baseline learned from the axis' first windows, with thresholds from the false-alarm rate (`cusum.py`). A change is
told apart by its shape over speed: constant = wear, growing or falling with speed = lubrication, sudden and big = jam.
Windows that are not informative change nothing.
"""

from __future__ import annotations

import dataclasses
import enum
from dataclasses import dataclass
from typing import Any

import numpy as np

from monitor.baseline import Baseline, Learned, indicators_of, learn
from monitor.classes import classify
from monitor.estimate import Curve, Estimate
from plant.recording import Floats

SPENT_ON_JAM = 0.1  # share of the false-alarm budget; the rest goes to the charts
JAM_DEVIATION = 8.0  # scatters; a normal deviate reaches it once in 1e15 windows
RECENT = 5  # windows a jump is measured against
SURE = 0.8  # score that turns a class that was already told
FADE = 0.9  # per window: what an alert shows is the mean of about the last ten


class Kind(enum.StrEnum):
    """What an alert can be about; the last two belong to later capabilities."""

    WEAR = "wear"
    LUBRICATION = "lubrication"
    JAM = "jam"
    DATA_QUALITY = "data_quality"
    STALE = "stale"
    MODEL_MISMATCH = "model_mismatch"
    OPERATING_POINT = "operating_point"


@dataclass(frozen=True, slots=True)
class DriftRule:
    """Settings of the watch; see `config.DriftSection` and `config.AlarmsSection`."""

    baseline_windows: int = 20
    min_change: float = 0.05
    jam_rise: float = 0.5
    false_alarms_per_year: float = 1.0
    bad_windows: int = 3
    force_unit: str = "N"

    @property
    def speed_unit(self) -> str:
        """m/s, or rad/s on a rotary axis."""
        return "rad/s" if self.force_unit == "N*m" else "m/s"


@dataclass(frozen=True, slots=True)
class Finding:
    """A condition holds, or does not; with the numbers an alert needs as evidence."""

    kind: Kind
    holds: bool
    evidence: dict[str, Any] = dataclasses.field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class DriftState:
    """What the watch of one axis remembers; goes through JSON.

    Attributes:
        learned: windows of a baseline in the making.
        baseline: None while learning.
        up, down: CUSUM sums per indicator, in units of the scatter.
        since: steps since the first sum left zero, and the friction summed over them. [1], [N] (REFERENCES,)
        onset_ns: start of the first of them. [ns]
        recent: mid-speed friction of the last steps. [N]
        last: epoch, and number after the last sample, of the last window that took a step.
        told: kind of change told at the last step, None while there is none.
        before_jam: mid-speed friction before a jam, None while there is none. [N]
        bad_run: bad_data windows in a row. [1]
        passed_over: informative windows that did not cover the reference speeds. [1]
    """

    learned: tuple[Learned, ...] = ()
    baseline: Baseline | None = None
    up: tuple[float, ...] = ()
    down: tuple[float, ...] = ()
    steps: int = 0
    summed: tuple[float, ...] = ()
    onset_ns: int = 0
    recent: tuple[float, ...] = ()
    last: tuple[int, int] = (-1, 0)
    told: Kind | None = None
    before_jam: float | None = None
    bad_run: int = 0
    passed_over: int = 0

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return dataclasses.asdict(self)

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> DriftState:
        """Read what `to_dict` wrote, through JSON."""
        learned = tuple(
            Learned(one["start_ns"], one["end_ns"], Curve.from_dict(one["curve"]), one["stribeck_velocity"])
            for one in values["learned"]
        )
        baseline = Baseline.from_dict(values["baseline"]) if values["baseline"] else None
        told = Kind(values["told"]) if values["told"] else None
        lists = {name: tuple(values[name]) for name in ("up", "down", "summed", "recent", "last")}
        return cls(**{**values, **lists, "learned": learned, "baseline": baseline, "told": told})


def judge(state: DriftState, estimate: Estimate, rule: DriftRule) -> tuple[DriftState, list[Finding]]:
    """Take one estimate, in order of time; say which conditions hold now. What is not in the list is unchanged."""
    bad_run = state.bad_run + 1 if estimate.verdict == "bad_data" else 0
    state = dataclasses.replace(state, bad_run=bad_run)
    findings = [
        Finding(Kind.DATA_QUALITY, bad_run >= rule.bad_windows, {"windows": bad_run, "reason": estimate.reason})
    ]
    window = estimate.window.id  # by number, not by stamp: clocks may step back
    if not estimate.informative or (window.epoch, window.first_seq) < state.last:
        return state, findings
    state = dataclasses.replace(state, last=(window.epoch, window.first_seq + window.samples))
    if state.baseline is None:
        return _learn(state, estimate, rule), findings
    state, drifted = _step(state, state.baseline, estimate, rule)
    return state, findings + drifted


def _learn(state: DriftState, estimate: Estimate, rule: DriftRule) -> DriftState:
    assert estimate.curve is not None  # informative
    times = estimate.window.start_ns, estimate.window.end_ns
    window = Learned(*times, estimate.curve, estimate.value_of("stribeck_velocity"))
    learned = (*state.learned, window)[-4 * rule.baseline_windows :]
    if len(learned) < rule.baseline_windows:
        return dataclasses.replace(state, learned=learned)
    rate = rule.false_alarms_per_year * (1 - SPENT_ON_JAM)
    baseline = learn(learned, rule.baseline_windows, rule.min_change, rate, rule.force_unit)
    if baseline is None:
        return dataclasses.replace(state, learned=learned)
    zeros = (0.0,) * len(baseline.indicators)
    return dataclasses.replace(
        state, learned=(), baseline=baseline, up=zeros, down=zeros, summed=(0.0,) * len(baseline.speeds)
    )


def _step(
    state: DriftState, baseline: Baseline, estimate: Estimate, rule: DriftRule
) -> tuple[DriftState, list[Finding]]:
    at = estimate.curve.at(baseline.speeds) if estimate.curve else None
    if at is None:
        return dataclasses.replace(state, passed_over=state.passed_over + 1), []
    values, errors = at
    numbers, number_errors = indicators_of(np.array(baseline.speeds), values, errors)
    z = np.array([one.deviation(x, s) for one, x, s in zip(baseline.indicators, numbers, number_errors, strict=True)])
    state, jam = _judge_jam(state, baseline, float(numbers[1]), float(z[1]), estimate.window.end_ns, rule)
    if jam.holds:  # the charts would only repeat it
        return state, [jam]
    state = _add(state, baseline, z, values, estimate.window.start_ns)
    return _conclude(state, baseline, estimate.window.end_ns, jam, rule)


def _judge_jam(
    state: DriftState, baseline: Baseline, middle: float, z: float, end_ns: int, rule: DriftRule
) -> tuple[DriftState, Finding]:
    """A sudden rise within a window or two; it lasts until half of the rise is gone."""
    normal = baseline.friction[len(baseline.friction) // 2]
    before = state.before_jam
    if before is None and state.recent:
        usual = float(np.median(state.recent[:-1] or state.recent))
        if middle - usual >= rule.jam_rise * abs(normal) and z >= JAM_DEVIATION:
            before = usual
            state = dataclasses.replace(state, before_jam=before, onset_ns=end_ns)
    elif before is not None and middle - before < rule.jam_rise * abs(normal) / 2:
        before = None
        state = dataclasses.replace(state, before_jam=None)
    if before is None:
        return dataclasses.replace(state, recent=(*state.recent, middle)[-RECENT:]), Finding(Kind.JAM, False)
    evidence = {"before": before, "now": middle, "relative": middle / before - 1 if before else None, "deviation": z}
    where = {
        "speed": baseline.speeds[len(baseline.speeds) // 2],
        "speed_unit": rule.speed_unit,
        "unit": rule.force_unit,
    }
    return state, Finding(Kind.JAM, True, {**evidence, **where})


def _add(state: DriftState, baseline: Baseline, z: Floats, values: Floats, start_ns: int) -> DriftState:
    """One step of every chart. No single window counts more than three quarters of the way to the threshold."""
    k = np.array([one.k for one in baseline.indicators])
    h = np.array([one.h for one in baseline.indicators])
    clipped = np.clip(z, -k - 0.75 * h, k + 0.75 * h)
    up = np.clip(np.array(state.up) + clipped - k, 0.0, 1.5 * h)  # bounded, so that a repair is seen soon
    down = np.clip(np.array(state.down) - clipped - k, 0.0, 1.5 * h)
    if not up.any() and not down.any():
        nothing = (0.0,) * len(values)
        return dataclasses.replace(state, up=tuple(up.tolist()), down=tuple(down.tolist()), steps=0, summed=nothing)
    fade = FADE if state.steps else 0.0
    summed = fade * np.array(state.summed) + values
    onset = state.onset_ns if state.steps else start_ns
    return dataclasses.replace(
        state,
        up=tuple(up.tolist()),
        down=tuple(down.tolist()),
        steps=state.steps + 1,
        summed=tuple(summed.tolist()),
        onset_ns=onset,
    )


def _conclude(
    state: DriftState, baseline: Baseline, end_ns: int, jam: Finding, rule: DriftRule
) -> tuple[DriftState, list[Finding]]:
    """Raise when a sum passes its threshold, return when every sum is below half of it; classify by shape."""
    h = np.array([one.h for one in baseline.indicators])
    height = np.maximum(state.up, state.down) / h
    drifting = bool(height.max() > (1.0 if state.told is None else 0.5))
    kind, evidence = (None, {}) if not drifting else _explain(state, baseline, height, end_ns, rule)
    classes = (Kind.WEAR, Kind.LUBRICATION)
    findings = [Finding(one, one is kind, evidence if one is kind else {}) for one in classes]
    return dataclasses.replace(state, told=kind), [jam, *findings]


def _explain(
    state: DriftState, baseline: Baseline, height: Floats, end_ns: int, rule: DriftRule
) -> tuple[Kind, dict[str, Any]]:
    """What the change is, with the numbers an alert shows as evidence."""
    normal = np.array(baseline.friction)
    weight = (1 - FADE**state.steps) / (1 - FADE)  # windows that `summed` stands for
    now = np.array(state.summed) / weight
    uncertain = np.array(baseline.covariance) * (1 / baseline.windows + 1 / weight)
    verdict = classify(baseline, now - normal, uncertain)
    kind = _kind(verdict.wear, state.told)
    middle, error = len(normal) // 2, 1.96 * np.sqrt(np.diag(uncertain))
    index = int(np.argmax(height))
    return kind, {
        "speeds": list(baseline.speeds),
        "baseline": normal.tolist(),
        "now": now.tolist(),
        "now_low": (now - error).tolist(),
        "now_high": (now + error).tolist(),
        "relative": float(now[middle] / normal[middle] - 1),
        "relative_ci95": [float((now + sign * error)[middle] / normal[middle] - 1) for sign in (-1, 1)],
        "unit": rule.force_unit,
        "speed_unit": rule.speed_unit,
        "score": verdict.wear if kind is Kind.WEAR else 1 - verdict.wear,
        "rivals": {"wear": verdict.wear, "lubrication": 1 - verdict.wear},
        "shape": verdict.shape,
        "shapes": verdict.shapes,
        "indicator": baseline.indicators[index].name,
        "direction": "up" if state.up[index] >= state.down[index] else "down",
        "height": float(height[index]),
        "windows": state.steps,
        "since_ns": state.onset_ns,
        "until_ns": end_ns,
        "baseline_windows": baseline.windows,
        "false_alarms_per_axis_year": rule.false_alarms_per_year,
    }


def _kind(wear: float, told: Kind | None) -> Kind:
    """The likelier class; one already told stays until its rival is sure."""
    if told is Kind.WEAR:
        return Kind.LUBRICATION if 1 - wear > SURE else Kind.WEAR
    if told is Kind.LUBRICATION:
        return Kind.WEAR if wear > SURE else Kind.LUBRICATION
    return Kind.WEAR if wear >= 0.5 else Kind.LUBRICATION


def indicators(state: DriftState, estimate: Estimate) -> list[dict[str, Any]]:
    """The numbers watched, at this window, for subscribers and the history; empty while learning."""
    baseline = state.baseline
    at = estimate.curve.at(baseline.speeds) if baseline and estimate.curve and estimate.informative else None
    if baseline is None or at is None:
        return []
    numbers, errors = indicators_of(np.array(baseline.speeds), *at)
    return [
        {
            "name": one.name,
            "unit": one.unit,
            "value": float(x),
            "ci95": [float(x - 1.96 * s), float(x + 1.96 * s)],
            "baseline": one.mean,
            "deviation": one.deviation(float(x), float(s)),
            "sum_up": up / one.h,
            "sum_down": down / one.h,
        }
        for one, x, s, up, down in zip(baseline.indicators, numbers, errors, state.up, state.down, strict=True)
    ]
