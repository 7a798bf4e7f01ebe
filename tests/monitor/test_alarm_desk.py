"""Races and restarts of alarms, with a real history: nothing is lost, doubled or shown when it should not be."""

import dataclasses

import pytest

from monitor.alarm_desk import AlarmDesk
from monitor.alarms import State
from monitor.commands import Command
from monitor.config import Config
from monitor.drift import Finding, Kind
from monitor.fleet import Fleet
from monitor.operate import Floor, operate
from monitor.queries import Reader
from monitor.store import Store
from plant.presets import paper_axis

HOUR = 3_600 * 10**9
START = 1_767_225_600 * 10**9
JAM = Finding(Kind.JAM, True, {"speed": 0.1, "speed_unit": "m/s", "before": 97.0, "now": 190.0, "unit": "N"})
GONE = Finding(Kind.JAM, False)


class Site:
    """A daemon without its streams: stops and starts on one history; both clocks are set by the test."""

    def __init__(self, url, axes=("axis-1",)):
        self.url, self.event, self.wall = url, START, START
        self.told = []
        self.axes = {name: dataclasses.replace(paper_axis(), name=name) for name in axes}
        self.start()

    def start(self):
        config = Config(site="site", alarms={"off_windows": 1})
        self.store = Store(self.url)
        desk = AlarmDesk(config, self.store, lambda *told: self.told.append(told), lambda: self.wall)
        self.floor = Floor(config, self.store, Fleet(config, self.axes, self.store, 0.0), desk, lambda: self.wall)
        for run in self.floor.fleet:
            run.record.last_ns = self.event

    def restart(self, down=0):
        """Stop, and start `down` later; the stream goes on when the test says so."""
        self.store.close()
        self.wall += down
        self.start()

    def pass_time(self, event=0, wall=None):
        self.event += event
        self.wall += event if wall is None else wall
        for run in self.floor.fleet:
            run.record.last_ns = self.event
            self.floor.alarms.tick(run)

    def observe(self, *findings, axis="axis-1"):
        run = self.floor.fleet.runs[axis]
        touched, changes = self.floor.alarms.observe(run, findings, self.event)
        self.floor.alarms.tell(run, self.store.save_alarms(run.record.id, touched, changes), changes)

    def do(self, action, axis="axis-1", kind="jam", author="Ada", **arguments):
        return operate(self.floor, Command(action, axis, {"kind": kind, **arguments}, author))

    def state(self, axis="axis-1", kind="jam"):
        return self.floor.fleet.runs[axis].alarms[kind].alarm.state

    def audit(self):
        with Reader(self.url) as reader:
            moved = [one["transition"] for one in reader.transitions()]
        return [(one["event"], one["after"], one["author"]) for one in moved]


@pytest.fixture
def site(history_url):
    one = Site(history_url)
    yield one
    one.store.close()


WAYS = {
    State.UNACKNOWLEDGED: [],
    State.ACKNOWLEDGED: [("acknowledge", {})],
    State.RETURNED_UNACKNOWLEDGED: [GONE],
    State.NORMAL: [("acknowledge", {}), GONE],
    State.SHELVED: [("shelve", {"for": "8h"})],
    State.SUPPRESSED: [("suppress", {})],
    State.OUT_OF_SERVICE: [("out-of-service", {})],
}


def test_a_restart_finds_alarms_in_every_state_as_they_were(history_url):
    site = Site(history_url, axes=[state.value for state in WAYS])
    for state, steps in WAYS.items():
        site.observe(JAM, axis=state.value)
        for step in steps:
            if isinstance(step, Finding):
                site.observe(step, axis=state.value)
            else:
                site.do(step[0], axis=state.value, **step[1])
    before = {name: run.alarms["jam"] for name, run in site.floor.fleet.runs.items()}
    audit = site.audit()
    site.restart(down=HOUR)
    site.pass_time()
    assert {name: run.alarms["jam"] for name, run in site.floor.fleet.runs.items()} == before
    assert {name: record.alarm.state.value for name, record in before.items()} == {name: name for name in before}
    assert site.audit() == audit
    for name in before:  # and they go on from there
        site.observe(GONE, axis=name)
    after = {name: site.state(axis=name) for name in before}
    aside = {"shelved", "suppressed", "out_of_service", "normal"}
    assert after == {
        "unacknowledged": "returned_unacknowledged", "acknowledged": "normal",
        "returned_unacknowledged": "returned_unacknowledged", **{name: name for name in aside},
    }  # fmt: skip
    site.store.close()


def test_acknowledged_twice_it_is_audited_once_also_over_a_restart(site):
    site.observe(JAM)
    assert site.do("acknowledge")["changed"]
    assert not site.do("acknowledge", author="Bob")["changed"]
    site.restart()
    assert not site.do("acknowledge", author="Cy")["changed"]
    assert site.audit() == [("holds", "unacknowledged", ""), ("acknowledge", "acknowledged", "Ada")]


def test_a_shelf_that_expires_while_the_daemon_is_down_ends_when_it_is_back(site):
    site.observe(JAM)
    site.do("shelve", **{"for": "8h"})
    site.restart(down=7 * HOUR)
    site.pass_time(event=0)
    assert site.state() is State.SHELVED
    site.restart(down=2 * HOUR)  # the machine was off all the time: no sample moved the event clock
    site.pass_time(event=0)
    assert site.state() is State.UNACKNOWLEDGED
    assert site.audit()[-1] == ("tick", "unacknowledged", "")
    site.pass_time(event=0)
    assert len(site.audit()) == 3


def test_a_shelf_ends_by_event_time_when_a_year_is_replayed_in_an_hour(site):
    site.observe(JAM)
    site.do("shelve", **{"for": "8h"})
    site.pass_time(event=7 * HOUR, wall=10**9)
    assert site.state() is State.SHELVED
    site.pass_time(event=2 * HOUR, wall=10**9)
    assert site.state() is State.UNACKNOWLEDGED


def test_clocks_that_step_back_neither_raise_nor_free_nor_trap_anything(site):
    site.observe(JAM)
    site.do("shelve", **{"for": "8h"})
    site.pass_time(event=-1000 * HOUR, wall=-5 * HOUR)
    site.observe(JAM)
    site.pass_time(event=HOUR)
    assert site.state() is State.SHELVED
    site.pass_time(event=0, wall=-20 * HOUR)  # so far that the shelf would last for days
    assert site.state() is State.UNACKNOWLEDGED
    assert site.do("acknowledge")["state"] == "acknowledged"
    site.observe(GONE)
    assert [after for _, after, _ in site.audit()] == [
        "unacknowledged", "shelved", "unacknowledged", "acknowledged", "normal",
    ]  # fmt: skip


def test_out_of_service_before_it_ever_rose_nothing_is_shown_and_nothing_is_lost(site):
    site.do("out-of-service")
    site.observe(JAM)
    site.restart(down=HOUR)
    with Reader(site.url) as reader:
        assert [one["state"] for one in reader.alerts()] == ["out_of_service"]
    assert site.do("in-service", author="Bob")["state"] == "unacknowledged"
    assert "190 N" in site.told[-1][2]["alert"]["text"]
    assert site.told[-1][2]["transition"]["author"] == "Bob"


@pytest.mark.parametrize("span", ["0h", "31d"])
def test_shelving_is_for_a_limited_time(site, span):
    from monitor.errors import QueryError

    site.observe(JAM)
    with pytest.raises(QueryError, match=r"not possible: more than 0, at most 4\.29 w"):
        site.do("shelve", **{"for": span})
