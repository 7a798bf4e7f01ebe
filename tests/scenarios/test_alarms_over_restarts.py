"""Alarms over restarts of a real daemon: every state, commands twice, shelves that end while it is down, wrong clocks.

`tests/monitor/test_alarm_desk.py` has the same races on both databases without process and streams. Prints its table
with `pytest -s -m slow`.
"""

import time

import pytest

from monitor.command_zenoh import send_command
from monitor.commands import Command
from monitor.queries import Reader
from plant import keys
from plant.publisher import SamplePublisher
from tests.scenarios.harness import SITE, START_NS, Plant, blocks_of, burst, wait_for

pytestmark = pytest.mark.slow
HOUR, DAY_NS = 3_600.0, 86_400 * 10**9
SAMPLES = 1000
SETTINGS = f"""
[window]
samples = {SAMPLES}
hop = {SAMPLES}
[drift]
baseline_windows = 6
[alarms]
off_windows = 1
[identification]
workers = 1
"""
ORDERS = {
    "unacknowledged": [],
    "acknowledged": ["acknowledge"],
    "returned_unacknowledged": [],
    "normal": ["acknowledge"],
    "shelved": ["shelve"],
    "suppressed": ["suppress"],
    "out_of_service": ["out-of-service"],
}
GONE = ("returned_unacknowledged", "normal")  # axes whose jam is cleared before the restart
HEALTHY = 7


class Clocked(Plant):
    """A daemon whose wall clock the test sets."""

    module = "tests.scenarios.daemon_on_another_clock"

    def clock(self, error):
        """Wrong by `error` from now on. [s]"""
        part = self.folder / "clock.part"
        part.write_text(str(error))
        part.replace(self.folder / "clock")


class Site:
    """The axes, named after the state they are to be in, their streams, and one who operates them."""

    def __init__(self, plant, session):
        self.plant, self.session = plant, session
        self.publishers = {name: SamplePublisher(session, SITE, name) for name in ORDERS}
        self.day = dict.fromkeys(ORDERS, 0)

    def send(self, name, growth, day=None):
        """One burst, a day after the one before, or on another `day`."""
        publisher = self.publishers[name]
        begin = START_NS + (self.day[name] if day is None else day) * DAY_NS
        torque, position = burst(self.plant.axis, growth, samples=SAMPLES, seed=self.day[name])
        for block in blocks_of(name, publisher.epoch, publisher.next_seq, begin, torque, position):
            publisher.put(block)
        self.day[name] += 1

    def settle(self):
        """Until every burst is answered."""

        def settled():
            with Reader(self.plant.url) as reader:
                axes = [reader.axis(name) for name in ORDERS]
            return all(one.windows == self.day[one.name] and not one.pending for one in axes)

        wait_for(settled, 120, "answers")

    def restart(self, stop=Plant.kill, clock=None):
        """Stop it, let `clock` be wrong [s], start it; back when this client is linked again and all is answered."""
        stop(self.plant)
        if clock is not None:
            self.plant.clock(clock)
        self.plant.start()
        daemon = keys.alive_pattern(SITE)
        wait_for(lambda: list(self.session.liveliness().get(daemon, timeout=2.0)), 60, "linked again")
        self.settle()

    def order(self, name, action, author="Ada"):
        arguments = {"kind": "jam"} | ({"for": "8h"} if action == "shelve" else {})
        return send_command(self.session, SITE, keys.PREFIX, Command(action, name, arguments, author))

    def states(self):
        with Reader(self.plant.url) as reader:
            return {one["axis"]: one["state"] for one in reader.alerts() if one["kind"] == "jam"}

    def audit(self):
        with Reader(self.plant.url) as reader:
            moved = [(one["axis"], one["kind"], one["transition"]) for one in reader.transitions()]
        return [(axis, kind, one["event"], one["after"], one["author"]) for axis, kind, one in moved]

    def becomes(self, name, state):
        wait_for(lambda: self.states()[name] == state, 30, f"{name} {state}, is {self.states()[name]}")


@pytest.fixture(scope="module")
def told():
    """What was seen, for the table."""
    rows = []
    yield rows
    print()
    for what, seen in rows:
        print(f"{what:78s} {seen}")


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    with Clocked(tmp_path_factory.mktemp("alarms"), axes=tuple(ORDERS), settings=SETTINGS) as plant:
        plant.start()
        with plant.session() as session:
            one = Site(plant, session)
            for day in range(HEALTHY + 1):
                for name in ORDERS:
                    one.send(name, 1.6 if day == HEALTHY else 1.0)
            one.settle()
            assert one.states() == dict.fromkeys(ORDERS, "unacknowledged")
            for name, orders in ORDERS.items():
                for action in orders:
                    assert one.order(name, action)["changed"]
            for name in GONE:
                one.send(name, 1.0)
            one.settle()
            yield one
            for publisher in one.publishers.values():
                publisher.__exit__(None, None, None)


def test_each_state_survives_kill_and_stop(site, told):
    assert site.states() == {name: name for name in ORDERS}
    before, audit = site.states(), site.audit()
    for how, stop in (("kill -9", Plant.kill), ("SIGTERM", Plant.terminate)):
        site.restart(stop)
        assert site.states() == before
        assert site.audit() == audit
        told.append((f"{how}: seven axes, one in each state", "as they were; no new audit row"))


def test_acknowledged_twice_it_is_audited_once(site, told):
    audit = site.audit()
    assert not site.order("acknowledged", "acknowledge", "Bob")["changed"]
    site.restart()
    assert not site.order("acknowledged", "acknowledge", "Cy")["changed"]
    assert site.audit() == audit
    told.append(("acknowledged again, by another, and again after kill -9", "changed: false; one audit row, Ada's"))


def test_they_go_on_from_there(site, told):
    for name in ("unacknowledged", "acknowledged", "suppressed", "out_of_service"):
        site.send(name, 1.0)
    site.settle()
    states = site.states()
    assert states["unacknowledged"] == "returned_unacknowledged"
    assert states["acknowledged"] == "normal"
    assert (states["suppressed"], states["out_of_service"]) == ("suppressed", "out_of_service")
    told.append(("after the restarts the jam is cleared", "returned_unacknowledged; normal; put aside stays aside"))


def test_a_shelf_that_ends_while_the_daemon_is_down(site, told):
    site.restart(clock=7 * HOUR)
    time.sleep(2.5)  # two rounds of the daemon: nothing is to happen, which no condition shows
    assert site.states()["shelved"] == "shelved"
    site.restart(clock=9 * HOUR)
    site.becomes("shelved", "unacknowledged")
    assert site.audit()[-1] == ("shelved", "jam", "tick", "unacknowledged", "")
    told.append(("shelved for 8 h, down until hour 7; until hour 9", "shelved; unacknowledged, event tick"))


def test_clocks_that_step_back(site, told):
    assert site.order("shelved", "shelve")["changed"]
    site.plant.clock(4 * HOUR)
    site.send("shelved", 1.6, day=-40)
    site.settle()
    time.sleep(2.5)  # as above
    assert site.states()["shelved"] == "shelved"
    told.append(("shelved for 8 h; wall clock 5 h back, stamps 48 days back", "shelved"))
    site.plant.clock(-20 * HOUR)
    site.becomes("shelved", "unacknowledged")
    told.append(("wall clock another 24 h back", "unacknowledged: hidden for ever would be worse"))
    states, audit = site.states(), site.audit()
    site.restart(clock=-40 * HOUR)
    assert (site.states(), site.audit()) == (states, audit)
    told.append(("kill -9, and another 20 h back while down", "as they were; no new audit row"))
