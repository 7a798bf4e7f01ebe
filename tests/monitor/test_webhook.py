"""Alerts by webhook against a real HTTP server that fails first: nothing lost, in order, resolved ones too."""

import json
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest

from monitor.alarms import State
from monitor.alertmanager import message_of
from monitor.config_sections import WebhookSection
from monitor.http_webhook import Postman
from monitor.queries import Reader
from monitor.times import parse_time
from tests.monitor.test_alarm_desk import GONE, HOUR, JAM, Site
from tests.scenarios.harness import wait_for

TOKEN = "geheim"


class Receiver:
    """An Alertmanager that answers with the codes it is told, then 200; keeps what it took."""

    def __init__(self):
        outer = self
        self.codes, self.taken, self.asked = [], [], []

        class Handler(BaseHTTPRequestHandler):
            def do_POST(self):
                body = self.rfile.read(int(self.headers["Content-Length"]))
                outer.asked.append((self.path, self.headers["Authorization"], self.headers["Content-Type"]))
                code = outer.codes.pop(0) if outer.codes else 200
                if code == 200:
                    outer.taken += json.loads(body)
                self.send_response(code)
                self.end_headers()

            def log_message(self, *_):
                pass

        self.server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.url = f"http://127.0.0.1:{self.server.server_port}/api/v2/alerts"
        self._thread = threading.Thread(target=self.server.serve_forever, args=(0.05,))
        self._thread.start()

    def close(self):
        self.server.shutdown()
        self._thread.join()
        self.server.server_close()

    def said(self):
        return [(one["labels"]["kind"], one["annotations"]["state"]) for one in self.taken]


@pytest.fixture
def receiver(monkeypatch):
    for name in ("http_proxy", "HTTP_PROXY"):
        monkeypatch.delenv(name, raising=False)
    one = Receiver()
    yield one
    one.close()


class Office:
    """A site with a postman, whose clocks the test moves."""

    def __init__(self, tmp_path, *urls, **settings):
        self.settings = WebhookSection(urls=urls, first_retry=5.0, longest_retry=20.0, **settings)
        self.site = Site(f"sqlite:///{tmp_path / 'history.db'}")
        self.clock = 0.0
        self.open()

    def open(self):
        self.site.store.receivers = self.settings.urls
        self.postman = Postman(
            self.settings,
            self.site.store,
            clock=lambda: self.clock,
            wall=lambda: self.site.wall + int(self.clock * 1e9),
        )

    def restart(self):
        self.postman.close()
        self.site.restart()
        self.open()

    def pump(self, seconds=1.0):
        """Let time pass, and wait for the request that is on its way, if there is one."""
        self.clock += seconds
        self.postman.pump(self.site.floor.fleet.runs.values())
        on_the_way = [answer for _, answer in self.postman._sent.values()]
        for answer in on_the_way:
            answer.result(20)
        if on_the_way:
            self.postman.pump(self.site.floor.fleet.runs.values())
        return len(on_the_way)

    def settle(self):
        wait_for(lambda: not self.pump(), 30, "an empty outbox")

    def close(self):
        self.postman.close()
        self.site.store.close()


@pytest.fixture
def office(tmp_path, receiver):
    token = tmp_path / "token"
    token.write_text(TOKEN + "\n")
    one = Office(tmp_path, receiver.url, token_file=str(token))
    yield one
    one.close()


def test_a_receiver_that_fails_first_hears_everything_in_order(office, receiver):
    receiver.codes = [503, 429]
    office.site.observe(JAM)
    office.site.do("acknowledge")
    office.site.observe(GONE)
    assert [office.pump(0.5), office.pump()] == [1, 0]  # failed, then it waits
    assert receiver.taken == []
    assert office.pump(4.0) == 1  # 5 s later
    assert office.pump(6.0) == 0  # twice as long now
    office.pump(5.0)
    office.settle()
    assert receiver.said() == [("jam", "unacknowledged"), ("jam", "acknowledged"), ("jam", "normal")]
    assert receiver.asked[0] == ("/api/v2/alerts", f"Bearer {TOKEN}", "application/json")
    first, *_, last = receiver.taken
    assert first["labels"] == last["labels"]
    assert parse_time(first["endsAt"]) > office.site.wall
    assert parse_time(last["endsAt"]) <= office.site.wall + office.clock * 1e9
    assert "190 N" in first["annotations"]["summary"]
    assert receiver.taken[1]["annotations"]["changed_by"] == "Ada"


def test_what_was_not_delivered_is_after_a_restart(office, receiver):
    receiver.codes = [500]
    office.site.observe(JAM)
    office.pump()
    office.site.observe(GONE)
    office.restart()
    office.clock += 10.0
    office.settle()
    assert receiver.said() == [("jam", "unacknowledged"), ("jam", "returned_unacknowledged")]
    office.restart()
    office.settle()
    assert len(receiver.taken) == 2


def test_what_is_refused_for_good_does_not_block_what_comes_after(office, receiver):
    receiver.codes = [400]
    office.site.observe(JAM)
    office.site.observe(GONE)
    office.settle()
    assert receiver.said() == [("jam", "returned_unacknowledged")]


def test_one_receiver_that_is_away_does_not_keep_another_waiting(tmp_path, receiver):
    office = Office(tmp_path, "http://127.0.0.1:9/api/v2/alerts", receiver.url)  # nobody listens on port 9
    office.site.observe(JAM)
    wait_for(lambda: office.pump() == 0 or receiver.taken, 30, "delivery")
    assert receiver.said() == [("jam", "unacknowledged")]
    assert office.site.store.next_letter("http://127.0.0.1:9/api/v2/alerts", [1]).tries >= 1
    office.close()


def test_shelved_is_resolved_for_the_receiver_and_what_stands_is_repeated(office, receiver):
    office.site.observe(JAM)
    office.settle()
    office.pump(301.0)
    assert receiver.said() == [("jam", "unacknowledged")] * 2
    office.site.do("shelve", **{"for": "8h"})
    office.settle()
    assert parse_time(receiver.taken[-1]["endsAt"]) <= office.site.wall + office.clock * 1e9
    office.pump(301.0)
    assert len(receiver.taken) == 3
    with Reader(office.site.url) as reader:
        assert len(reader.transitions()) == 2


def test_put_aside_before_it_was_ever_raised_nobody_is_told(office, receiver):
    office.site.do("suppress")
    office.settle()
    assert receiver.taken == []


@pytest.mark.parametrize("state", State)
def test_stamps_are_such_that_alertmanager_takes_them(state):
    alert = {
        "kind": "jam", "site": "s", "axis": "a", "priority": "high", "text": "t", "likely_cause": "c", "id": "i",
        "recommended_action": "r", "consequence": "q", "since_ns": 50 * HOUR,
    }  # fmt: skip
    for at_ns, now_ns in ((60 * HOUR, 61 * HOUR), (60 * HOUR, 10 * HOUR), (40 * HOUR, 61 * HOUR)):
        told = message_of(alert, state.value, at_ns, "", now_ns)
        starts, ends = parse_time(told["startsAt"]), parse_time(told["endsAt"])
        assert starts <= ends
        assert starts <= now_ns
        assert (ends > now_ns) == (state in (State.UNACKNOWLEDGED, State.ACKNOWLEDGED))
        assert told["labels"]["severity"] == "critical"
