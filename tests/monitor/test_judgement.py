"""From findings to alerts: raised once, brought up to date, returned, and explained with numbers."""

import json

import numpy as np
import pytest

from monitor.advice import ADVICE
from monitor.alarms import AlarmRule, Event, State
from monitor.alerts import explain
from monitor.drift import DriftRule, DriftState, Finding, Kind, judge
from monitor.judgement import apply, command, tick
from monitor.store_records import AlarmRecord
from tests.monitor.estimates import estimate

RULE = AlarmRule(off_count=2)


def rule_of(_):
    return RULE


@pytest.fixture(scope="module")
def findings():
    """Findings of thirty healthy and ten worn windows."""
    rng, state, got = np.random.default_rng(0), DriftState(), []
    for k in range(40):
        worn = {"coulomb": 1.15, "static": 1.15} if k >= 30 else {}
        state, found = judge(state, estimate(k, rng, temperature=21.0, **worn), DriftRule())
        got.append(found)
    return got


def test_an_alert_is_raised_once_and_brought_up_to_date(findings):
    alarms, changes, texts = {}, [], []
    for now, found in enumerate(findings):
        _, changed = apply("site", "axis-1", alarms, found, now, rule_of)
        changes += changed
        if Kind.WEAR.value in alarms:
            texts.append(alarms["wear"].alert["text"])
    assert [(one.record.kind, one.transition.after) for one in changes] == [("wear", State.UNACKNOWLEDGED)]
    alert = alarms["wear"].alert
    assert alert["id"] == "site/axis-1/wear/1"
    assert alert["since_ns"] == changes[0].transition.at_ns
    assert len(set(texts)) > 1
    json.dumps(alert, allow_nan=False)
    for word in ("axis-1", "N", "%", "windows", "wear 100%", "axis-year"):
        assert word in alert["text"]


def test_a_healthy_axis_has_no_alarms(findings):
    alarms = {}
    for now, found in enumerate(findings[:30]):
        assert apply("site", "axis-1", alarms, found, now, rule_of) == ([], [])
    assert alarms == {}


def test_returned_and_raised_again_is_a_new_occurrence_only_after_normal(findings):
    alarms = {}
    holds = next(one for one in findings[-1] if one.kind is Kind.WEAR)
    gone = Finding(Kind.WEAR, False)
    states = []
    for now, finding in enumerate([holds, gone, gone, holds, gone, gone]):
        apply("site", "axis-1", alarms, [finding], now, rule_of)
        states.append((alarms["wear"].alarm.state.value, alarms["wear"].occurrence))
    assert states == [("unacknowledged", 1)] * 2 + [
        ("returned_unacknowledged", 1), ("unacknowledged", 1), ("unacknowledged", 1), ("returned_unacknowledged", 1),
    ]  # fmt: skip
    alarms["wear"], change = command(alarms["wear"], Event.ACKNOWLEDGE, 9, RULE, "Ada")
    assert (change.author, change.transition.after) == ("Ada", State.NORMAL)
    assert alarms["wear"].alert["state"] == "normal"
    apply("site", "axis-1", alarms, [holds], 10, rule_of)
    assert (alarms["wear"].occurrence, alarms["wear"].alert["since_ns"]) == (2, 10)


def test_a_command_that_means_nothing_changes_nothing(findings):
    alarms = {}
    apply("site", "axis-1", alarms, findings[-1], 0, rule_of)
    once, _ = command(alarms["wear"], Event.ACKNOWLEDGE, 1, RULE, "Ada")
    twice, change = command(once, Event.ACKNOWLEDGE, 2, RULE, "Bob")
    assert twice == once
    assert change is None


EVIDENCE = {
    Kind.JAM: {"speed": 0.1, "speed_unit": "m/s", "before": 97.0, "now": 190.0, "unit": "N"},
    Kind.DATA_QUALITY: {"windows": 3, "reason": "position is NaN in 2000 of 2000 samples"},
    Kind.STALE: {"silent_ns": 3 * 3600 * 10**9, "last_ns": 0},
}


@pytest.mark.parametrize("kind", EVIDENCE)
def test_every_kind_is_explained_with_its_numbers(kind):
    text = explain("axis-1", kind, EVIDENCE[kind])
    assert text.startswith("axis-1: ")
    assert {Kind.JAM: "97 to 190 N", Kind.DATA_QUALITY: "NaN", Kind.STALE: "3 h"}[kind] in text


@pytest.mark.parametrize("kind", ADVICE)
def test_advice_says_what_to_do(kind):
    advice = ADVICE[kind]
    assert advice.priority in ("low", "medium", "high")
    assert all((advice.consequence, advice.likely_cause, advice.recommended_action))


# --- faults, put aside -------------------------------------------------------------------------------

HOLDS = Finding(Kind.WEAR, True, {"level": 1.2} | dict.fromkeys(("since_ns", "until_ns"), 0) | {
    "speeds": [0.1], "baseline": [90.0], "now": [99.0], "unit": "N", "speed_unit": "m/s", "relative": 0.1,
    "relative_ci95": [0.05, 0.15], "shape": "dry friction", "score": 0.9, "rivals": {"wear": 0.9, "lubrication": 0.1},
    "windows": 5, "baseline_windows": 20, "baseline_error": 0.004, "baseline_scatter": 0.012, "corrected_for": [],
    "indicator": "friction at mid speed", "indicator_unit": "N", "false_alarms_per_axis_year": 1.0,
    "remaining": {"limit": 0.5, "per_day": 0.001, "days": 400.0, "days_low": 300.0, "days_high": None, "refused": None},
})  # fmt: skip
GONE = Finding(Kind.WEAR, False)
BAD = Finding(Kind.DATA_QUALITY, True, {"windows": 3, "reason": "frozen"})
GOOD = Finding(Kind.DATA_QUALITY, False)
ONCE = AlarmRule()


def observe(alarms, *findings, now=0, rule=ONCE, **clock):
    return apply("site", "axis-1", alarms, findings, now, lambda _: rule, **clock)[1]


def said(changes):
    return [(one.record.kind, one.transition.after.value, one.author) for one in changes]


def test_an_axis_fault_inhibits_wear_and_lets_it_go_when_it_is_over():
    alarms = {}
    assert said(observe(alarms, BAD)) == [("data_quality", "unacknowledged", "")]
    assert said(observe(alarms, HOLDS)) == [("wear", "suppressed", "inhibition")]
    assert alarms["wear"].alarm.inhibitor == "data_quality"
    assert alarms["wear"].alert["evidence"]["level"] == 1.2  # its evidence is not lost
    assert observe(alarms, HOLDS) == []
    assert said(observe(alarms, GOOD)) == [
        ("data_quality", "returned_unacknowledged", ""), ("wear", "unacknowledged", "inhibition"),
    ]  # fmt: skip
    assert alarms["wear"].occurrence == 1


def test_what_is_over_before_the_fault_is_was_never_shown():
    alarms = {}
    observe(alarms, BAD)
    observe(alarms, HOLDS)
    observe(alarms, GONE)
    assert said(observe(alarms, GOOD))[-1] == ("wear", "normal", "inhibition")


def test_a_fault_hides_nothing_that_was_shown_and_no_jam():
    alarms = {}
    observe(alarms, HOLDS)
    assert said(observe(alarms, BAD)) == [("data_quality", "unacknowledged", "")]
    assert alarms["wear"].alarm.state is State.UNACKNOWLEDGED
    jam = Finding(Kind.JAM, True, {"speed": 0.1, "speed_unit": "m/s", "before": 97.0, "now": 190.0, "unit": "N"})
    assert said(observe(alarms, jam)) == [("jam", "unacknowledged", "")]


def test_what_an_operator_suppressed_stays_so_when_a_fault_ends():
    alarms = {}
    observe(alarms, HOLDS)
    alarms["wear"], _ = command(alarms["wear"], Event.SUPPRESS, 1, ONCE, "Ada")
    observe(alarms, BAD)
    observe(alarms, GOOD)
    assert alarms["wear"].alarm.state is State.SUPPRESSED


def test_shelved_before_it_ever_rose_it_comes_back_with_its_evidence():
    alarms = {}
    alarms["wear"], _ = command(AlarmRecord("wear"), Event.SHELVE, 0, ONCE, "Ada", 100, 100)
    assert observe(alarms, HOLDS, now=10, wall_ns=10) == []
    touched, changes = tick(alarms, 10, 100, lambda _: ONCE)
    assert said(changes) == [("wear", "unacknowledged", "")]
    assert touched == [alarms["wear"]]
    assert (alarms["wear"].alert["state"], alarms["wear"].alert["since_ns"]) == ("unacknowledged", 10)
    assert alarms["wear"].alert["id"] == "site/axis-1/wear/1"
