"""Two daemons share the axes of a site on one database; one dies, the other takes over: nothing lost, nothing twice."""

import collections
import signal
import sqlite3
import threading
import time

import pytest

from monitor.sharing import Roster, owner_of, token_of
from plant.errors import ParameterError
from plant.publisher import SamplePublisher
from plant.zenoh_session import open_session
from tests.scenarios.harness import SITE, START_NS, Plant, blocks_of, burst, free_port, wait_for

FEW, MANY = (tuple(f"axis-{k:03d}" for k in range(number)) for number in (12, 100))
SAMPLES = 2000


def test_every_daemon_computes_the_same_shares_and_only_the_dead_ones_move():
    axes = [f"axis-{k}" for k in range(2000)]
    before = {axis: owner_of(axis, ["a", "b", "c"]) for axis in axes}
    assert before == {axis: owner_of(axis, ["c", "a", "b"]) for axis in axes}
    assert min(collections.Counter(before.values()).values()) > 550, "about a third each"
    after = {axis: owner_of(axis, ["a", "c"]) for axis in axes}
    assert all(after[axis] == before[axis] for axis in axes if before[axis] != "b")


def test_a_daemon_alone_owns_everything():
    assert all(Roster().share()(axis) for axis in FEW)
    assert all(Roster("a").share()(axis) for axis in FEW)


def test_a_name_that_cannot_stand_in_a_key_is_refused():
    with pytest.raises(ParameterError, match=r"sharing\.member"):
        token_of("left hand")


class Member(Plant):
    """A daemon of the site: a leaf of the hub, on the common database."""

    def __init__(self, folder, hub, url, name, axes):
        folder.mkdir()
        settings = (
            f'mode = "client"\nconnect = ["{hub}"]\n[sharing]\nmember = "{name}"\n[history]\ndatabase = "{url}"\n'
        )
        settings += "[window]\nhop = 1000\n[identification]\nworkers = 1"
        super().__init__(folder, axes, settings)
        self.config.write_text(self.config.read_text().replace(f'listen = ["{self.endpoint}"]', "listen = []"))


def rows(path, query):
    with sqlite3.connect(f"file:{path}?mode=ro", uri=True, timeout=30) as db:
        return db.execute(query).fetchall()


def owners(path):
    return dict(rows(path, "select axis.name, owner.member from owner join axis on axis.id = owner.axis_id"))


def feed(hub, axis, names, stop):
    """All axes at once, a burst each, at a pace that a busy computer follows: 12,000 samples/s."""
    parts = list(zip(*[iter(burst_parts(axis))], strict=True))
    with open_session("client", connect=[hub], timeout=20.0) as session:
        publishers = [SamplePublisher(session, SITE, name, epoch=1) for name in names]
        for (part,) in parts:
            for publisher in publishers:
                publisher.put(part(publisher.axis_name))
            time.sleep(len(names) / 120)
        stop.wait(300)  # what was missed is recovered from our caches
        for publisher in publishers:
            publisher.__exit__(None, None, None)


def burst_parts(axis):
    torque, position = burst(axis, samples=SAMPLES)
    for block in blocks_of("x", 1, 0, START_NS, torque, position):
        yield lambda name, block=block: type(block)(
            name, 1, block.seq, block.t_ns, block.position, torque=block.torque, dt_ns=block.dt_ns
        )


@pytest.mark.parametrize(
    ("number", "axes"),
    [
        pytest.param(signal.SIGKILL, FEW, id="killed"),
        pytest.param(signal.SIGSTOP, FEW, id="frozen", marks=pytest.mark.slow),
        pytest.param(signal.SIGKILL, MANY, id="killed, 100 axes", marks=pytest.mark.slow),
        pytest.param(signal.SIGSTOP, MANY, id="frozen, 100 axes", marks=pytest.mark.slow),
    ],
)
def test_one_daemon_goes_and_the_other_takes_over(tmp_path, number, axes):
    hub, path = f"tcp/127.0.0.1:{free_port()}", tmp_path / "site.db"
    url = f"sqlite:///{path}"
    with (
        open_session("router", listen=[hub]),
        Member(tmp_path / "left", hub, url, "left", axes) as left,
        Member(tmp_path / "right", hub, url, "right", axes) as right,
    ):
        left.start()
        right.start()
        shares = {name: owner_of(name, ["left", "right"]) for name in axes}
        assert set(shares.values()) == {"left", "right"}
        wait_for(lambda: owners(path) == shares, 60, "each has its share")
        stop = threading.Event()
        feeder = threading.Thread(target=feed, args=(hub, left.axis, axes, stop))
        feeder.start()
        try:
            some = "select count(*) from axis where samples >= 500"
            wait_for(lambda: rows(path, some) == [(len(axes),)], 120, "samples of all axes at both")
            left.process.send_signal(number)
            begun = time.monotonic()
            wait_for(lambda: set(owners(path).values()) == {"right"}, 60, "the other claims all axes")
            took, moved = time.monotonic() - begun, sum(name == "left" for name in shares.values())
            print(f"\n{number.name}: {moved} of {len(axes)} axes move, claimed after {took:.2f} s")
            done = "select count(*) from axis where samples + missing = 2000"
            wait_for(lambda: rows(path, done) == [(len(axes),)], 180, "all samples of all axes")
            print(f"every sample of all axes in the journal after {time.monotonic() - begun:.1f} s")
            answered = "select count(*) from window join estimate on estimate.window_id = window.id"
            wait_for(lambda: rows(path, answered) == [(len(axes),)], 300, "an answer to every window")
            if number == signal.SIGSTOP:  # it thaws, believes itself on duty, and must do no harm
                left.process.send_signal(signal.SIGCONT)
                wait_for(lambda: owners(path) == shares, 60, "it is seen again and gets its share back")
        finally:
            stop.set()
            feeder.join()
            left.process.send_signal(signal.SIGCONT)
        assert rows(path, "select sum(missing) from axis") == [(0,)], "no sample lost"
        twice = "select axis_id, first_seq, count(*) from window group by 1, 2 having count(*) > 1"
        assert rows(path, twice) == []
        blocks = rows(path, "select axis_id, seq, n from block order by axis_id, seq")
        ends = collections.Counter()
        for axis_id, seq, n in blocks:
            assert seq >= ends[axis_id], "no sample twice"
            ends[axis_id] = seq + n
