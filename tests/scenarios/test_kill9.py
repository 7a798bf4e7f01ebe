"""Killed at random moments, the daemon keeps what it acknowledged, and says what it did not receive."""

import contextlib
import json
import sqlite3

import pytest

from tests.scenarios.kill9 import main, run
from tests.scenarios.kill9_account import WRONG, Database, account, promise
from tests.scenarios.kill9_publisher import read_ledger


def check(report):
    print(json.dumps(report, indent=1))
    assert {name: report[name] for name in WRONG} == dict.fromkeys(WRONG, 0)
    assert report["integrity"] == "ok"
    assert report["received"] > 0
    assert report["windows"] > 3


def test_twenty_kills_of_four_plants_side_by_side_lose_and_double_nothing(capfd):
    assert main(["--kills", "20", "--plants", "4", "--seed", "3"]) == 0
    report = json.loads(capfd.readouterr().out)
    check(report)
    assert report["kills"] == 20
    assert report["plants"] == 4


def test_the_account_finds_what_is_wrong(tmp_path):
    report = run(tmp_path, kills=2, seed=3, victims=("worker",))
    assert not any(report[name] for name in WRONG)
    assert found_wrong(tmp_path) == {"acknowledged_and_lost", "unaccounted", "windows_wrong", "answers_missing",
                                     "transitions_illegal", "commands_lost"}  # fmt: skip


def found_wrong(folder):
    """What the account says after harm was done to that history: it must be able to see it."""
    database, ledger = Database(f"sqlite:///{folder / 'var' / 'tribowatch.db'}"), read_ledger(folder)
    epoch, first, samples = database.query("select epoch, first_seq, samples from window limit 1")[0]
    promises = [promise(database, (epoch, first + samples))]
    commands = len(database.transitions()) + 1
    axis = database.query("select axis_id from window")[0][0]
    with contextlib.closing(sqlite3.connect(folder / "var" / "tribowatch.db")) as harm, harm:
        harm.execute("delete from block where epoch = ? and seq <= ? and seq + n > ?", (epoch, first, first))
        harm.execute("delete from estimate where window_id = (select min(window_id) from estimate)")
        harm.execute(
            "insert into transition (axis_id, kind, event, before, after, at_ns, author, alert, published)"
            " values (?, 'jam', 'holds', 'acknowledged', 'acknowledged', 0, '', '{}', 1)",
            (axis,),
        )
    report = account(database, ledger, promises, commands)
    return {name for name in WRONG if report[name]}


@pytest.mark.slow
def test_kill_9_on_postgresql_and_of_postgresql(tmp_path, postgres):
    check(run(tmp_path, kills=4, seed=4, server=postgres))


@pytest.mark.slow
def test_kill_9_at_twenty_random_moments(tmp_path):
    check(run(tmp_path, kills=20, seed=20, victims=("daemon",)))
