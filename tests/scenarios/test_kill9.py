"""Killed at random moments, the daemon keeps what it acknowledged, and says what it did not receive."""

from tests.scenarios.kill9 import WRONG, run


def test_kill_9_loses_nothing_acknowledged_and_doubles_nothing(tmp_path):
    report = run(tmp_path, kills=5, seed=3)
    assert {name: report[name] for name in WRONG} == dict.fromkeys(WRONG, 0)
    assert report["integrity"] == "ok"
    assert report["received"] > 0
    assert report["windows"] > 5
