"""Killed at random moments, the daemon keeps what it acknowledged, and says what it did not receive."""

import json

import pytest

from tests.scenarios.kill9 import WRONG, run


def check(report):
    assert {name: report[name] for name in WRONG} == dict.fromkeys(WRONG, 0)
    assert report["integrity"] == "ok"
    assert report["received"] > 0
    assert report["windows"] > 5


def test_kill_9_loses_nothing_acknowledged_and_doubles_nothing(tmp_path):
    check(run(tmp_path, kills=5, seed=3))


@pytest.mark.slow
def test_kill_9_on_postgresql(tmp_path, postgres):
    check(run(tmp_path, kills=2, seed=4, database=postgres.database()))


@pytest.mark.slow
def test_kill_9_at_twenty_random_moments(tmp_path):
    report = run(tmp_path, kills=20, seed=20)
    print(json.dumps(report, indent=1))
    check(report)
