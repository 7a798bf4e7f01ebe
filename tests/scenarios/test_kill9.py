"""Killed at random moments, the daemon keeps what it acknowledged, and says what it did not receive."""

import json

import pytest

from tests.scenarios.kill9 import run
from tests.scenarios.kill9_account import WRONG


def check(report):
    print(json.dumps(report, indent=1))
    assert {name: report[name] for name in WRONG} == dict.fromkeys(WRONG, 0)
    assert report["integrity"] == "ok"
    assert report["received"] > 0
    assert report["windows"] > 3


def test_kill_9_loses_nothing_acknowledged_and_doubles_nothing(tmp_path):
    check(run(tmp_path, kills=5, seed=3))


@pytest.mark.slow
def test_kill_9_on_postgresql_and_of_postgresql(tmp_path, postgres):
    check(run(tmp_path, kills=4, seed=4, server=postgres))


@pytest.mark.slow
def test_kill_9_at_twenty_random_moments(tmp_path):
    check(run(tmp_path, kills=20, seed=20, victims=("daemon",)))
