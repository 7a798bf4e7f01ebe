"""Commands: what they do, whom they refuse, and that every one of them is answered."""

import dataclasses

import pytest

from monitor.alarm_desk import AlarmDesk
from monitor.commands import WAITING, Command, CommandBox
from monitor.config import Config
from monitor.drift import DriftState
from monitor.errors import DatabaseError, QueryError
from monitor.fleet import Fleet
from monitor.operate import ACTIONS, Floor, operate, serve
from monitor.queries import Reader
from monitor.store import Store
from plant.presets import paper_axis

AXIS = dataclasses.replace(paper_axis(), name="axis-1")
NOW = 1_767_225_600 * 10**9


def make_floor(store, axes=(AXIS,)):
    config = Config(site="site")
    desk = AlarmDesk(config, store, lambda *_: None, lambda: NOW)
    return Floor(config, store, Fleet(config, {axis.name: axis for axis in axes}, store, 0.0), desk, lambda: NOW)


@pytest.fixture
def url(history_url):
    return history_url


@pytest.fixture
def floor(url):
    store = Store(url)
    yield make_floor(store)
    store.close()


def do(floor, action, axis="axis-1", author="Ada", **arguments):
    return operate(floor, Command(action, axis, arguments, author))


def test_maintenance_is_remembered_and_begins_a_new_baseline_where_it_should(floor):
    run = floor.fleet.runs["axis-1"]
    run.drift = DriftState(passed_over=3)
    assert do(floor, "event", text="looked at it")["new_baseline"] is False
    assert run.drift.passed_over == 3
    told = do(floor, "event", text="relubricated", kind="lubrication", at="2026-01-02", new_baseline=True)
    assert (told["at"], told["new_baseline"]) == ("2026-01-02T00:00:00.000Z", True)
    assert run.drift == DriftState()
    again = make_floor(floor.store).fleet.runs["axis-1"]
    assert again.drift == DriftState()


def test_renamed_it_keeps_its_history_and_its_alarms(floor, url):
    do(floor, "shelve", kind="wear", **{"for": "8h"})
    row = floor.fleet.runs["axis-1"].record.id
    told = do(floor, "rename", to="press-7")
    assert "press-7" in told["note"]
    assert set(floor.fleet.runs) == {"press-7"}
    assert floor.fleet.of_key("tribowatch/site/press-7/samples").record.id == row
    floor.store.close()
    store = Store(url)
    again = make_floor(store, axes=(dataclasses.replace(AXIS, name="press-7"),)).fleet.runs
    assert set(again) == {"press-7"}
    assert again["press-7"].alarms["wear"].alarm.state == "shelved"
    store.close()


def test_an_axis_that_is_listed_cannot_be_deleted_and_a_stranger_can(floor, url):
    with pytest.raises(QueryError, match="listed in the configuration"):
        do(floor, "delete")
    floor.fleet.of_key("tribowatch/site/stranger/samples")
    assert do(floor, "delete", axis="stranger")["deleted"]
    with Reader(url) as reader:
        assert [axis.name for axis in reader.axes()] == ["axis-1"]
    assert floor.fleet.of_key("tribowatch/site/stranger/samples") is not None  # it may come again


@pytest.mark.parametrize(
    ("action", "axis", "author", "arguments", "said"),
    [
        ("aknowledge", "axis-1", "Ada", {}, "acknowledge"),
        ("acknowledge", "axis-l", "Ada", {"kind": "wear"}, "axis-1"),
        ("acknowledge", "axis-1", "Ada", {}, "needs 'kind'"),
        ("acknowledge", "axis-1", "Ada", {"kind": "waer"}, "wear"),
        ("acknowledge", "axis-1", "Ada", {"kind": "wear"}, "no alarm 'wear'"),
        ("acknowledge", "axis-1", " ", {"kind": "wear"}, "needs an author"),
        ("acknowledge", "axis-1", "Ada", {"kind": "wear", "for": "8h"}, "does not take 'for'"),
        ("acknowledge", "axis-1", "Ada", {"kind": 7}, "must be a text"),
        ("shelve", "axis-1", "Ada", {"kind": "wear"}, "needs 'for'"),
        ("shelve", "axis-1", "Ada", {"kind": "wear", "for": "8 moons"}, "not understood"),
        ("event", "axis-1", "Ada", {"text": "x" * 2000}, "at most 1000"),
        ("event", "axis-1", "Ada", {"text": "x", "at": "yesterday"}, "not understood"),
        ("rename", "axis-1", "Ada", {"to": "alive"}, "alive"),
        ("rename", "axis-1", "Ada", {"to": "axis-1"}, "already"),
    ],
)
def test_what_cannot_be_done_is_said(floor, action, axis, author, arguments, said):
    with pytest.raises(QueryError, match=said):
        operate(floor, Command(action, axis, arguments, author))


def test_when_the_history_is_away_everybody_who_asked_is_told(floor, monkeypatch):
    def away(*_):
        raise DatabaseError("history.db: away")

    monkeypatch.setitem(ACTIONS, "event", away)
    box = CommandBox()
    answers = [box.submit(Command("event", "axis-1", {"text": "oiled"}, "Ada")) for _ in range(3)]
    with pytest.raises(DatabaseError, match="away"):
        serve(floor, box)
    assert [str(one.exception(0)) for one in answers] == ["history.db: away"] * 3


def test_every_command_is_answered_whatever_happens(floor, monkeypatch):
    def broken(*_):
        raise ZeroDivisionError

    monkeypatch.setitem(ACTIONS, "break", broken)
    roused = []
    box = CommandBox(lambda: roused.append(1))
    event = Command("event", "axis-1", {"text": "oiled"}, "Ada")
    answers = [box.submit(one) for one in (event, dataclasses.replace(event, axis="no"), Command("break", "axis-1"))]
    assert len(roused) == 3
    answers[1].cancel()
    serve(floor, box)
    assert answers[0].result(0)["number"] == 1
    with pytest.raises(QueryError, match="log says why"):
        answers[2].result(0)
    for _ in range(WAITING):
        last = box.submit(event)
    with pytest.raises(QueryError, match="busy"):
        box.submit(event).result(0)
    box.close()
    with pytest.raises(QueryError, match="stopping"):
        last.result(0)
    with pytest.raises(QueryError, match="stopping"):
        box.submit(event).result(0)
