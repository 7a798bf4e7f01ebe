"""The watchdog hears of progress, not of a running thread."""

import socket

import pytest

from monitor.errors import DatabaseError
from monitor.notify_systemd import Notifier
from monitor.pulse import Pulse


@pytest.fixture
def systemd(tmp_path):
    """What systemd would hear: a function that gives the datagrams since the last call."""
    path = tmp_path / "notify"
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as ear:
        ear.bind(str(path))
        ear.setblocking(False)

        def heard():
            found = []
            while True:
                try:
                    found.append(ear.recv(4096).decode())
                except BlockingIOError:
                    return found

        yield Notifier({"NOTIFY_SOCKET": str(path), "WATCHDOG_USEC": "20000000"}), heard


class Daemon:
    """Its clock, its database and its workers."""

    def __init__(self, notifier):
        self.now, self.oldest, self.trouble = 0.0, 0.0, None
        self.pulse = Pulse(
            notifier, database=self.answer, oldest_job=lambda: self.oldest, job_limit=300.0,
            clock=lambda: self.now,
        )  # fmt: skip

    def answer(self):
        if self.trouble:
            raise DatabaseError(self.trouble)


def test_beats_at_half_the_watchdogs_time(systemd):
    notifier, heard = systemd
    daemon = Daemon(notifier)
    for daemon.now in range(0, 60):
        daemon.pulse.beat(lambda: "watching 3 axes")
    beats = heard()
    assert len(beats) == 6
    assert all("WATCHDOG=1" in beat and "STATUS=watching 3 axes" in beat for beat in beats)


@pytest.mark.parametrize(("fault", "said"), [("database", "disk is full"), ("worker", "workers have given no answer")])
def test_no_beat_without_progress_and_again_when_well(systemd, fault, said):
    notifier, heard = systemd
    daemon = Daemon(notifier)
    daemon.pulse.beat(lambda: "watching 3 axes")
    assert "WATCHDOG=1" in heard()[0]
    daemon.trouble, daemon.oldest = ("disk is full", 0.0) if fault == "database" else (None, 601.0)
    daemon.now = 30.0
    daemon.pulse.beat(lambda: "watching 3 axes")
    (beat,) = heard()
    assert "WATCHDOG" not in beat
    assert said in beat
    daemon.trouble, daemon.oldest, daemon.now = None, 0.0, 60.0
    daemon.pulse.beat(lambda: "watching 3 axes")
    assert "WATCHDOG=1" in heard()[0]
    assert daemon.pulse.ailing is None


def test_an_abstract_socket_is_meant_by_an_at_sign():
    name = "tribowatch-test-notify"
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as ear:
        ear.bind("\0" + name)
        ear.settimeout(5)
        Notifier({"NOTIFY_SOCKET": "@" + name}).tell(READY=1)
        assert ear.recv(100) == b"READY=1"


@pytest.mark.parametrize("environment", [{}, {"NOTIFY_SOCKET": "/nowhere/at/all"}])
def test_without_systemd_nothing_happens(environment):
    notifier = Notifier(environment)
    notifier.tell(READY=1)
    assert notifier.watchdog_seconds is None


def test_the_watchdog_of_another_process_is_not_ours():
    assert Notifier({"NOTIFY_SOCKET": "/x", "WATCHDOG_USEC": "1000000", "WATCHDOG_PID": "1"}).watchdog_seconds is None
