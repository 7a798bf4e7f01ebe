"""The history: each window once, restarts, migrations up and down, and databases that are none."""

import contextlib
import dataclasses
import json
import sqlite3
import threading

import numpy as np
import pytest
from alembic import command
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import event, inspect, text

from monitor.alarms import Alarm, AlarmRule, Event, State, advance
from monitor.database import make_engine
from monitor.drift import DriftState
from monitor.errors import DatabaseError, QueryError
from monitor.estimate import Parameter
from monitor.models import Base
from monitor.queries import Reader
from monitor.samples import WindowRule
from monitor.schema import alembic_config, migrate
from monitor.store import Store
from monitor.store_records import AlarmRecord, Change, DiagnosisRecord, EventRecord, VersionRecord
from monitor.store_roll_ups import rebuild_roll_ups
from monitor.windows import Assembler
from plant.presets import paper_axis
from tests.monitor.estimates import estimate
from tests.monitor.test_windows import STEP, run

RULE = WindowRule(samples=20, hop=20, sample_time_ns=STEP)
AXIS = dataclasses.replace(paper_axis(), name="axis-1")


@pytest.fixture
def url(history_url):
    return history_url


@pytest.fixture
def sqlite_url(tmp_path):
    return f"sqlite:///{tmp_path / 'history.db'}"


@pytest.fixture
def store(url):
    one = Store(url)
    yield one
    one.close()


def journal(store, first, end, axis=None):
    """Commit samples `first` to `end`; the axis' record and its new windows."""
    axis = axis or store.register([AXIS])["axis-1"]
    assembler = Assembler(RULE, axis.stream)
    out = assembler.offer(run(first, end), 0.0)
    axis.stream = assembler.state
    axis.samples += end - first
    axis.last_ns = assembler.state.last_ns
    return axis, store.commit([(axis, out)])


def answer(window, **changes):
    one = dataclasses.replace(
        estimate(0), window=window, parameters=(Parameter("coulomb_force", 90.0, "N", 88.0, 92.0),), **changes
    )
    return one


def test_a_window_is_pending_until_its_answer_is_stored(store, url):
    axis, new = journal(store, 0, 45)
    assert [(row, window) for _, row, window in new] == [(row, window) for row, _, window in store.pending()]
    for _, row, window in new:
        store.save(axis, row, answer(window), [], [], [])
    assert store.pending() == []
    with Reader(url) as reader:
        assert reader.axis("axis-1").verdicts == {"identified": 2}


def test_the_same_window_cannot_be_stored_twice(store):
    axis, new = journal(store, 0, 25)
    _, row, window = new[0]
    store.save(axis, row, answer(window), [], [], [])
    with pytest.raises(DatabaseError, match=r"(?i)unique"):
        store.save(axis, row, answer(window), [], [], [])
    with pytest.raises(DatabaseError, match=r"(?i)unique"):
        store.commit([(axis, Assembler(RULE).offer(run(0, 25), 0.0))])


def test_raw_samples_come_back_as_they_were(store):
    axis, new = journal(store, 0, 33)
    samples = store.read(axis.id, new[0][2].id)
    sent = run(0, 20)
    for name in ("t_ns", "drive", "position", "temperature"):
        assert np.array_equal(getattr(samples, name), getattr(sent, name))
    assert samples.velocity is None


def test_a_restart_goes_on_where_it_ended(url):
    first = Store(url)
    journal(first, 0, 30)
    first.close()
    second = Store(url)
    axis = second.register([AXIS])["axis-1"]
    assert (axis.stream.next_seq, axis.samples) == (30, 30)
    _, new = journal(second, 30, 60, axis)
    assert [window.id.first_seq for _, _, window in new] == [20, 40]
    assert [window.id.first_seq for _, _, window in second.pending()] == [0, 20, 40]
    assert len(second.read(axis.id, new[0][2].id)) == 20  # over the restart
    second.close()


def test_pruning_keeps_what_windows_need(store):
    axis, new = journal(store, 0, 50)
    for end in (70, 95):
        axis, more = journal(store, end - 25 if end == 95 else 50, end, axis)
        new += more
    done = new[:2]
    for _, row, window in done:
        store.save(axis, row, answer(window), [], [], [])
    assert store.prune(axis.id, axis.stream.needed_from(), keep_windows=9) == 0
    assert store.prune(axis.id, axis.stream.needed_from(), keep_windows=0) == 0  # window at 40 needs the first block
    for _, row, window in new[2:]:
        store.save(axis, row, answer(window), [], [], [])
    assert store.prune(axis.id, axis.stream.needed_from(), keep_windows=0) == 2
    assert axis.stream.needed_from() == (1, 80)


def test_alarms_and_their_audit_survive(store, url):
    axis, _ = journal(store, 0, 10)
    alert = {"since_ns": 5, "kind": "wear", "axis": "axis-1"}
    alarm, transition = advance(Alarm(), Event.HOLDS, 5, AlarmRule())
    record = AlarmRecord("wear", alarm, 1, alert)
    ids = store.save_alarms(axis.id, [record], [Change(transition, record)])
    assert [number for number, _, _ in store.untold()] == ids
    store.mark_told(ids)
    assert store.untold() == []
    acknowledged, transition = advance(alarm, Event.ACKNOWLEDGE, 9, AlarmRule())
    record = dataclasses.replace(record, alarm=acknowledged)
    store.save_alarms(axis.id, [record], [Change(transition, record, "Ada")])
    store.close()
    again = Store(url)
    assert again.alarms(axis.id) == {"wear": record}
    again.close()
    with Reader(url) as reader:
        assert [one["state"] for one in reader.alerts(active=True)] == [State.ACKNOWLEDGED]
        audit = [(one["transition"]["after"], one["transition"]["author"]) for one in reader.transitions("axis-1")]
        assert audit == [("unacknowledged", ""), ("acknowledged", "Ada")]
        assert reader.transitions(after=ids[0])[0]["transition"]["author"] == "Ada"


def test_migrations_lead_to_the_models_and_back(url):
    engine = make_engine(url)
    migrate(engine, url)
    with engine.connect() as connection:
        context = MigrationContext.configure(connection, opts={"render_as_batch": True})
        assert compare_metadata(context, Base.metadata) == []
    with engine.begin() as connection:
        command.downgrade(alembic_config(connection), "base")
    assert inspect(engine).get_table_names() == ["alembic_version"]
    migrate(engine, url)
    assert set(Base.metadata.tables) < set(inspect(engine).get_table_names())
    engine.dispose()


def test_there_is_one_head():
    assert len(ScriptDirectory.from_config(alembic_config()).get_heads()) == 1


def test_a_schema_of_the_future_is_refused(store, url):
    with store._engine.begin() as connection:
        connection.execute(text("update alembic_version set version_num = '9999'"))
    store.close()
    for open_it in (Store, Reader):
        with pytest.raises(DatabaseError, match="newer than this program"):
            open_it(url)


@pytest.mark.parametrize("open_it", [Store, Reader])
def test_another_programs_database_is_left_alone(tmp_path, open_it):
    path = tmp_path / "history.db"
    with contextlib.closing(sqlite3.connect(path)) as other:
        other.execute("create table bookmarks (url text)")
    with pytest.raises(DatabaseError, match=r"history\.db: holds another program's table 'bookmarks'"):
        open_it(f"sqlite:///{path}")
    with contextlib.closing(sqlite3.connect(path)) as other:
        assert other.execute("select name from sqlite_master").fetchall() == [("bookmarks",)]


@pytest.mark.parametrize("open_it", [Store, Reader])
def test_a_file_that_is_no_database_is_said_so(tmp_path, open_it):
    path = tmp_path / "history.db"
    path.write_bytes(b"GIF89a" * 500)
    with pytest.raises(DatabaseError, match=r"history\.db: this file is not a database"):
        open_it(f"sqlite:///{path}")


def test_a_reader_needs_a_database(tmp_path):
    with pytest.raises(DatabaseError, match="no history database here"):
        Reader(f"sqlite:///{tmp_path / 'none.db'}")


def test_an_empty_database_is_not_a_history(tmp_path):
    sqlite3.connect(tmp_path / "empty.db").close()
    with pytest.raises(DatabaseError, match="schema None is older"):
        Reader(f"sqlite:///{tmp_path / 'empty.db'}")


def test_a_folder_that_is_missing_is_said_so(tmp_path):
    with pytest.raises(DatabaseError, match="does the folder exist"):
        Store(f"sqlite:///{tmp_path / 'no' / 'such' / 'history.db'}")


def test_a_full_disk_is_said_so_and_keeps_what_was_committed(sqlite_url):
    url, store = sqlite_url, Store(sqlite_url)
    axis, _ = journal(store, 0, 20)

    def no_room(connection, _record):
        connection.execute("pragma max_page_count = 1")

    event.listen(store._engine, "connect", no_room)
    store._engine.dispose()

    def fill():
        for k in range(1, 2000):
            journal(store, 20 * k, 20 * (k + 1), axis)

    with pytest.raises(DatabaseError, match="disk is full"):
        fill()
    with Reader(url) as reader:
        assert reader.axis("axis-1").samples >= 20
    store.close()


def test_a_reader_sees_one_snapshot_while_the_writer_goes_on(store, url):
    axis, _ = journal(store, 0, 20)
    begun, done = threading.Event(), threading.Event()
    seen = []

    def look():
        with Reader(url) as reader:
            while not done.is_set():
                one = reader.axis("axis-1")
                seen.append((one.samples, one.windows))
                begun.set()

    thread = threading.Thread(target=look)
    thread.start()
    assert begun.wait(30.0)
    for k in range(1, 60):
        journal(store, 20 * k, 20 * (k + 1), axis)
    done.set()
    thread.join()
    assert all(samples == 20 * windows for samples, windows in seen)


def test_unlisted_axes_are_kept_apart(store, url):
    store.register([AXIS])
    store.add_unknown("stranger")
    with Reader(url) as reader:
        assert [(axis.name, axis.listed) for axis in reader.axes()] == [("axis-1", True), ("stranger", False)]
        json.dumps([axis.to_dict() for axis in reader.axes()])
        with pytest.raises(QueryError, match="axis-1"):
            reader.axis("axis-l")
    store.register([])
    with Reader(url) as reader:
        assert not reader.axis("axis-1").listed


def test_events_versions_diagnoses_and_evidence_come_back(store, url):
    axis = store.register([AXIS])["axis-1"]
    store.add_event(axis, EventRecord(7, "lubrication", "relubricated", "Ada", True))
    row = store.add_diagnosis(
        axis.id, DiagnosisRecord(9, 1, 9, "explained", {"effects": []}, [[1, 0, 20]], 3, "0", 0.5)
    )
    number = store.add_evidence(axis.id, 9, "diagnosis", b"zip", diagnosis_id=row)
    store.add_version(axis, VersionRecord(2, 10, {}, {"rail_defect": {"centre": 0.6}}, "Ada", "promoted"))
    assert (axis.version, store.register([AXIS])["axis-1"].effects) == (2, {"rail_defect": {"centre": 0.6}})
    with Reader(url) as reader:
        assert [(one["text"], one["author"], one["at_ns"]) for one in reader.events("axis-1")] == [
            ("relubricated", "Ada", 7)
        ]
        assert [(one["version"], one["why"]) for one in reader.versions("axis-1")] == [
            (1, "first seen"), (2, "promoted"),
        ]  # fmt: skip
        assert reader.diagnoses("axis-1")[0]["result"] == {"effects": []}
        kept = reader.evidence_list("axis-1")
        assert [(one["number"], one["diagnosis"]) for one in kept] == [(number, row)]
        assert reader.evidence(number) == b"zip"
        with pytest.raises(QueryError, match="no evidence number 99"):
            reader.evidence(99)


def test_a_changed_axis_file_is_a_new_version_and_a_new_baseline(store, url):
    axis, _ = journal(store, 0, 20)
    axis.drift = DriftState(passed_over=2).to_dict()
    store.add_event(axis, EventRecord(1, "maintenance", "oiled", "Ada"))
    assert store.register([AXIS])["axis-1"].version == 1
    heavier = dataclasses.replace(AXIS, mechanics=dataclasses.replace(AXIS.mechanics, M=25.0))
    record = store.register([heavier])["axis-1"]
    assert (record.version, record.drift) == (2, None)
    with Reader(url) as reader:
        version, event = reader.versions("axis-1")[1], reader.events("axis-1")[-1]
    assert version["why"] == "mechanics.M 20 -> 25 kg"
    assert (event["kind"], event["text"], event["new_baseline"]) == ("axis_changed", version["why"], True)
    assert version["from_ns"] == axis.last_ns + 1


def test_a_deleted_axis_leaves_nothing(store, url):
    axis, new = journal(store, 0, 25)
    store.save(axis, new[0][1], answer(new[0][2]), [], [], [])
    store.add_event(axis, EventRecord(7, "lubrication", "relubricated", "Ada"))
    store.delete_axis(axis.id)
    with store._engine.connect() as connection:
        for name in set(Base.metadata.tables):
            assert connection.execute(text(f'select count(*) from "{name}"')).scalar_one() == 0, name


def test_roll_ups_are_what_the_answers_make_and_can_be_made_again(store):
    axis, new = journal(store, 0, 400)
    rng = np.random.default_rng(5)
    for k, (_, row, window) in enumerate(new):
        value = float(rng.normal(90, 5))
        bounds = (value - 1, value + 2) if k % 3 else (None, None)
        start = k * 1_700 * 10**9
        at = dataclasses.replace(window, start_ns=start, end_ns=start + 10**9)
        store.save(
            axis, row, dataclasses.replace(answer(at), parameters=(Parameter("F", value, "N", *bounds),)), [], [], []
        )
    query = text("select * from roll_up order by parameter, span, start_ns")
    with store._engine.begin() as connection:
        kept = connection.execute(query).all()
        rebuild_roll_ups(connection, axis.id, 0, 10**15)
        made = connection.execute(query).all()
    assert len(kept) == len(made) > 8
    for one, other in zip(kept, made, strict=True):
        assert one._mapping == pytest.approx(dict(other._mapping))


AWAY = r"does not answer|was stopped|went away|starting up"


def test_a_server_that_crashes_loses_nothing_committed_and_the_store_goes_on(postgres):
    url = postgres.database()
    store = Store(url)
    axis, new = journal(store, 0, 45)
    _, row, window = new[0]
    store.save(axis, row, answer(window), [], [], [])
    postgres.stop("immediate")
    with pytest.raises(DatabaseError, match=AWAY):
        journal(store, 45, 90, dataclasses.replace(axis))
    with pytest.raises(DatabaseError, match=AWAY):
        Reader(url)
    postgres.start()
    _, more = journal(store, 45, 90, axis)
    assert [window.id.first_seq for _, _, window in store.pending()] == [20, 40, 60]
    assert len(more) == 2
    with Reader(url) as reader:
        assert reader.axis("axis-1").verdicts == {"identified": 1}
        assert reader.history("axis-1")["series"]["coulomb_force"]["answers"] == 1
    store.close()
