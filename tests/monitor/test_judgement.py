"""From findings to alerts: raised once, brought up to date, returned, and explained with numbers."""

import json

import numpy as np
import pytest

from monitor.alarms import AlarmRule, Event, State
from monitor.alerts import ADVICE, explain
from monitor.drift import DriftRule, DriftState, Finding, Kind, judge
from monitor.judgement import apply, command
from tests.monitor.estimates import estimate

RULE = AlarmRule(off_count=2)


@pytest.fixture(scope="module")
def findings():
    """Findings of thirty healthy and ten worn windows."""
    rng, state, got = np.random.default_rng(0), DriftState(), []
    for k in range(40):
        worn = {"coulomb": 1.2, "static": 1.2} if k >= 30 else {}
        state, found = judge(state, estimate(k, rng, **worn), DriftRule())
        got.append(found)
    return got


def test_an_alert_is_raised_once_and_brought_up_to_date(findings):
    alarms, changes, texts = {}, [], []
    for now, found in enumerate(findings):
        _, changed = apply("site", "axis-1", alarms, found, now, RULE)
        changes += changed
        if Kind.WEAR.value in alarms:
            texts.append(alarms["wear"].alert["text"])
    assert [(one.record.kind, one.transition.after) for one in changes] == [("wear", State.UNACKNOWLEDGED)]
    alert = alarms["wear"].alert
    assert alert["id"] == "site/axis-1/wear/1"
    assert alert["since_ns"] == changes[0].transition.at_ns
    assert len(set(texts)) > 1
    json.dumps(alert, allow_nan=False)
    for word in ("axis-1", "N", "%", "windows", "wear", "lubrication", "axis-year"):
        assert word in alert["text"]


def test_a_healthy_axis_has_no_alarms(findings):
    alarms = {}
    for now, found in enumerate(findings[:30]):
        assert apply("site", "axis-1", alarms, found, now, RULE) == ([], [])
    assert alarms == {}


def test_returned_and_raised_again_is_a_new_occurrence_only_after_normal(findings):
    alarms = {}
    holds = next(one for one in findings[-1] if one.kind is Kind.WEAR)
    gone = Finding(Kind.WEAR, False)
    states = []
    for now, finding in enumerate([holds, gone, gone, holds, gone, gone]):
        apply("site", "axis-1", alarms, [finding], now, RULE)
        states.append((alarms["wear"].alarm.state.value, alarms["wear"].occurrence))
    assert states == [("unacknowledged", 1)] * 2 + [
        ("returned_unacknowledged", 1), ("unacknowledged", 1), ("unacknowledged", 1), ("returned_unacknowledged", 1),
    ]  # fmt: skip
    alarms["wear"], change = command(alarms["wear"], Event.ACKNOWLEDGE, 9, RULE, "Ada")
    assert (change.author, change.transition.after) == ("Ada", State.NORMAL)
    assert alarms["wear"].alert["state"] == "normal"
    apply("site", "axis-1", alarms, [holds], 10, RULE)
    assert (alarms["wear"].occurrence, alarms["wear"].alert["since_ns"]) == (2, 10)


def test_a_command_that_means_nothing_changes_nothing(findings):
    alarms = {}
    apply("site", "axis-1", alarms, findings[-1], 0, RULE)
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
