"""The promise of the watch: false alarms at or below the setting, changes found soon and called by their name."""

import dataclasses
import json

import numpy as np
import pytest
from scipy import stats

from monitor import cusum
from monitor.baseline import scatter
from monitor.drift import DriftRule, DriftState, Kind, indicators, judge
from tests.monitor.estimates import DAY_NS, estimate

RULE = DriftRule()
DRY = ("coulomb", "static")


def watch(rule, estimates, state=None):
    """State and the kinds that hold after each estimate."""
    state, held = state or DriftState(), []
    for one in estimates:
        state, findings = judge(state, one, rule)
        held.append({finding.kind for finding in findings if finding.holds})
    return state, held


def raised(held):
    """How often something was raised."""
    return sum(bool(now) and not before for before, now in zip([set(), *held[:-1]], held, strict=True))


def exact_run_length(k, h, bins=300):
    """Mean run length of a one-sided CUSUM of standard normal deviates, by Markov chain (Brook & Evans 1972)."""
    edges = np.linspace(0.0, h, bins + 1)
    starts = np.concatenate(([0.0], (edges[1:] + edges[:-1]) / 2))
    cdf = stats.norm.cdf(edges[None, :] - starts[:, None] + k)
    moves = np.column_stack([stats.norm.cdf(k - starts), np.diff(cdf, axis=1)])
    return float(np.linalg.solve(np.eye(bins + 1) - moves, np.ones(bins + 1))[0])


@pytest.mark.parametrize(
    ("k", "h"), [(0.5, 4.0), (0.5, 8.0), (1.0, 3.0), (1.5, 2.5), (2.0, 2.4), (2.5, 1.7), (3.0, 3.0)]
)
def test_the_run_length_is_that_of_a_markov_chain_or_shorter(k, h):
    ratio = float(cusum.run_length(k, h)) / exact_run_length(k, h)
    assert 0.5 < ratio < 1.02


@pytest.mark.parametrize("steps", [365.0, 8766.0, 1.6e6])
@pytest.mark.parametrize("rate", [0.01, 0.1, 1.0])
def test_the_design_meets_its_rate_even_for_an_unsure_baseline(steps, rate):
    k, h = cusum.design(1.0, steps, rate, 20)
    assert cusum.alarms_per_year(k, h, steps, 20) <= rate
    assert cusum.design(1.0, steps, rate, 200)[0] <= k  # more windows, more sure, finer


@pytest.mark.parametrize(("rate", "years"), [(1.0, 25), (10.0, 25)])
def test_false_alarms_stay_at_or_below_the_setting(rate, years):
    """Noisy axes (3 % from window to window, watched for 1 %), one window a day, each with its own baseline."""
    rule = DriftRule(false_alarms_per_year=rate, min_change=0.01)
    count = 0
    for axis in range(years):
        rng = np.random.default_rng([int(rate), axis])
        _, held = watch(rule, (estimate(k, rng, scatter=0.03) for k in range(20 + 365)))
        count += raised(held)
    upper = stats.chi2.ppf(0.975, 2 * (count + 1)) / 2 / years  # 95 % Poisson interval
    assert upper <= rate


@pytest.mark.parametrize(("growth", "latest"), [(1.1, 4), (1.2, 3), (1.5, 3)])
def test_a_step_of_dry_friction_is_found_within_windows_and_called_wear(growth, latest):
    delays, kinds = [], []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        state, _ = watch(RULE, (estimate(k, rng) for k in range(40)))
        change = dict.fromkeys(DRY, growth)
        _, held = watch(RULE, (estimate(k, rng, **change) for k in range(40, 60)), state)
        delays.append(next(n for n, now in enumerate(held, start=1) if now))
        kinds.append(held[delays[-1] - 1])
    assert np.median(delays) <= latest
    assert kinds.count({Kind.WEAR}) >= 18


CHANGES = {
    "guide worn": (dict.fromkeys(DRY, 1.25), Kind.WEAR),
    "Coulomb level alone": ({"coulomb": 1.25}, Kind.WEAR),
    "thicker lubricant": ({"viscous": 1.5}, Kind.LUBRICATION),
    "thinner lubricant": ({"viscous": 0.6}, Kind.LUBRICATION),
    "dry at low speed": ({"static": 1.5}, Kind.LUBRICATION),
    "relubricated": (dict.fromkeys(DRY, 0.85), Kind.LUBRICATION),
    "jammed": (dict.fromkeys(DRY, 2.0), Kind.JAM),
}


@pytest.mark.parametrize("cause", CHANGES)
def test_a_change_is_called_by_its_name(cause):
    change, kind = CHANGES[cause]
    right = 0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        state, _ = watch(RULE, (estimate(k, rng) for k in range(30)))
        _, held = watch(RULE, (estimate(k, rng, **change) for k in range(30, 50)), state)
        right += next((now for now in held if now), set()) == {kind}
    assert right >= 17


def test_slow_wear_is_found_before_it_has_doubled_the_smallest_change():
    found = []
    for seed in range(10):
        rng = np.random.default_rng(seed)
        state, _ = watch(RULE, (estimate(k, rng) for k in range(20)))
        ramp = [dict.fromkeys(DRY, 1 + 0.001 * k) for k in range(300)]
        _, held = watch(RULE, (estimate(20 + k, rng, **change) for k, change in enumerate(ramp)), state)
        found.append(0.001 * next(n for n, now in enumerate(held) if Kind.WEAR in now))
    assert np.median(found) < 2 * RULE.min_change


def test_the_alarm_goes_when_the_friction_is_back():
    rng = np.random.default_rng(1)
    worn = dict.fromkeys(DRY, 1.2)
    estimates = [estimate(k, rng) for k in range(30)] + [estimate(k, rng, **worn) for k in range(30, 60)]
    _, held = watch(RULE, estimates + [estimate(k, rng) for k in range(60, 80)])
    assert held[59] == {Kind.WEAR}
    assert held[-1] == set()


def test_a_jam_lasts_until_it_is_cleared():
    rng = np.random.default_rng(2)
    stuck = dict.fromkeys(DRY, 1.9)
    estimates = [estimate(k, rng) for k in range(30)] + [estimate(k, rng, **stuck) for k in range(30, 35)]
    state, held = watch(RULE, estimates + [estimate(k, rng) for k in range(35, 40)])
    assert held[30:35] == [{Kind.JAM}] * 5
    assert held[35] == set()
    assert max(state.up) == 0.0  # the charts did not take part


def test_windows_that_tell_nothing_change_nothing():
    rng = np.random.default_rng(3)
    state, _ = watch(RULE, (estimate(k, rng) for k in range(30)))
    empty = [estimate(30 + k, verdict="not_informative") for k in range(10)]
    after, held = watch(RULE, empty, state)
    assert after == state
    assert held == [set()] * 10


def test_overlapping_windows_take_one_step():
    rng = np.random.default_rng(4)
    once = [estimate(k, rng) for k in range(30)]
    later = [dataclasses.replace(one.window, id=dataclasses.replace(one.window.id, first_seq=2000 * k + 500))
             for k, one in enumerate(once)]  # fmt: skip
    shifted = [dataclasses.replace(one, window=window) for one, window in zip(once, later, strict=True)]
    interleaved = [one for pair in zip(once, shifted, strict=True) for one in pair]
    assert watch(RULE, interleaved)[0] == watch(RULE, once)[0]


def test_a_clock_that_was_wrong_once_does_not_blind_the_watch():
    rng = np.random.default_rng(9)
    state, _ = watch(RULE, (estimate(k, rng) for k in range(30)))
    future = estimate(30, rng)
    future = dataclasses.replace(future, window=dataclasses.replace(future.window, start_ns=2**62, end_ns=2**62 + 10))
    worn = [estimate(k, rng, **dict.fromkeys(DRY, 1.2)) for k in range(31, 40)]
    assert watch(RULE, [future, *worn], state)[1][-1] == {Kind.WEAR}


def test_one_wild_window_raises_nothing():
    for seed in range(10):
        rng = np.random.default_rng(seed)
        state, _ = watch(RULE, (estimate(k, rng) for k in range(30)))
        wild = [estimate(30, rng, **dict.fromkeys(DRY, 1.4)), *(estimate(k, rng) for k in range(31, 36))]
        assert watch(RULE, wild, state)[1] == [set()] * 6


def test_bad_data_in_a_row_is_a_matter_of_data_quality():
    bad = [estimate(k, verdict="bad_data") for k in range(4)]
    _, held = watch(RULE, [*bad, estimate(4, verdict="not_informative")])
    assert held == [set(), set(), {Kind.DATA_QUALITY}, {Kind.DATA_QUALITY}, set()]


def test_a_slower_axis_stays_comparable_and_a_much_slower_one_is_passed_over():
    rng = np.random.default_rng(5)
    state, _ = watch(RULE, (estimate(k, rng) for k in range(30)))
    assert state.baseline.speeds[-1] < 0.8 * 0.5
    short = estimate(30, rng)
    curve = dataclasses.replace(
        short.curve, **{n: getattr(short.curve, n)[:8] for n in ("speeds", "values", "low", "high")}
    )
    after, _ = watch(RULE, [dataclasses.replace(short, curve=curve)], state)
    assert after.passed_over == 1
    assert after.up == state.up


def test_the_state_survives_json():
    rng = np.random.default_rng(6)
    for windows in (5, 25, 40):
        grown = [estimate(k, rng, **({"coulomb": 1.3} if k > 30 else {})) for k in range(windows)]
        state, _ = watch(RULE, grown)
        assert DriftState.from_dict(json.loads(json.dumps(state.to_dict()))) == state


def test_indicators_say_where_an_estimate_stands():
    rng = np.random.default_rng(7)
    state, _ = watch(RULE, (estimate(k, rng) for k in range(25)))
    told = {one["name"]: one for one in indicators(state, estimate(25, coulomb=1.2, static=1.2))}
    assert told["friction at mid speed"]["deviation"] > 5
    assert told["friction at mid speed"]["ci95"][0] < told["friction at mid speed"]["value"]
    assert indicators(DriftState(), estimate(0)) == []


def test_the_baseline_says_how_sure_it_is():
    rng = np.random.default_rng(8)
    state, _ = watch(RULE, (estimate(k, rng, scatter=0.02, error=0.01) for k in range(25)))
    baseline = state.baseline
    assert baseline.windows == 20
    assert baseline.steps_per_year == pytest.approx(365.25, rel=0.01)
    assert baseline.to_ns == 19 * DAY_NS + 20 * 10**9
    middle = baseline.indicators[1]
    assert np.sqrt(middle.extra + middle.width * (0.01 * middle.mean) ** 2) / middle.mean == pytest.approx(
        0.0224, rel=0.5
    )


@pytest.mark.parametrize(("machine", "identification"), [(1.0, 0.0), (0.0, 1.0), (1.0, 1.0), (0.2, 1.0)])
def test_scatter_is_found_whoever_makes_it(machine, identification):
    """Estimated total standard deviation against the true one, over many baselines of 20 windows."""
    ratios = []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        s = np.full(20, 1.0) * rng.uniform(0.7, 1.3, 20)
        x = 100 + machine * rng.standard_normal(20) + identification * s * rng.standard_normal(20)
        _, extra, width = scatter(x, s)
        true = machine**2 + identification**2 * np.mean(s**2)
        ratios.append(np.sqrt((extra + width * np.mean(s**2)) / true))
    assert 0.9 < np.mean(ratios) < 1.1
