"""Back-up while it is written, restore, upgrade from every version with data, export."""

import csv
import dataclasses
import json
import shutil
import sqlite3
import subprocess
import threading

import numpy as np
import pytest
from alembic import command
from alembic.script import ScriptDirectory
from sqlalchemy import text

from monitor.alarms import Alarm, AlarmRule, Event, advance
from monitor.cli import app  # noqa: F401  registers the commands
from monitor.cli.app import run_command
from monitor.database import make_engine
from monitor.errors import DatabaseError
from monitor.queries import Reader
from monitor.schema import alembic_config, schema_of
from monitor.store import Store
from monitor.store_backup import back_up, restore
from monitor.store_records import AlarmRecord, Change
from plant.errors import InputError
from tests.monitor.test_queries import fill
from tests.monitor.test_store import journal

DAY_NS = 86_400 * 10**9
ALERT = {"since_ns": 5, "kind": "wear", "axis": "axis-1", "id": "site/axis-1/wear/1"}


@pytest.fixture
def kept(history_url):
    """A history with 40 answers and an acknowledged alarm; its URL."""
    times = 10**15 + np.arange(40) * DAY_NS // 4
    store, axis = fill(history_url, times, np.linspace(90, 99, 40))
    alarm, transition = advance(Alarm(), Event.HOLDS, 5, AlarmRule())
    record = AlarmRecord("wear", alarm, 1, ALERT)
    store.save_alarms(axis.id, [record], [Change(transition, record)])
    store.close()
    return history_url


def what_it_says(url):
    with Reader(url) as reader:
        return reader.history("axis-1"), reader.alerts("axis-1"), reader.transitions("axis-1"), reader.axes()


def test_a_restored_back_up_says_the_same_on_another_machine(kept, tmp_path):
    if not kept.startswith("sqlite"):
        pytest.skip("of a server's history there is pg_dump, below")
    before = what_it_says(kept)
    copy = tmp_path / "back-up"
    assert back_up(kept, copy) == copy.stat().st_size
    with pytest.raises(InputError, match="exists already"):
        back_up(kept, copy)
    other = tmp_path / "other" / "var"
    url = f"sqlite:///{other / 'tribowatch.db'}"
    assert restore(copy, url) is None
    assert what_it_says(url) == before
    Store(url).close()  # a daemon can go on with it
    moved = restore(copy, url)
    assert (moved.name, copy.exists()) == ("tribowatch.before-restore-1.db", True)
    assert what_it_says(f"sqlite:///{moved}") == what_it_says(url) == before


def test_a_back_up_is_one_moment_while_the_daemon_writes(tmp_path):
    url = f"sqlite:///{tmp_path / 'history.db'}"
    store = Store(url)
    axis, _ = journal(store, 0, 20)
    stop, copies = threading.Event(), []

    def copy():
        while not stop.is_set() and len(copies) < 20:
            copies.append(tmp_path / f"copy-{len(copies)}.db")
            back_up(url, copies[-1])

    thread = threading.Thread(target=copy)
    thread.start()
    for k in range(1, 80):
        journal(store, 20 * k, 20 * (k + 1), axis)
    stop.set()
    thread.join()
    store.close()
    seen = []
    for one in copies:
        with Reader(f"sqlite:///{one}") as reader:
            seen.append((reader.axis("axis-1").samples, reader.axis("axis-1").windows))
    assert seen
    assert all(samples == 20 * windows for samples, windows in seen)
    assert not list(tmp_path.glob("*.part"))


def test_what_is_no_back_up_is_refused_and_the_history_stays(kept, tmp_path):
    garbage, empty = tmp_path / "garbage", tmp_path / "empty"
    garbage.write_bytes(b"GIF89a" * 500)
    sqlite3.connect(empty).close()
    if not kept.startswith("sqlite"):
        with pytest.raises(InputError, match="pg_restore"):
            restore(garbage, kept)
        return
    before = what_it_says(kept)
    cut, whole = tmp_path / "cut", tmp_path / "whole"
    back_up(kept, whole)
    cut.write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
    for wrong in (garbage, cut):
        with pytest.raises(InputError, match="no sound back-up"):
            restore(wrong, kept)
    with pytest.raises(DatabaseError, match="no history of tribowatch"):
        restore(empty, kept)
    with pytest.raises(InputError, match="cannot be written: No such file"):
        back_up(kept, tmp_path / "nowhere" / "copy.db")
    assert not list(tmp_path.rglob("*.part"))
    with pytest.raises(InputError, match="no such back-up"):
        restore(tmp_path / "none", kept)
    assert what_it_says(kept) == before


@pytest.mark.skipif(shutil.which("pg_dump") is None, reason="pg_dump is not installed here")
def test_a_history_on_a_server_is_dumped(postgres, tmp_path):
    url = postgres.database()
    fill(url, 10**15 + np.arange(3) * DAY_NS, np.ones(3))[0].close()
    copy = tmp_path / "history.dump"
    back_up(url, copy)
    listed = subprocess.run(["pg_restore", "--list", copy], capture_output=True, text=True, check=True).stdout
    assert "roll_up" in listed
    with pytest.raises(DatabaseError):
        back_up(url.replace("tribowatch@", "nobody@"), tmp_path / "other.dump")


# --- upgrade ----------------------------------------------------------------------------------------------------

RELEASED = [script.revision for script in ScriptDirectory.from_config(alembic_config()).walk_revisions()]
ALERT = {
    "schema_version": 1, "id": "site/axis-1/wear/1", "site": "site", "axis": "axis-1", "kind": "wear",
    "state": "acknowledged", "priority": "medium", "since": "1970-01-01T00:00:00.000Z", "since_ns": 5,
    "consequence": "the drive works harder", "likely_cause": "worn guide", "recommended_action": "inspect guide",
    "text": "axis-1: friction rose", "evidence": {},
}  # fmt: skip
OLD = {  # rows as version 0001 wrote them
    "axis": "1, 'axis-1', true, 'N', 'm', 100, 20, 0, null, '{}', null",
    "alarm": '1, 1, \'wear\', \'acknowledged\', 1, \'{"state": "acknowledged", "since_ns": 5, "active": true, '
    f'"against": 0, "against_ns": 0, "until_ns": null}}\', \'{json.dumps(ALERT)}\'',
    "transition": f"1, 1, 'wear', 'holds', 'normal', 'unacknowledged', 5, '', '{json.dumps(ALERT)}', true",
}
COLUMNS = {
    "axis": "id, name, listed, force_unit, position_unit, last_ns, samples, missing, stream, rejected, drift",
    "alarm": "id, axis_id, kind, state, occurrence, machine, alert",
    "transition": "id, axis_id, kind, event, before, after, at_ns, author, alert, published",
    "window": "id, axis_id, epoch, first_seq, samples, start_ns, end_ns, done",
    "estimate": "window_id, axis_id, start_ns, end_ns, verdict, method, evaluations, seed, software, data_sha256, "
    "seconds, result, conditions, drift",
    "parameter": "window_id, name, axis_id, end_ns, value, low, high, unit, identifiable, at_bound",
}


def old_history(url, revision):
    """A history as `revision` has it: written by 0001, then upgraded up to there."""
    engine = make_engine(url)
    with engine.begin() as connection:
        command.upgrade(alembic_config(connection), "0001")

        def put(table, values):
            connection.execute(text(f'insert into "{table}" ({COLUMNS[table]}) values ({values})'.replace(":", "\\:")))

        for table, values in OLD.items():
            put(table, values)
        for k in range(30):
            end = 10**15 + k * DAY_NS // 3
            verdict = "identified" if k % 3 else "not_informative"
            put("window", f"{k + 1}, 1, 1, {10 * k}, 10, {end - 9}, {end}, true")
            put(
                "estimate",
                f"{k + 1}, 1, {end - 9}, {end}, '{verdict}', 'ga', 1, 0, '0.1.0', 'x', 0.1, '{{}}', '{{}}', '[]'",
            )
            if k % 3:
                put("parameter", f"{k + 1}, 'F', 1, {end}, {90 + k}, {89 + k}, {91 + k}, 'N', true, false")
    with engine.begin() as connection:
        command.upgrade(alembic_config(connection), revision)
    engine.dispose()


@pytest.mark.parametrize("revision", RELEASED)
def test_every_version_is_upgraded_with_its_data(history_url, revision):
    old_history(history_url, revision)
    assert len(schema_of(history_url).pending) == RELEASED.index(revision)
    store = Store(history_url)
    assert store.alarms(1)["wear"].alarm == Alarm("acknowledged", 5, True)
    store.close()
    with Reader(history_url) as reader:
        assert reader.axis("axis-1").verdicts == {"identified": 20, "not_informative": 10}
        series = reader.history("axis-1", points=5)["series"]["F"]
        assert (series["unit"], series["answers"]) == ("N", 20)
        assert [one["state"] for one in reader.alerts()] == ["acknowledged"]
        assert len(list(reader.answers("axis-1"))) == 20


def test_upgrade_backs_up_first_and_check_only_looks(tmp_path, capsys):
    path = tmp_path / "tribowatch.db"
    old_history(f"sqlite:///{path}", "0001")

    def upgrade(*words):
        assert run_command(["upgrade", "--state-dir", str(tmp_path), "--json", *words]) == 0
        return json.loads(capsys.readouterr().out)

    before = path.read_bytes()
    looked = upgrade("--check")
    assert (looked["from"], looked["to"], looked["backup"]) == ("0001", RELEASED[0], None)
    assert len(looked["steps"]) == len(RELEASED) - 1
    assert path.read_bytes() == before
    assert run_command(["history", "axis-1", "--state-dir", str(tmp_path)]) == 3
    said = capsys.readouterr().err
    assert said.startswith(f"tribowatch history: {path}: schema '0001'")
    assert "tribowatch upgrade" in said
    done = upgrade()
    assert run_command(["alerts", "--json", "--state-dir", str(tmp_path)]) == 0
    assert [one["state"] for one in json.loads(capsys.readouterr().out)["alerts"]] == ["acknowledged"]
    assert schema_of(f"sqlite:///{done['backup']}").current == "0001"
    assert upgrade() == {**done, "from": RELEASED[0], "steps": [], "backup": None}


def test_a_newer_history_is_refused_in_one_line(kept, tmp_path, capsys):
    engine = make_engine(kept)
    with engine.begin() as connection:
        connection.execute(text("update alembic_version set version_num = '9999'"))
    engine.dispose()
    config = tmp_path / "tribowatch.toml"
    config.write_text(f'site = "test"\n[history]\ndatabase = "{kept}"\n')
    for words in (["upgrade"], ["run"], ["history", "axis-1"]):
        assert run_command([*words, "--config", str(config)]) == 3
        out, err = capsys.readouterr()
        assert out == ""
        assert "newer than this program" in err.splitlines()[-1]


# --- export -----------------------------------------------------------------------------------------------------


def test_an_export_holds_every_answer(kept, tmp_path, capsys):
    config = tmp_path / "tribowatch.toml"
    config.write_text(f'site = "test"\n[history]\ndatabase = "{kept}"\n')
    with Reader(kept) as reader:
        points = reader.history("axis-1", parameter="F")["series"]["F"]["points"]
        recent = list(reader.answers("axis-1", since_ns=DAY_NS))
    for name in ("out.csv", "out.parquet"):
        words = ["history", "axis-1", "--export", str(tmp_path / name), "--config", str(config), "--json"]
        assert run_command(words) == 0
        assert json.loads(capsys.readouterr().out)["rows"] == 40
    with (tmp_path / "out.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [float(row["value"]) for row in rows] == [one["value"] for one in points]
    assert [row["time"] for row in rows] == [one["t"] for one in points]
    assert [[float(row["ci95_low"]), float(row["ci95_high"])] if row["ci95_low"] else None for row in rows] == [
        one["ci95"] for one in points
    ]
    pq = pytest.importorskip("pyarrow.parquet")
    table = pq.read_table(tmp_path / "out.parquet").to_pylist()
    assert [row["value"] for row in table] == [one["value"] for one in points]
    assert {row["axis_version"] for row in table} == {1}
    assert len(recent) == 5
    assert run_command(["history", "axis-1", "--export", str(tmp_path / "out.xls"), "--config", str(config)]) == 2
    assert ".csv or .parquet" in capsys.readouterr().err


def test_alarms_written_before_can_be_read(history_url):
    old_history(history_url, "0001")
    store = Store(history_url)
    alarm = store.alarms(1)["wear"].alarm
    assert dataclasses.replace(alarm, recent=3).recent == 3
    store.close()
