"""From estimates to findings: has this axis changed, by how much, and what is behind it? Pure.

Every non-overlapping informative window is compared with the baseline (`baseline.py`) at its own temperature and load.
A change counts when the mean of the last windows, any number of them, stands out of what a healthy axis does at the set
rate of false alarms (`glr.py`), and when it is as large as the smallest change worth telling. Then causes compete for
it (`classes.py`). Windows that are not informative change nothing.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from monitor.baseline import Baseline, learn, refined, wandered
from monitor.channels import PARTS, REFERENCES, SHAPES, UNEXPLAINED, Seen, lacking, numbers_of
from monitor.classes import Verdict
from monitor.data_quality import judge_quality
from monitor.drift_state import DriftRule, DriftState, Step
from monitor.estimate import Estimate
from monitor.evidence_of import (
    SPENT_ON_JAM,
    arrays_of,
    bars_of,
    evidence_of,
    explain,
    look_back,
    towards,
    uncovered,
    with_jam,
)
from monitor.findings import Finding, Kind
from monitor.glr import LONGEST, Looked, bar
from monitor.moments import BLOCK
from monitor.trend import added
from plant.recording import Floats

__all__ = ["DriftRule", "DriftState", "Finding", "Kind", "indicators", "judge"]

RECENT = 5  # windows a jump is measured against
SURE = 0.8  # score that turns a class that was already told
STAYS = 0.6  # of the smallest change worth telling: a change that was told lasts while it is above that ...
STAYS_ERRORS = 2.0  # ... and above so many standard errors ...
STAYS_WINDOWS = 3  # ... over the last so many windows
SETTLING = 8  # later windows that must be healthy too, before a block refines the baseline
CALM = 3.5  # standard errors: nothing is learned from windows further away; a healthy axis is within them most days
PASSED_OVER = 5  # windows in a row at other speeds than the baseline's, before it is said
DIGITS = 7  # significant, of what is remembered
CHANGES = (Kind.WEAR, Kind.LUBRICATION, Kind.JAM, Kind.MODEL_MISMATCH, Kind.OPERATING_POINT, Kind.DATA_QUALITY)


def judge(state: DriftState, estimate: Estimate, rule: DriftRule) -> tuple[DriftState, list[Finding]]:
    """Take one estimate, in order of time; say which conditions hold now. What is not in the list is unchanged."""
    quality, trusted = judge_quality(state.quality, estimate, rule.bad_windows)
    state = dataclasses.replace(state, quality=quality)
    window = estimate.window.id  # by number, not by stamp: clocks may step back, and with them epochs
    fresh = estimate.informative and (window.epoch != state.last[0] or window.first_seq >= state.last[1])
    if not fresh or trusted.holds:
        return state, [trusted] if trusted.holds or state.told is not Kind.DATA_QUALITY else []
    state = dataclasses.replace(state, last=(window.epoch, window.first_seq + window.samples))
    seen = Seen.of(estimate)
    if state.baseline is None:
        return _learn(state, seen, rule), [trusted]
    return _step(state, state.baseline, seen, rule)


def _learn(state: DriftState, seen: Seen, rule: DriftRule) -> DriftState:
    """Windows that follow one another faster than a pace are counted, but not all taken: a baseline spans days."""
    state = dataclasses.replace(state, offered=state.offered + 1)
    if state.learned and abs(seen.start_ns - state.learned[-1].start_ns) < rule.pace_ns:
        return state
    learned = (*state.learned, seen)[-4 * rule.baseline_windows :]
    if len(learned) < rule.baseline_windows:
        return dataclasses.replace(state, learned=learned)
    baseline = learn(list(learned), rule.baseline_windows, rule.min_change, rule.units)
    if baseline is None:
        return dataclasses.replace(state, learned=learned)
    often = max(state.offered / len(learned), 1.0)  # every window is looked at, not only those a pace apart
    baseline = dataclasses.replace(baseline, steps_per_year=baseline.steps_per_year * often)
    return dataclasses.replace(state, learned=(), offered=0, baseline=baseline)


def _step(state: DriftState, baseline: Baseline, seen: Seen, rule: DriftRule) -> tuple[DriftState, list[Finding]]:
    numbers = numbers_of(seen, baseline.speeds, baseline.extra, baseline.parts)
    if numbers is None:
        return _pass_over(state, baseline, seen, rule)
    step = _remembered(seen, *numbers, baseline.away(seen.conditions))
    after = dataclasses.replace(_with(state, step, rule), passed_run=0)
    recent = after.recent
    looked, residuals = look_back(baseline, recent)
    bars = bars_of(baseline, looked, rule)
    after, jam = _judge_jam(state, after, baseline, looked, residuals, bars, rule)
    if jam is not None:
        return after, _findings(Kind.JAM, jam)
    middle = REFERENCES // 2
    change = float(residuals[-1, middle] / baseline.channels[middle].scale)
    after = dataclasses.replace(after, trend=added(after.trend, seen.end_ns, change))
    return _conclude(after, baseline, looked, bars, rule)


def _with(state: DriftState, step: Step, rule: DriftRule) -> DriftState:
    """The memory with one more window; within a pace of the one before the last, it takes the place of the last.

    So a change is seen with the first window that has it, and longer means reach over days, as the baseline does.
    """
    recent = state.recent
    if len(recent) > 1 and abs(recent[-1].start_ns - recent[-2].start_ns) < rule.pace_ns:
        return dataclasses.replace(state, recent=(*recent[:-1], step))
    return dataclasses.replace(state, recent=(*recent, step)[-LONGEST:], fresh=min(state.fresh + 1, LONGEST))


def _remembered(seen: Seen, values: Floats, errors: Floats, away: Floats) -> Step:
    def short(x: Floats) -> tuple[float, ...]:
        return tuple(float(f"{one:.{DIGITS}g}") for one in x)

    told = tuple(one if np.isfinite(one) else None for one in short(values))
    return Step(seen.start_ns, seen.end_ns, told, short(errors), short(away))


def _pass_over(state: DriftState, baseline: Baseline, seen: Seen, rule: DriftRule) -> tuple[DriftState, list[Finding]]:
    """The axis moves at other speeds than when the baseline was learned: nothing can be compared."""
    run = state.passed_run + 1
    state = dataclasses.replace(state, passed_over=state.passed_over + 1, passed_run=run)
    evidence = {
        "cause": "speed range", "windows": run, "fastest": seen.curve.fastest,
        "speeds": list(baseline.speeds), "speed_unit": rule.speed_unit,
    }  # fmt: skip
    return state, [Finding(Kind.OPERATING_POINT, True, evidence)] if run >= PASSED_OVER else []


def _judge_jam(
    before: DriftState,
    after: DriftState,
    baseline: Baseline,
    looked: Looked,
    residuals: Floats,
    bars: Floats,
    rule: DriftRule,
) -> tuple[DriftState, dict[str, Any] | None]:
    """A sudden rise within one window, of dry friction; it lasts until half of the rise is gone.

    The windows of a jam stay out of the memory: they would only repeat it.
    """
    middle = REFERENCES // 2
    normal, now = float(abs(baseline.friction[middle])), float(residuals[-1, middle])
    level = before.before_jam
    if level is None and before.told is None and len(residuals) > 1:
        usual = float(np.median(residuals[-1 - RECENT : -1, middle]))
        limit = bar(rule.false_alarms_per_year * SPENT_ON_JAM, baseline.steps_per_year, baseline.fit.dof)
        if now - usual >= rule.jam_rise * normal and looked.t[0, middle] >= max(limit, bars[0, middle]):
            verdict = explain(baseline, looked, 0, rule)
            if max(verdict.kinds, key=lambda kind: verdict.kinds[kind]) == Kind.WEAR:
                level = usual
                after = dataclasses.replace(after, onset_ns=after.recent[-1].start_ns)
    elif level is not None and now - level < rule.jam_rise * normal / 2:
        level = None
    if level is None:
        return dataclasses.replace(after, before_jam=None), None
    verdict = explain(baseline, looked, 0, rule)
    predicted = float(after.recent[-1].values[middle] or 0.0) - now
    evidence = {
        "before": predicted + level,
        "now": predicted + now,
        "relative": (now - level) / (predicted + level) if predicted + level else None,
        "deviation": float(looked.t[0, middle]),
        "speed": baseline.speeds[middle],
        "speed_unit": rule.speed_unit,
        "unit": rule.force_unit,
        "since_ns": after.onset_ns,
        "cause": "sudden",
        "rivals": with_jam(verdict),
        "score": verdict.kinds.get("wear", 0.0),
    }
    kept = dataclasses.replace(after, recent=before.recent, fresh=0, before_jam=level, told=Kind.JAM)
    return kept, evidence


def _conclude(
    state: DriftState, baseline: Baseline, looked: Looked, bars: Floats, rule: DriftRule
) -> tuple[DriftState, list[Finding]]:
    """Raise where a change stands out and is worth telling, return when it is gone; explain it; else learn."""
    floors = np.array([one.floor for one in baseline.channels])
    worth = _rising(baseline, looked) & (np.abs(looked.mean) > floors)
    height = np.where(worth, np.abs(looked.t) / bars, 0.0)
    told = state.told is not None and state.told is not Kind.JAM
    alike = _alike(looked, bars)
    drifting = _lasts(baseline, looked, floors, alike) if told else bool(height.max() > 1.0)
    if told and not drifting:  # back to normal: what came before must not be seen again in long means
        if state.told in (Kind.WEAR, Kind.LUBRICATION):
            state = dataclasses.replace(state, baseline=_taught(state, baseline))
        state = dataclasses.replace(state, recent=state.recent[-STAYS_WINDOWS:], told=None)
        return dataclasses.replace(state, fresh=0, onset_ns=0), _findings(None, {})
    if not drifting:
        finding = uncovered(baseline, looked, bars, worth, state, rule)
        state = dataclasses.replace(state, told=None, onset_ns=0)
        if finding is not None:  # remembered like the others: so it is learned what friction does there
            return state, _findings(Kind.OPERATING_POINT, finding)
        return _refine(state, baseline, looked, floors), _findings(None, {})
    if told:
        height = np.where(alike[:, None], height, 0.0)
    if not height.any():  # lasts, though no single look-back tells it any more
        height = np.where(np.isfinite(floors), np.abs(looked.t) / bars, 0.0)
    m, index = (int(k) for k in np.unravel_index(int(np.argmax(height)), height.shape))
    verdict = explain(baseline, looked, m, rule)
    name = baseline.channels[index].name
    if "." in name:  # a parameter of a promoted effect says itself what grows
        verdict = Verdict({Kind.WEAR.value: 1.0}, {name: 1.0}, ())
    kind = state.told if told and state.told and not alike[0] else _kind(verdict.kinds, state.told)
    onset = state.onset_ns if state.told is not None and state.onset_ns else state.recent[-1 - m].start_ns
    state = dataclasses.replace(state, told=kind, onset_ns=onset, fresh=0)
    index = _plainest(height[m], looked.mean[m], index)
    return state, _findings(kind, evidence_of(state, baseline, looked, m, index, height, verdict, kind, rule))


def _plainest(height: Floats, mean: Floats, index: int) -> int:
    """Which number says it to people: the strongest that moves with friction itself.

    A matched filter for one part may well move against a change of the other. Heights (J,), deviations (J,).
    """
    friction = [*range(len(SHAPES)), *range(len(mean) - len(PARTS), len(mean))]
    along = [j for j in friction if height[j] > 0.0 and mean[j] * mean[REFERENCES // 2] > 0.0]
    return max(along, key=lambda j: float(height[j])) if index in friction and along else index


def _taught(state: DriftState, baseline: Baseline) -> Baseline:
    """The baseline after a change that went as it came: so far this axis wanders by itself.

    After a repair a new baseline is due; without one, the axis is watched a little less closely than it could be.
    """
    episode = tuple(step for step in state.recent[:-STAYS_WINDOWS] if step.start_ns >= state.onset_ns)
    if not episode:
        return baseline
    _, residuals = look_back(baseline, episode)
    return wandered(baseline, residuals)


def _rising(baseline: Baseline, looked: Looked) -> Any:
    """All deviations, but of the unexplained force only rises: less of it is no news. (m, J)"""
    news = np.ones(looked.mean.shape, dtype=np.bool_)
    if (index := baseline.index(UNEXPLAINED)) is not None:
        news[:, index] = looked.mean[:, index] > 0
    return news


def _lasts(baseline: Baseline, looked: Looked, floors: Floats, alike: Any) -> bool:
    """Whether a change that was told is still there, over as few windows as can tell, all of them `alike`."""
    rows = np.arange(len(looked.mean))[:, None]
    sharp = (STAYS_ERRORS * looked.error < STAYS * floors) & (rows >= STAYS_WINDOWS - 1) & alike[:, None]
    last = int(np.flatnonzero(alike)[-1])
    first = np.where(sharp.any(axis=0), sharp.argmax(axis=0), last)
    columns = np.arange(len(floors))
    mean, t = looked.mean[first, columns], looked.t[first, columns]
    rising = _rising(baseline, looked)[first, columns]
    return bool((rising & (np.abs(mean) > STAYS * floors) & (np.abs(t) > STAYS_ERRORS)).any())


def _alike(looked: Looked, bars: Floats) -> Any:
    """Look-backs whose mean is still true of the latest windows: what has ended meanwhile explains nothing. (m,)

    The first of them, of one window, says whether the latest is like those before it.
    """
    short = min(STAYS_WINDOWS, len(looked.mean)) - 1
    watched = np.isfinite(bars[0])
    apart = np.abs(looked.mean - looked.mean[short])[:, watched]
    allowed = np.where(np.arange(len(apart))[:, None] < short, looked.near, looked.near[short])[:, watched]
    found = (apart <= bars[:, watched] * allowed).all(axis=1)
    found[short:] = np.logical_and.accumulate(found[short:])
    return found


def _refine(state: DriftState, baseline: Baseline, looked: Looked, floors: Floats) -> DriftState:
    """Let windows that turned out healthy refine the baseline."""
    watched = np.isfinite(floors)
    calm = float(np.abs(looked.t[:, watched])[_rising(baseline, looked)[:, watched]].max(initial=0.0)) < CALM
    if not calm or state.fresh < BLOCK + SETTLING:
        return state
    first = len(state.recent) - state.fresh
    block = state.recent[first : first + BLOCK]
    values, errors, away = arrays_of(block)
    sure = (errors**2 <= 4.0 * np.array(baseline.usual) + 1e-12).all(axis=1) & np.isfinite(values).all(axis=1)
    state = dataclasses.replace(state, fresh=state.fresh - BLOCK)
    if sure.sum() < BLOCK // 2:
        return state
    moved = refined(baseline, away[sure] + baseline.moments.mean_x, values[sure], block[-1].end_ns)
    shift = moved.moments.mean_x - baseline.moments.mean_x
    recent = tuple(
        dataclasses.replace(step, away=tuple((np.array(step.away) - shift).tolist())) for step in state.recent
    )
    return dataclasses.replace(state, baseline=moved, recent=recent)


def _kind(scores: dict[str, float], told: Kind | None) -> Kind:
    """The likeliest class; one already told stays until a rival is sure."""
    best = max(scores, key=lambda name: scores[name])
    if told is not None and told.value in scores and scores[best] < SURE:
        return told
    return Kind(best)


def _findings(kind: Kind | None, evidence: dict[str, Any]) -> list[Finding]:
    """One finding for every kind of change; only `kind` holds."""
    return [Finding(one, one is kind, evidence if one is kind else {}) for one in CHANGES]


def indicators(state: DriftState, estimate: Estimate, rule: DriftRule) -> list[dict[str, Any]]:
    """The numbers watched, at this window, for subscribers and the history; empty while learning."""
    baseline = state.baseline
    if baseline is None or not estimate.informative:
        return []
    seen = Seen.of(estimate)
    numbers = numbers_of(seen, baseline.speeds, baseline.extra, baseline.parts)
    if numbers is None:
        return []
    step = _remembered(seen, *numbers, baseline.away(seen.conditions))
    latest = bool(state.recent) and state.recent[-1].end_ns == step.end_ns  # windows of a jam are not remembered
    looked, _ = look_back(baseline, state.recent if latest else _with(state, step, rule).recent)
    expected = baseline.moments.mean_y + np.array(step.away) @ baseline.fit.slopes
    up, down = towards(baseline, looked, bars_of(baseline, looked, rule))
    found: list[dict[str, Any]] = [
        {
            "name": one.name,
            "unit": one.unit,
            "value": float(numbers[0][i]),
            "ci95": [float(numbers[0][i] + sign * 1.96 * numbers[1][i]) for sign in (-1, 1)],
            "baseline": float(expected[i]),
            "baseline_error": float(np.sqrt(max(looked.error[0, i] ** 2 - baseline.fit.variance[i], 0.0))),
            "deviation": float(looked.t[0, i]),
            "smallest_change": one.floor,
            "sum_up": float(up[i]),
            "sum_down": float(down[i]),
        }
        for i, one in enumerate(baseline.channels)
        if np.isfinite(one.floor) and np.isfinite(numbers[0][i])
    ]
    middle = REFERENCES // 2
    for one in found:
        if one["name"] == UNEXPLAINED:  # a logarithm inside, for it grows by factors; newtons for everybody else
            usual = lacking(one["baseline"], float(expected[middle]))
            one |= {"unit": rule.force_unit, "value": lacking(one["value"], float(numbers[0][middle])), "ci95": None}
            one |= {"baseline": usual, "baseline_error": usual * one["baseline_error"]}
            one["smallest_change"] = usual * float(np.expm1(one["smallest_change"]))
    return found
