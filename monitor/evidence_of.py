"""Where an axis stands against its baseline, and the numbers an alert shows as evidence. Pure."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from monitor.baseline import Baseline
from monitor.channels import REFERENCES, UNEXPLAINED, lacking, unmoved
from monitor.classes import Verdict, compared, compete
from monitor.drift_state import DriftRule, DriftState, Step
from monitor.findings import Kind
from monitor.glr import LONGEST, Looked, common_bars, freedom, look, variances, widest
from monitor.trend import DAY_NS, project
from plant.recording import Floats

SPENT_ON_JAM = 0.1  # share of the false-alarm budget; the numbers watched share the rest
UNSURE = 1.5  # ratio of standard errors, with and without what temperature and load may do


def arrays_of(recent: tuple[Step, ...]) -> tuple[Floats, Floats, Floats]:
    """Values, standard errors (n, J) and distance from the usual temperature and load (n, p) of remembered windows."""
    values = np.array([step.values for step in recent], dtype=np.float64)
    errors = np.array([step.errors for step in recent])
    return values, errors, np.array([step.away for step in recent]).reshape(len(recent), -1)


def look_back(baseline: Baseline, recent: tuple[Step, ...]) -> tuple[Looked, Floats]:
    """Deviations over the last windows, and each window's own (n, J)."""
    values, errors, away = arrays_of(recent)
    fit = baseline.fit
    residuals = values - baseline.moments.mean_y - away @ fit.slopes
    looseness = 1.0 + np.maximum(errors**2 - np.array(baseline.usual), 0.0) / fit.variance
    looked = look(residuals, looseness, away, fit, baseline.windows)
    return looked, residuals


@functools.lru_cache(maxsize=1024)
def _bars(baseline: Baseline, rate: float) -> Floats:
    floors = np.array([one.floor for one in baseline.channels])
    watched = np.isfinite(floors)
    usual = np.arange(1.0, LONGEST + 1)[:, None] * np.ones_like(floors)
    errors, most = (np.sqrt(of(usual, baseline.fit, baseline.windows))[:, watched] for of in (variances, widest))
    dof = freedom(usual, baseline.fit, baseline.windows)[:, watched]
    found = np.full(usual.shape, np.inf)
    found[:, watched] = common_bars(rate, baseline.steps_per_year, errors, floors[watched], dof, most, baseline.fit.dof)
    return found


def bars_of(baseline: Baseline, looked: Looked, rule: DriftRule) -> Floats:
    """Bar of each mean, in standard errors; infinite where a number is not watched. (m, J)"""
    return _bars(baseline, rule.false_alarms_per_year * (1 - SPENT_ON_JAM))[: len(looked.mean)]


def towards(baseline: Baseline, looked: Looked, bars: Floats) -> tuple[Floats, Floats]:
    """How far each channel is on its way to a finding, up and down: share of bar and floor, the lesser. (J,) each"""
    floors = np.array([one.floor for one in baseline.channels])
    share = np.minimum(np.abs(looked.t) / bars, np.abs(looked.mean) / floors)
    return np.where(looked.mean > 0, share, 0.0).max(axis=0), np.where(looked.mean < 0, share, 0.0).max(axis=0)


def explain(baseline: Baseline, looked: Looked, m: int, rule: DriftRule) -> Verdict:
    """Let causes compete for the mean of the last m + 1 windows."""
    index = compared(baseline)
    change = looked.mean[m, index]
    moments = baseline.moments
    spread = moments.syy - baseline.fit.slopes.T @ moments.sxy  # of the residuals
    correlation = spread / np.sqrt(np.outer(np.diag(spread), np.diag(spread)) + 1e-300)
    part = np.ix_(index, index)
    shrunk = 0.7 * correlation[part] + 0.3 * np.eye(len(index))  # 20 windows do not know all correlations
    error = looked.error[m, index]
    return compete(baseline, change, shrunk * np.outer(error, error), rule.weight, "temperature" in baseline.movers)


def with_jam(verdict: Verdict) -> dict[str, float]:
    """Scores with what rises within one window counted as a jam: wear takes weeks."""
    scores = dict(verdict.kinds)
    scores["jam"] = scores.pop("wear", 0.0)
    return scores


def uncovered(
    baseline: Baseline, looked: Looked, bars: Floats, worth: Any, state: DriftState, rule: DriftRule
) -> dict[str, Any] | None:
    """A change that would count, were temperature or load within what the baseline knows; None where there is none."""
    plain = np.abs(looked.mean) / looked.plain / bars
    beyond = worth & (plain > 1.0) & (looked.error > UNSURE * looked.plain)
    if not beyond[0].any():  # the latest window must be such a one
        return None
    index = int(np.argmax(np.where(beyond[0], plain[0], 0.0)))
    channel, latest = baseline.channels[index], state.recent[-1]
    now = (np.array(latest.away) + baseline.moments.mean_x).tolist()
    return {
        "cause": "not covered",
        "indicator": channel.name,
        "relative": float(looked.mean[0, index] / channel.scale),
        "conditions": {name: unmoved(name, value) for name, value in zip(baseline.movers, now, strict=True)},
        "covered": baseline.covered,
        "uncertain": float(1.96 * looked.error[0, index] / channel.scale),
        "baseline_windows": baseline.windows,
        "since_ns": latest.start_ns,
        "until_ns": latest.end_ns,
        "false_alarms_per_axis_year": rule.false_alarms_per_year,
    }


def evidence_of(
    state: DriftState,
    baseline: Baseline,
    looked: Looked,
    m: int,
    index: int,
    height: Floats,
    verdict: Verdict,
    kind: Kind,
    rule: DriftRule,
) -> dict[str, Any]:
    """The numbers an alert shows."""
    middle, channel, latest = REFERENCES // 2, baseline.channels[index], state.recent[-1]
    friction = baseline.friction + np.array(latest.away) @ baseline.fit.slopes[:, :REFERENCES]
    now, error = friction + looked.mean[m, :REFERENCES], 1.96 * looked.error[m, :REFERENCES]
    expected = float(baseline.moments.mean_y[index] + np.array(latest.away) @ baseline.fit.slopes[:, index])
    scatter = np.sqrt(baseline.fit.variance[middle]) / baseline.channels[middle].scale
    level = float(scatter * np.sqrt((1 + baseline.fit.correlation[middle]) / (1 - baseline.fit.correlation[middle])))
    level /= float(np.sqrt(baseline.windows))
    projection = project(
        state.trend, state.onset_ns, float(scatter), float(baseline.fit.correlation[middle]), rule.limit_rise, level
    )
    windows = sum(step.start_ns >= state.onset_ns for step in state.recent)
    told: dict[str, Any] = {
        "speeds": list(baseline.speeds),
        "baseline": friction.tolist(),
        "now": now.tolist(),
        "now_low": (now - error).tolist(),
        "now_high": (now + error).tolist(),
        "relative": float(now[middle] / friction[middle] - 1),
        "relative_ci95": [float((now + sign * error)[middle] / friction[middle] - 1) for sign in (-1, 1)],
        "unit": rule.force_unit,
        "speed_unit": rule.speed_unit,
        "score": verdict.kinds.get(kind.value, 0.0),
        "rivals": verdict.kinds,
        "cause": verdict.shape,
        "shape": verdict.shape,
        "shapes": verdict.shapes,
        "indicator": channel.name,
        "indicator_unit": channel.unit,
        "indicator_baseline": expected,
        "indicator_now": expected + float(looked.mean[m, index]),
        "indicator_error": 1.96 * float(looked.error[m, index]),
        "direction": "up" if looked.mean[m, index] > 0 else "down",
        "level": float(height.max()),
        "windows": max(windows, 1),
        "averaged": m + 1,
        "since_ns": state.onset_ns,
        "until_ns": latest.end_ns,
        "baseline_windows": baseline.windows,
        "baseline_days": (baseline.to_ns - baseline.from_ns) / DAY_NS,
        "baseline_scatter": float(scatter),
        "baseline_error": level,
        "corrected_for": list(baseline.movers),
        "min_change": rule.min_change,
        "false_alarms_per_axis_year": rule.false_alarms_per_year,
        "remaining": projection.to_dict(),
    }
    if verdict.sizes:
        told["size"] = verdict.sizes[0]
    if channel.name == UNEXPLAINED:  # a logarithm inside, for it grows by factors
        before, after = (
            lacking(value, float(level))
            for value, level in ((expected, friction[middle]), (told["indicator_now"], now[middle]))
        )
        told |= {"indicator_baseline": before, "indicator_now": after, "indicator_unit": rule.force_unit}
        told["indicator_error"] *= after
    return told
