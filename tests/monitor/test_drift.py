"""The promise of the watch: false alarms at or below the setting, changes found soon, nothing small ever told."""

import dataclasses
import json

import numpy as np
import pytest
from scipy import stats

from monitor.drift import DriftRule, DriftState, Kind, indicators, judge
from tests.monitor.estimates import DAY_NS, estimate
from tests.monitor.watching import delay_of, raised, watch

RULE = DriftRule()
DRY = ("coulomb", "static")


@pytest.mark.parametrize(("rate", "years"), [(1.0, 12), (10.0, 12)])
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


def test_a_rise_of_viscous_friction_by_a_tenth_is_found_though_friction_at_mid_speed_hardly_moves():
    delays = []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        state, _ = watch(RULE, (estimate(k, rng, temperature=21.0) for k in range(40)))
        _, held = watch(RULE, (estimate(k, rng, temperature=21.0, viscous=1.1) for k in range(40, 60)), state)
        delays.append(delay_of(held))
    assert np.median(delays) <= 3


@pytest.mark.parametrize("factor", [0.9, 1.3])
def test_an_alert_shows_a_number_that_moves_with_friction(factor):
    """A filter for one part may move against a change of the other: true, and of no use to people."""
    for seed in range(4):
        rng = np.random.default_rng([70, seed])
        state, _ = watch(RULE, (estimate(k, rng, scatter=0.003, error=0.002) for k in range(25)))
        for k in range(25, 32):
            state, findings = judge(state, estimate(k, rng, scatter=0.003, error=0.002, coulomb=factor), RULE)
        known = next(one.evidence for one in findings if one.holds)
        assert (known["indicator_now"] - known["indicator_baseline"]) * known["relative"] > 0.0


def test_a_baseline_spans_days_however_often_windows_come():
    """A window a minute: what wanders over hours must be part of the scatter, and longer means reach over hours."""
    rng = np.random.default_rng(12)
    rule = DriftRule(baseline_span=86400.0)
    wander = 1 + 0.05 * np.sin(2 * np.pi * np.arange(6000) / 1440)  # a daily cycle

    def windows(count):
        return (estimate(k, rng, every_ns=60 * 10**9, coulomb=wander[k], static=wander[k]) for k in range(count))

    state, held = watch(rule, windows(1700))
    baseline = state.baseline
    assert (baseline.to_ns - baseline.from_ns) / 86400e9 > 0.98
    assert baseline.steps_per_year == pytest.approx(365.25 * 1440, rel=0.05)  # every window is looked at
    assert raised(held) == 0
    apart = np.diff([step.start_ns for step in state.recent[:-1]])
    assert (apart >= rule.pace_ns).all()


@pytest.mark.parametrize(("growth", "latest"), [(1.05, 3), (1.1, 1), (1.15, 1)])
def test_a_step_of_dry_friction_is_found_within_windows_and_called_wear(growth, latest):
    delays, kinds = [], []
    for seed in range(15):
        rng = np.random.default_rng(seed)
        state, _ = watch(RULE, (estimate(k, rng) for k in range(40)))
        change = dict.fromkeys(DRY, growth)
        _, held = watch(RULE, (estimate(k, rng, **change) for k in range(40, 60)), state)
        delays.append(delay_of(held))
        kinds.append(held[delays[-1] - 1])
    assert np.median(delays) <= latest
    assert kinds.count({Kind.WEAR}) >= 13


def test_what_is_smaller_than_the_smallest_change_is_never_told_however_sure():
    for growth, told in ((1.02, False), (1.05, True)):
        rng = np.random.default_rng(11)
        quiet = {"scatter": 0.002, "error": 0.002}
        state, _ = watch(RULE, (estimate(k, rng, **quiet) for k in range(100)))
        change = dict.fromkeys(DRY, growth)
        state, held = watch(RULE, (estimate(k, rng, **quiet, **change) for k in range(100, 160)), state)
        assert any(held) is told


def test_slow_wear_is_found_before_it_has_doubled_the_smallest_change():
    found = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        state, _ = watch(RULE, (estimate(k, rng) for k in range(80)))
        ramp = [dict.fromkeys(DRY, 1 + 0.001 * k) for k in range(200)]
        _, held = watch(RULE, (estimate(80 + k, rng, **change) for k, change in enumerate(ramp)), state)
        found.append(0.001 * next(n for n, now in enumerate(held) if Kind.WEAR in now))
    assert np.median(found) < 2 * RULE.min_change


def test_the_alarm_goes_when_the_friction_is_back():
    rng = np.random.default_rng(1)
    worn = dict.fromkeys(DRY, 1.15)
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
    assert state.told is None


def test_what_rises_within_one_window_is_a_jam_and_the_same_over_weeks_is_wear():
    rng = np.random.default_rng(3)
    state, _ = watch(RULE, (estimate(k, rng) for k in range(30)))
    sudden = [estimate(k, rng, **dict.fromkeys(DRY, 1.35)) for k in range(30, 40)]
    slow = [estimate(k, rng, **dict.fromkeys(DRY, 1 + 0.35 * (k - 30) / 30)) for k in range(30, 60)]
    assert watch(RULE, sudden, state)[1][0] == {Kind.JAM}
    assert watch(RULE, slow, state)[1][-1] == {Kind.WEAR}


def test_windows_that_tell_nothing_change_nothing():
    rng = np.random.default_rng(3)
    state, _ = watch(RULE, (estimate(k, rng) for k in range(30)))
    empty = [estimate(30 + k, verdict="not_informative") for k in range(10)]
    after, held = watch(RULE, empty, state)
    assert dataclasses.replace(after, quality=state.quality) == state
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
    worn = [estimate(k, rng, **dict.fromkeys(DRY, 1.15)) for k in range(31, 40)]
    assert watch(RULE, [future, *worn], state)[1][-1] == {Kind.WEAR}


def test_one_wild_window_is_forgotten_at_once():
    for seed in range(5):
        rng = np.random.default_rng(seed)
        state, _ = watch(RULE, (estimate(k, rng) for k in range(30)))
        wild = [estimate(30, rng, **dict.fromkeys(DRY, 1.4)), *(estimate(k, rng) for k in range(31, 36))]
        assert watch(RULE, wild, state)[1][1:] == [set()] * 5


def test_a_slower_axis_stays_comparable_and_a_much_slower_one_is_another_operating_point():
    rng = np.random.default_rng(5)
    state, _ = watch(RULE, (estimate(k, rng) for k in range(30)))
    assert state.baseline.speeds[-1] < 0.8 * 0.5

    def short(k):
        one = estimate(k, rng)
        cut = {n: getattr(one.curve, n)[:8] for n in ("speeds", "values", "low", "high")}
        return dataclasses.replace(one, curve=dataclasses.replace(one.curve, **cut))

    after, held = watch(RULE, [short(k) for k in range(30, 36)], state)
    assert after.passed_over == 6
    assert after.recent == state.recent
    assert held[:4] == [set()] * 4
    assert held[-1] == {Kind.OPERATING_POINT}
    assert watch(RULE, [estimate(40, rng)], after)[1] == [set()]


def test_the_state_survives_json():
    rng = np.random.default_rng(6)
    for windows in (5, 25, 40):
        grown = [
            estimate(k, rng, temperature=20 + k % 5, latent=0.8, constant=0.1, **({"coulomb": 1.15} if k > 30 else {}))
            for k in range(windows)
        ]
        state, _ = watch(RULE, grown)
        back = DriftState.from_dict(json.loads(json.dumps(state.to_dict())))
        assert back == state
        more = [
            estimate(k, np.random.default_rng(k), temperature=22.0, latent=0.8, constant=0.1) for k in range(50, 55)
        ]
        assert watch(RULE, more, back)[0].to_dict() == watch(RULE, more, state)[0].to_dict()


def test_a_state_of_an_older_program_is_learned_anew():
    assert DriftState.from_dict({"learned": [], "baseline": {"windows": 20}, "up": [1.0]}) == DriftState()


def test_indicators_say_where_an_estimate_stands():
    rng = np.random.default_rng(7)
    state, _ = watch(RULE, (estimate(k, rng, latent=0.8, constant=0.0) for k in range(25)))
    told = {one["name"]: one for one in indicators(state, estimate(25, coulomb=1.2, static=1.2, latent=0.8), RULE)}
    assert told["friction at mid speed"]["deviation"] > 5
    assert told["friction at mid speed"]["sum_up"] > 1 > told["friction at mid speed"]["sum_down"]
    assert told["friction at mid speed"]["ci95"][0] < told["friction at mid speed"]["value"]
    assert told["friction at mid speed"]["smallest_change"] == pytest.approx(
        0.03 * told["friction at mid speed"]["baseline"], rel=1e-6
    )
    unexplained = told["unexplained force"]
    assert abs(unexplained["deviation"]) < 2
    assert (unexplained["unit"], unexplained["ci95"]) == ("N", None)
    assert unexplained["value"] == pytest.approx(0.8)  # newtons, not the logarithm that is watched
    assert unexplained["baseline"] == pytest.approx(0.8, rel=0.2)
    assert unexplained["smallest_change"] == pytest.approx(unexplained["baseline"], rel=0.1)  # it has doubled
    assert "constant force" not in told  # this window did not tell it
    assert indicators(DriftState(), estimate(0), RULE) == []


def test_the_baseline_says_how_sure_it_is_and_learns_on_while_healthy():
    rng = np.random.default_rng(8)
    state, _ = watch(RULE, (estimate(k, rng, scatter=0.02, error=0.01) for k in range(25)))
    baseline = state.baseline
    assert baseline.windows == 20
    assert baseline.steps_per_year == pytest.approx(365.25, rel=0.01)
    assert baseline.to_ns == 19 * DAY_NS + 20 * 10**9
    assert np.sqrt(baseline.fit.variance[2]) / baseline.friction[2] == pytest.approx(0.0224, rel=0.5)
    later, held = watch(RULE, (estimate(k, rng, scatter=0.02, error=0.01) for k in range(25, 300)), state)
    assert not any(held)
    assert later.baseline.windows == 80  # the level stands, slopes and scatter go on
    assert later.baseline.fit.dof > 200


def test_a_change_that_hovers_at_the_floor_does_not_chatter():
    """The dead-band: told above the floor, gone below six tenths of it."""
    often = []
    for seed in range(4):
        rng = np.random.default_rng([14, seed])
        state, _ = watch(RULE, (estimate(k, rng) for k in range(60)))
        change = dict.fromkeys(DRY, 1 + 0.9 * RULE.min_change)
        _, held = watch(RULE, (estimate(k, rng, **change) for k in range(60, 180)), state)
        often.append(raised(held))
    assert np.mean(often) <= 4  # in four months; without the dead-band every third window turns it


def test_an_axis_whose_friction_comes_and_goes_by_itself_is_told_fewer_and_fewer_times():
    """4 % more friction on ten days of fifty: what went as it came is how this axis is."""
    early = late = 0
    for seed in range(4):
        rng = np.random.default_rng([8, seed])
        lives = (
            estimate(k, rng, scatter=0.008, error=0.002, **dict.fromkeys(DRY, 1.04 if k % 50 > 39 and k > 60 else 1.0))
            for k in range(760)
        )
        _, held = watch(RULE, lives)
        early, late = early + raised(held[:400]), late + raised(held[400:])
    assert early >= 4
    assert late <= early / 2
