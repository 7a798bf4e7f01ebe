"""The whole daemon on real input: process, Zenoh on loopback, SQLite file, worker processes."""

import contextlib
import json
import os
import signal
import socket
import sqlite3
import time

import numpy as np
import pytest

from monitor.inbox import Inbox, Message
from monitor.queries import Reader
from monitor.service import GRACE
from plant import keys
from plant.publisher import SamplePublisher
from plant.wire import Block, encode_block
from tests.scenarios.harness import SITE, START_NS, STEP_NS, Ear, Plant, blocks_of, burst, wait_for

SMALL = "[drift]\nbaseline_windows = 6\n"
DAY_NS = 86_400 * 10**9


def stream(publisher, plant, growths, first=0, size=100):
    """One test run a day, friction times `growths`."""
    for day, growth in enumerate(growths, start=first):
        torque, position = burst(plant.axis, growth, seed=day)
        for block in blocks_of(publisher.axis_name, publisher.epoch, publisher.next_seq, START_NS + day * DAY_NS,
                               torque, position, size):  # fmt: skip
            publisher.put(block)


@pytest.fixture(scope="module")
def worn(tmp_path_factory):
    """Eight healthy test runs, four with 20 % more dry friction, garbage beside them; what was heard."""
    with Plant(tmp_path_factory.mktemp("worn"), axes=("axis-1", "axis-2"), settings=SMALL) as plant:
        plant.start()
        with plant.session() as session, SamplePublisher(session, SITE, "axis-1") as publisher:
            ear, neighbour = Ear(session), Ear(session, "axis-2")
            throw_garbage(session)
            stream(publisher, plant, [1.0] * 8 + [1.2] * 4)
            wait_for(lambda: len(ear.heard["parameters"]) >= 12, 120, "twelve answers")
            wait_for(lambda: ear.heard["alerts"], 20, "an alert")
            wait_for(lambda: ear.heard["status"][-1]["pending_windows"] == 0, 20, "status")
            wait_for(lambda: neighbour.heard["status"], 20, "status of the neighbour")
            queried = ask(session, "axis-1", "parameters", "parameter=coulomb_force;points=4")
            asked = {
                "history": queried,
                "alerts": ask(session, "axis-1", "alerts", "active"),
                "unknown axis": ask(session, "axis-9", "parameters", ""),
                "unknown word": ask(session, "axis-1", "parameters", "pionts=3"),
            }
            alive = [str(reply.ok.key_expr) for reply in session.liveliness().get(keys.alive_pattern(SITE))]
            yield plant, ear, neighbour, asked, alive
            ear.close()
            neighbour.close()


def throw_garbage(session):
    """What a broken or hostile publisher sends, on a listed and on an unlisted axis."""
    good = encode_block(Block("axis-2", 1, 0, START_NS + np.arange(3) * STEP_NS, np.zeros(3), torque=np.zeros(3)))
    for name in ("axis-2", "stranger"):
        key = keys.samples_key(SITE, name)
        for payload in (b"", b"\xff" * 50, good[:-3], b"{}", os.urandom(2000), good.replace(b"axis-2", b"axis-1")):
            session.put(key, payload, encoding="application/cbor")
        session.put(key, b'{"v": 1, "axis": NaN', encoding="application/json")
        session.put(key, good, encoding="text/plain")


def ask(session, axis, what, parameters):
    selector = keys.history_key(SITE, axis, what) + ("?" + parameters if parameters else "")
    replies = list(session.get(selector, timeout=10.0))
    assert len(replies) == 1
    one = replies[0]
    return json.loads((one.ok or one.err).payload.to_bytes())


def test_every_window_is_identified_published_and_stored(worn):
    plant, ear, *_ = worn
    windows = [one["window"]["first_seq"] for one in ear.heard["parameters"]]
    assert windows == [2000 * k for k in range(12)]
    with Reader(plant.url) as reader:
        axis = reader.axis("axis-1")
        points = reader.history("axis-1", parameter="coulomb_force")["series"]["coulomb_force"]["points"]
    assert axis.verdicts == {"identified": 12}
    assert axis.samples == 24000
    assert axis.missing == 0
    published = [one["parameters"]["coulomb_force"]["value"] for one in ear.heard["parameters"]]
    assert [point["value"] for point in points] == published
    assert points[0]["t_ns"] == START_NS + 1999 * STEP_NS  # event time


def test_the_friction_is_that_of_the_machine(worn):
    _, ear, *_ = worn
    coulomb = np.array([one["parameters"]["coulomb_force"]["value"] for one in ear.heard["parameters"]])
    assert np.median(coulomb[:8]) == pytest.approx(90.0, rel=0.03)
    assert np.median(coulomb[8:]) == pytest.approx(108.0, rel=0.03)


def test_wear_is_raised_explained_and_audited(worn):
    plant, ear, *_ = worn
    first = ear.heard["alerts"][0]
    assert (first["kind"], first["transition"]["after"]) == ("wear", "unacknowledged")
    alert = first["alert"]
    assert START_NS + 8 * DAY_NS <= alert["since_ns"] <= START_NS + 10 * DAY_NS
    assert "friction at" in alert["text"]
    for field in ("priority", "consequence", "likely_cause", "recommended_action", "evidence"):
        assert alert[field]
    with Reader(plant.url) as reader:
        assert [one["kind"] for one in reader.alerts("axis-1", active=True)] == ["wear"]
        audit = reader.transitions("axis-1")
    assert [(one["transition"]["before"], one["transition"]["after"]) for one in audit] == [
        ("normal", "unacknowledged")
    ]


def test_status_acknowledges_what_is_committed(worn):
    _, ear, *_ = worn
    status = ear.heard["status"][-1]
    assert status["committed"]["seq"] == 23999
    assert status["listed"]
    assert status["baseline"]["complete"]


def test_the_model_is_published_for_feed_forward(worn):
    _, ear, *_ = worn
    model = ear.heard["model"][-1]
    assert model["law"] == "stribeck"
    assert set(model["parameters"]) >= {"coulomb_force", "static_force", "stribeck_velocity", "viscous_coefficient"}


def test_garbage_is_counted_by_reason_and_harms_nobody(worn):
    plant, ear, neighbour, *_ = worn
    status = neighbour.heard["status"][-1]
    assert sum(status["rejected"].values()) == 8
    assert status["samples"] == 0
    assert status["rejected"]["wrong_axis"] == 1
    assert ear.heard["status"][-1]["rejected"] == {}
    with Reader(plant.url) as reader:
        assert not reader.axis("stranger").listed


def test_history_and_alerts_by_query(worn):
    *_, asked, _ = worn
    series = asked["history"]["series"]["coulomb_force"]
    assert series["answers"] == 12
    assert len(series["points"]) <= 4
    assert asked["alerts"]["alerts"][0]["kind"] == "wear"
    assert "axis-9" in asked["unknown axis"]["error"]
    assert "pionts" in asked["unknown word"]["error"]


def test_the_daemon_shows_that_it_is_alive(worn):
    *_, alive = worn
    assert alive == [keys.alive_key(SITE, "daemon")]


def test_a_second_daemon_on_the_same_state_is_refused(worn):
    plant, *_ = worn
    code, said = plant.try_another()
    assert code == 3
    assert "another daemon" in said


@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
def test_it_stops_within_5_s_keeps_what_arrived_and_resumes(tmp_path, number, code):
    with Plant(tmp_path, settings="[identification]\nworkers = 1\n") as plant:
        plant.start()
        with plant.session() as session, SamplePublisher(session, SITE, "axis-1") as publisher:
            ear = Ear(session)
            stream(publisher, plant, [1.0] * 4)
            wait_for(lambda: ear.committed() >= 7999, 30, "acknowledged")
            plant.terminate(number)  # the promised 5 s are `GRACE`'s: by its own clock the daemon ends hard then
            assert GRACE < 5.0
            assert plant.process.returncode == code
            plant.start()
            # by query: what is answered before this client is linked again, no subscriber hears
            wait_for(lambda: _answered(plant) == 4, 60, "the windows that were on the way")
            ear.close()
        plant.terminate()
        with Reader(plant.url) as reader:
            axis = reader.axis("axis-1")
        assert (axis.windows, axis.pending, axis.samples, axis.missing) == (4, 0, 8000, 0)


def _answered(plant):
    with Reader(plant.url) as reader:
        axis = reader.axis("axis-1")
    return 0 if axis.pending else axis.windows


def test_silence_is_stale_and_data_end_it(tmp_path):
    with Plant(tmp_path, settings="[intake]\nstale_after = 1.5\n") as plant:
        plant.start()
        with plant.session() as session, SamplePublisher(session, SITE, "axis-1") as publisher:
            ear = Ear(session)
            stream(publisher, plant, [1.0])
            wait_for(lambda: ear.heard["alerts"], 30, "stale")
            stream(publisher, plant, [1.0], first=1)
            wait_for(lambda: len(ear.heard["alerts"]) >= 2, 30, "no longer stale")
            ear.close()
    after = [(one["kind"], one["transition"]["after"]) for one in ear.heard["alerts"][:2]]
    assert after == [("stale", "unacknowledged"), ("stale", "returned_unacknowledged")]


def test_same_data_same_answers_whatever_the_number_of_workers(tmp_path):
    answers = []
    for workers in (1, 2):
        folder = tmp_path / str(workers)
        folder.mkdir()
        settings = f"[identification]\nworkers = {workers}\n[window]\nsamples = 500\nhop = 500\n"
        with Plant(folder, settings=settings) as plant:
            plant.start()
            with plant.session() as session, SamplePublisher(session, SITE, "axis-1", epoch=7) as publisher:
                stream(publisher, plant, [1.0, 1.1], size=70 * workers)
                wait_for(lambda plant=plant: len(stored(plant)) >= 8, 120, "eight answers")
            answers.append(stored(plant))
    assert answers[0] == answers[1]


def stored(plant):
    """The answers in the history, which one cannot come too late to hear."""
    with contextlib.closing(sqlite3.connect(plant.folder / "var" / "tribowatch.db")) as db:
        asked = "select result, seed, data_sha256 from estimate order by start_ns"
        rows = db.execute(asked).fetchall()
    return [(json.loads(result)["parameters"], seed, sha256) for result, seed, sha256 in rows]


FAULTS = {
    "port in use": ("in use", 3),
    "not a database": ("not a database", 3),
    "state directory is a file": ("state directory", 3),
    "read-only state directory": ("make it writable", 3),
    "unknown key": ("did you mean 'samples'", 2),
    "no axis file": ("axis-1.toml", 2),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_what_is_wrong_at_the_start_is_said_in_one_line(tmp_path, fault):
    words, code = FAULTS[fault]
    with Plant(tmp_path) as plant, socket.socket() as other:
        if fault == "port in use":
            other.bind(("127.0.0.1", plant.port))
            other.listen()
        elif fault == "not a database":
            (tmp_path / "var").mkdir()
            (tmp_path / "var" / "tribowatch.db").write_text("what is this? " * 500)
        elif fault == "state directory is a file":
            (tmp_path / "var").write_text("")
        elif fault == "read-only state directory":
            if os.geteuid() == 0:
                pytest.skip("root may write everywhere")
            (tmp_path / "var").mkdir(mode=0o500)
        elif fault == "unknown key":
            plant.config.write_text(plant.config.read_text() + "\n[window]\nsampels = 3\n")
        else:
            (tmp_path / "axis-1.toml").unlink()
        plant.launch()
        plant.process.wait(30)
        lines = plant.log.strip().splitlines()
        assert plant.process.returncode == code
        assert words in lines[-1]
        assert "Traceback" not in plant.log


def test_messages_that_do_not_fit_the_queue_are_counted_not_hidden():
    inbox = Inbox(3)
    for _ in range(5):
        inbox.put(Message("t/s/a/samples", "application/cbor", b"", time.monotonic()))
    messages, dropped = inbox.take(10, 0.0)
    assert len(messages) == 3
    assert dropped == {"t/s/a/samples": 2}
