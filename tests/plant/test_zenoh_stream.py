"""Publisher, session and replay over real Zenoh sessions on a Unix socket or loopback."""

import contextlib
import dataclasses
import itertools
import json
import queue
import socket
import threading
import time

import numpy as np
import pytest
import zenoh

from plant import keys
from plant.acknowledgement import committed_seq
from plant.axis import Axis, Mechanics
from plant.blocks import count_samples, recording_blocks
from plant.errors import ParameterError, PayloadError, ReachError
from plant.publisher import SamplePublisher
from plant.recording import Recording
from plant.replay import ReplaySettings, Track, replay, replay_tracks
from plant.wire import JSON, decode_block
from plant.zenoh_session import open_session

AXIS = Axis("axis-1", Mechanics(M=1.0))
DEADLINE = 20.0


def wait_until(condition):
    deadline = time.monotonic() + DEADLINE
    while not condition():
        assert time.monotonic() < deadline, "did not happen in time"
        time.sleep(0.005)


@pytest.fixture
def endpoint(tmp_path):
    return f"unixsock-stream/{tmp_path}/z.sock"


class Daemon:
    """Receives every stream of a site and commits it in order: the other end of the contract, without identification.

    Like the real one it asks the caches for what Zenoh has not brought. `known` is its history, kept over a restart.
    """

    def __init__(self, endpoint, commit=True, delay=0.0, known=None):
        self.blocks, self.commit, self.delay = [], commit, delay
        self.known = {} if known is None else known
        self.waiting, self.asked = {}, {}
        self.queue = queue.SimpleQueue()
        self.session = open_session("peer", listen=[endpoint])
        self.subscriber = zenoh.ext.declare_advanced_subscriber(
            self.session,
            keys.samples_pattern("s"),
            self.queue.put,
            history=zenoh.ext.HistoryConfig(detect_late_publishers=True),
            recovery=zenoh.ext.RecoveryConfig(periodic_queries=None, heartbeat=True),
        )
        self.worker = threading.Thread(target=self.work)
        self.worker.start()

    def work(self):
        while (sample := self.queue.get()) is not None:
            block = decode_block(sample.payload.to_bytes(), str(sample.encoding))
            stream = block.axis, block.epoch
            waiting, needed = self.waiting.setdefault(stream, {}), self.known.get(stream, 0)
            waiting[block.seq] = block
            if block.seq > needed and self.asked.get(stream) != needed:
                self.asked[stream] = needed
                self.ask(sample.key_expr)
            while (following := waiting.pop(self.known.get(stream, 0), None)) is not None:
                self.take(following, stream)

    def ask(self, key):
        replies = self.session.get(
            f"{key}/@adv/**",
            target=zenoh.QueryTarget.ALL,
            consolidation=zenoh.ConsolidationMode.NONE,
            accept_replies=zenoh.ReplyKeyExpr.ANY,
        )
        for reply in replies:
            if reply.ok is not None:
                self.queue.put(reply.ok)

    def take(self, block, stream):
        self.blocks.append(block)
        if self.commit:
            time.sleep(self.delay)
            self.known[stream] = block.seq + len(block)
            self.tell(block)

    def tell(self, block):
        committed = {"epoch": block.epoch, "seq": block.seq + len(block) - 1}
        status = {"schema_version": 1, "axis": block.axis, "committed": committed, **self.more(block)}
        self.session.put(
            keys.status_key("s", block.axis), json.dumps(status), congestion_control=zenoh.CongestionControl.BLOCK
        )

    def more(self, block):
        return {}

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.subscriber.undeclare()
        self.queue.put(None)
        self.worker.join()
        self.session.close()


class LossyDaemon(Daemon):
    """Says that it misses 100 samples more than before in the second half of a stream."""

    def more(self, block):
        return {"missing": 7 + (100 if block.seq > 500 else 0)}


def recording(n=1000, period=0.01, **changes):
    t = np.arange(n) * period
    return dataclasses.replace(Recording(t, np.sin(t), np.cos(t), temperature=t + 20.0, sample_time=period), **changes)


def test_a_client_without_a_daemon_is_told_what_to_start():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    with pytest.raises(ReachError, match=rf"no daemon at tcp/127.0.0.1:{port}: start it with 'tribowatch run"):
        open_session("client", connect=[f"tcp/127.0.0.1:{port}"], timeout=0.2)


def test_a_port_in_use_is_named():
    with socket.create_server(("127.0.0.1", 0)) as server:
        endpoint = f"tcp/127.0.0.1:{server.getsockname()[1]}"
        with pytest.raises(ReachError, match=f"cannot listen on {endpoint}: the port is in use"):
            open_session("peer", listen=[endpoint])


def test_a_port_where_something_else_answers_does_not_hang():
    with socket.create_server(("127.0.0.1", 0)) as server:
        endpoint = f"tcp/127.0.0.1:{server.getsockname()[1]}"
        with pytest.raises(ReachError, match="no daemon at"):
            open_session("client", connect=[endpoint], timeout=0.5)


def test_bad_endpoints_and_settings_are_named():
    with pytest.raises(ParameterError, match=r"'127\.0\.0\.1:7447'.*tcp/127\.0\.0\.1:7447"):
        open_session("client", connect=["127.0.0.1:7447"])
    with pytest.raises(ParameterError, match="transport/nonsense"):
        open_session("peer", extra=[("transport/nonsense", 1)])


def test_a_client_waits_for_a_daemon_that_starts_a_little_later(endpoint):
    with contextlib.ExitStack() as stack:
        late = threading.Timer(0.3, lambda: stack.enter_context(open_session("peer", listen=[endpoint])))
        late.start()
        with open_session("client", connect=[endpoint], timeout=DEADLINE):
            late.join()


@pytest.mark.parametrize("encoding", ["application/cbor", "application/json"])
def test_samples_sent_arrive_numbered_and_a_second_publisher_has_a_later_epoch(endpoint, encoding):
    with Daemon(endpoint) as daemon, open_session("client", connect=[endpoint]) as session:
        epochs = []
        for _ in range(2):
            with SamplePublisher(session, "s", "axis-1", encoding=encoding) as publisher:
                epochs.append(publisher.epoch)
                for k in range(3):
                    stamps = 10**18 + (10 * k + np.arange(10)) * 10_000_000
                    publisher.send(stamps, np.full(10, 0.1), torque=np.full(10, float(k)))
                wait_until(lambda: len(daemon.blocks) >= 3 * len(epochs))
        assert [block.seq for block in daemon.blocks] == [0, 10, 20] * 2
        assert [block.torque[0] for block in daemon.blocks] == [0.0, 1.0, 2.0] * 2
        assert epochs[1] > epochs[0]
        assert [block.epoch for block in daemon.blocks[::3]] == epochs


def test_a_late_daemon_gets_what_is_in_the_cache(endpoint, tmp_path):
    other = f"unixsock-stream/{tmp_path}/other.sock"
    with open_session("router", listen=[other]) as hub, open_session("client", connect=[other]) as session:
        with SamplePublisher(session, "s", "axis-1") as publisher:
            publisher.send(np.array([10**18]), np.zeros(1), force=np.ones(1))
            got = []
            subscriber = zenoh.ext.declare_advanced_subscriber(
                hub, keys.samples_pattern("s"), got.append, history=zenoh.ext.HistoryConfig()
            )
            wait_until(lambda: got)
            subscriber.undeclare()
        assert decode_block(got[0].payload.to_bytes(), str(got[0].encoding)).seq == 0


def test_a_block_of_another_axis_and_a_bad_block_are_refused_before_they_leave(endpoint):
    with open_session("peer", listen=[endpoint]) as session, SamplePublisher(session, "s", "axis-1") as publisher:
        with pytest.raises(PayloadError):
            publisher.send(np.array([2, 1]), np.zeros(2), force=np.zeros(2))
        assert publisher.next_seq == 0
        block = next(recording_blocks([recording()], "axis-2", epoch=1, start_ns=0))
        with pytest.raises(ParameterError, match="axis-2"):
            publisher.put(block)


def test_blocks_hold_the_raw_samples_with_their_own_spacing():
    irregular = np.cumsum(np.random.default_rng(1).uniform(0.005, 0.015, 1000))
    source = recording(t=irregular)
    blocks = list(recording_blocks([source], "a", epoch=5, start_ns=10**18, samples=300))
    assert [len(block) for block in blocks] == [300, 300, 300, 100]
    assert [block.seq for block in blocks] == [0, 300, 600, 900]
    assert all(block.dt_ns is None for block in blocks)
    stamps = np.concatenate([block.t_ns for block in blocks])
    np.testing.assert_allclose((stamps - stamps[0]) * 1e-9, irregular - irregular[0], atol=1e-9)
    for name in ("force", "position", "temperature"):
        np.testing.assert_array_equal(np.concatenate([getattr(b, name) for b in blocks]), getattr(source, name))
    assert all(block.dt_ns == 10_000_000 for block in recording_blocks([recording()], "a", epoch=5, start_ns=0))


def test_two_runs_are_parted_by_a_pause_in_the_stamps_and_none_in_the_numbers():
    blocks = list(recording_blocks([recording(150), recording(50)], "a", epoch=5, start_ns=0, repeat=2))
    assert [block.seq for block in blocks] == [0, 100, 150, 200, 300, 350]
    pauses = [(b.t_ns[0] - a.t_ns[-1]) * 1e-9 for a, b in itertools.pairwise(blocks)]
    np.testing.assert_allclose(pauses, [0.01, 1.0, 1.0, 0.01, 1.0])
    assert count_samples([recording(150), recording(50)], 2) == (400, 0)


def test_samples_without_a_usable_stamp_are_skipped_and_counted():
    t = np.array([np.nan, 5.0, 5.01, 5.005, 5.01, 5.02, np.inf, 5.03, -1.0])
    n = len(t)
    broken = Recording(t, np.arange(n, dtype=float), np.r_[np.zeros(n - 2), np.inf, 0.0])
    (block,) = recording_blocks([broken], "a", epoch=5, start_ns=1000)
    assert block.force.tolist() == [1.0, 2.0, 5.0, 7.0]
    assert block.t_ns.tolist() == [1000, 10_001_000, 20_001_000, 30_001_000]
    assert np.isnan(block.position[-1])
    assert count_samples([broken]) == (4, 5)
    assert (
        list(recording_blocks([Recording(np.full(2, np.nan), np.zeros(2), np.zeros(2))], "a", epoch=1, start_ns=0))
        == []
    )


def test_replay_at_full_speed_loses_nothing_against_a_slow_daemon(endpoint):
    seen = []
    with Daemon(endpoint, delay=0.001) as daemon, open_session("client", connect=[endpoint]) as session:
        settings = ReplaySettings(speed=0, window=500, repeat=2)
        result = replay([recording(5000)], AXIS, session, "s", settings, lambda *args: seen.append(args))
        assert result.acknowledged
        assert (result.samples, result.skipped, result.blocks) == (10_000, 0, 100)
        assert [block.seq for block in daemon.blocks] == list(range(0, 10_000, 100))
        assert max(sent - heard for sent, heard, _ in seen) <= 500
        assert seen[-1] == (10_000, 10_000, 10_000)


def test_replay_keeps_the_time_of_the_recording_at_its_speed(endpoint):
    with Daemon(endpoint) as daemon, open_session("client", connect=[endpoint]) as session:
        start = 1_700_000_000_000_000_000
        result = replay([recording(400)], AXIS, session, "s", ReplaySettings(speed=8.0, start_ns=start))
        assert daemon.blocks[0].t_ns[0] == start
        assert daemon.blocks[-1].t_ns[-1] - start == 3_990_000_000
        assert result.seconds >= 3.99 / 8.0


def test_several_axes_play_together(endpoint, monkeypatch):
    ends, put = [], SamplePublisher.put
    monkeypatch.setattr(SamplePublisher, "put", lambda own, block: ends.append(block.t_ns[-1]) or put(own, block))
    with Daemon(endpoint), open_session("client", connect=[endpoint]) as session:
        tracks = [Track("a", (recording(1000),)), Track("b", (recording(500, period=0.02),))]
        results = replay_tracks(tracks, session, "s", ReplaySettings(speed=0))
        assert [(result.axis, result.samples, result.acknowledged) for result in results] == [
            ("a", 1000, True),
            ("b", 500, True),
        ]
        assert len(ends) == 15
        assert ends == sorted(ends)


def test_replay_says_when_nobody_acknowledges(endpoint):
    with Daemon(endpoint, commit=False), open_session("client", connect=[endpoint]) as session:
        result = replay([recording(300)], AXIS, session, "s", ReplaySettings(speed=1000, stall=0.2))
        assert (result.samples, result.committed_seq, result.acknowledged) == (300, -1, False)
        with pytest.raises(ReachError, match=r"acknowledged 0 of 200 samples of axis-1 .*\[\[axis\]\]"):
            replay([recording(300)], AXIS, session, "s", ReplaySettings(speed=0, window=200, stall=0.2))


@pytest.mark.parametrize(
    ("name", "value"), [("speed", -1), ("repeat", 0), ("block", 0), ("window", 50), ("stall", 0), ("start_ns", -1)]
)
def test_settings_out_of_range_are_refused(name, value):
    with pytest.raises(ParameterError, match=name):
        ReplaySettings(**{name: value})


def test_only_a_status_of_our_epoch_acknowledges():
    def status(**content):
        return json.dumps(content).encode()

    assert committed_seq(status(committed={"epoch": 5, "seq": 99}), 5) == 99
    assert committed_seq(status(committed={"epoch": 4, "seq": 99}), 5) == -1
    assert committed_seq(status(committed={"epoch": 5, "seq": None}), 5) == -1
    assert committed_seq(status(committed=None), 5) == -1
    for junk in (b"", b"[1]", b"{", b"\xff", status(epoch=5), status(committed=[5, 99])):
        assert committed_seq(junk, 5) == -1


def test_the_encoding_that_arrives_is_the_one_that_was_declared(endpoint):
    with Daemon(endpoint) as daemon, open_session("client", connect=[endpoint]) as session:
        replay([recording(100)], AXIS, session, "s", ReplaySettings(speed=0, encoding=JSON))
        assert len(daemon.blocks) == 1


def test_samples_that_the_daemon_reports_as_missing_are_not_called_acknowledged(endpoint):
    with LossyDaemon(endpoint), open_session("client", connect=[endpoint]) as session:
        result = replay([recording(1000)], AXIS, session, "s", ReplaySettings(speed=0))
    assert (result.committed_seq, result.missing, result.acknowledged) == (999, 100, False)


def test_a_replay_waits_for_a_daemon_that_restarts_and_loses_nothing(endpoint):
    settings = ReplaySettings(speed=0, window=2000, patience=DEADLINE)
    results, first = [], Daemon(endpoint)
    with open_session("client", connect=[endpoint]) as session:
        player = threading.Thread(
            target=lambda: results.append(replay([recording(20_000)], AXIS, session, "s", settings))
        )
        player.start()
        wait_until(lambda: len(first.blocks) >= 20)
        first.commit = False
        first.__exit__()
        with Daemon(endpoint, known=first.known) as second:
            player.join(DEADLINE)
            assert results
            assert results[0].acknowledged
            received = [block.seq for block in [*first.blocks, *second.blocks]]
    assert sorted(set(received)) == list(range(0, 20_000, 100))
