"""The recorder: what it writes reads back to the sample, whatever happens in between."""

import json
import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from plant import keys
from plant.axis import Axis, Mechanics
from plant.errors import InputError, ParameterError, RecordingError
from plant.publisher import SamplePublisher
from plant.record_files import AxisRecorder, RollRule, about_file, begin_of
from plant.record_zenoh import Recorded, record
from plant.recording_files import read_recording
from plant.replay import ReplaySettings, Track, replay_tracks
from plant.wire import Block, decode_block, encode_block
from plant.zenoh_session import open_session

START = 1_767_225_600_123_456_789
STEP = 10_000_000
AXIS = Axis("axis-1", Mechanics(M=1.0, force_per_torque=69.93))
DEADLINE = 30.0


def block(seq, count=100, epoch=1, axis="axis-1", start=START, step=STEP, **more):
    rng = np.random.default_rng(seq)
    stamps = start + step * np.arange(seq, seq + count)
    return Block(axis, epoch, seq, stamps, rng.normal(size=count), torque=rng.normal(size=count), **more)


def written(folder):
    return sorted(path for path in folder.iterdir() if path.suffix not in (".json", ".part"))


def drive(torque):
    return torque * AXIS.mechanics.gain


def check(recording, blocks):
    np.testing.assert_array_equal(recording.position, np.concatenate([one.position for one in blocks]))
    np.testing.assert_array_equal(recording.force, drive(np.concatenate([one.torque for one in blocks])))
    stamps = np.concatenate([one.t_ns for one in blocks])
    np.testing.assert_array_equal(np.rint(recording.t * 1e9).astype(np.int64) + recording.begin_ns, stamps)


@pytest.mark.parametrize("kind", ["csv", "csv.gz", "parquet"])
def test_a_stream_reads_back_to_the_bit(tmp_path, kind):
    blocks = [block(seq, temperature=np.full(100, 21.5)) for seq in range(0, 1000, 100)]
    blocks[3].position[7] = np.nan
    with AxisRecorder(tmp_path, "axis-1", RollRule(kind)) as recorder:
        for one in blocks:
            recorder.take(one)
    (path,) = written(tmp_path)
    recording = read_recording(path, AXIS)
    check(recording, blocks)
    assert recording.temperature.tolist() == [21.5] * 1000
    assert begin_of(path) == START


@settings(max_examples=30)
@given(
    sent=st.lists(st.integers(0, 20), min_size=1, max_size=40),
    megabytes=st.sampled_from([1e-3, 0.005, 1.0]),
)
def test_in_whatever_order_blocks_come_every_sample_stands_once_and_gaps_are_marked(tmp_path_factory, sent, megabytes):
    folder = tmp_path_factory.mktemp("r")
    with AxisRecorder(folder, "axis-1", RollRule("csv", megabytes)) as recorder:
        for number in sent:
            recorder.take(block(37 * number, 50))  # neighbours overlap
    seq = np.concatenate([np.loadtxt(path, delimiter=",", skiprows=1)[:, 0] for path in _by_begin(folder)])
    assert np.all(np.diff(seq) > 0)
    count = recorder.counters
    assert count.samples == len(seq)
    assert count.samples + count.duplicates == 50 * len(sent)
    assert count.missing == seq[-1] - seq[0] + 1 - len(seq)
    for path in _by_begin(folder):
        rows = np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2)[:, 0]
        about = json.loads(about_file(path).read_text())
        assert sum(gap["missing"] for gap in about["gaps"]) == rows[-1] - rows[0] + 1 - len(rows)


def _by_begin(folder):
    return sorted(written(folder), key=begin_of)


def test_a_new_epoch_a_clock_set_back_and_an_hour_begin_new_files(tmp_path):
    with AxisRecorder(tmp_path, "axis-1", RollRule("csv", minutes=0.1)) as recorder:
        for seq in range(0, 1000, 100):
            recorder.take(block(seq))  # 10 s: two files of 6 s at most
        recorder.take(block(0, epoch=2, start=START + 3600 * 10**9))
        recorder.take(block(100, epoch=2, start=START - 3600 * 10**9))
        recorder.take(block(200, epoch=1))  # an epoch that is over
    assert len(written(tmp_path)) == 4
    assert recorder.counters.duplicates == 100
    check(read_recording(_by_begin(tmp_path)[1], AXIS), [block(seq) for seq in range(0, 600, 100)])


def test_what_a_crash_has_left_is_finished_up_to_the_last_whole_block(tmp_path):
    recorder = AxisRecorder(tmp_path, "axis-1", RollRule("csv"))
    for seq in range(0, 500, 100):
        recorder.take(block(seq))
    part = tmp_path / "axis-1.part"
    content = part.read_bytes()
    recorder._journal.close()
    for cut, whole in ((len(content), 500), (len(content) - 1, 400), (len(content) - 3000, 300), (3, 0)):
        part.write_bytes(content[:cut])
        again = AxisRecorder(tmp_path, "axis-1", RollRule("csv"))
        assert again.counters.recovered == whole
        assert not part.exists()
        for path in written(tmp_path):
            assert len(read_recording(path, AXIS)) == whole
            path.unlink()
    damaged = bytearray(content)
    damaged[len(content) // 2] ^= 1
    part.write_bytes(damaged)
    assert AxisRecorder(tmp_path, "axis-1", RollRule("csv")).counters.recovered == 200


def test_finishing_the_same_journal_twice_gives_the_same_file(tmp_path):
    recorder = AxisRecorder(tmp_path, "axis-1", RollRule("csv"))
    recorder.take(block(0))
    content = (tmp_path / "axis-1.part").read_bytes()
    recorder.roll()
    first = written(tmp_path)[0].read_bytes()
    (tmp_path / "axis-1.part").write_bytes(content)  # killed after the rename, before the journal was removed
    AxisRecorder(tmp_path, "axis-1", RollRule("csv"))
    assert [path.read_bytes() for path in written(tmp_path)] == [first]


@pytest.mark.parametrize(
    ("change", "words"), [({"format": "xls"}, "csv.gz"), ({"minutes": 0}, "min"), ({"megabytes": -1}, "MB")]
)
def test_rules_that_cannot_be(change, words):
    with pytest.raises(ParameterError, match=words):
        RollRule(**change)


# --- over Zenoh -------------------------------------------------------------------------------------------------


class Recording:
    """A recorder in a thread."""

    def __init__(self, endpoint, folder, rule=None, **more):
        self.stop, ready = threading.Event(), threading.Event()
        self.result = Recorded()

        def run():
            with open_session("client", connect=[endpoint]) as session:
                self.result = record(
                    session,
                    "s",
                    folder,
                    rule or RollRule("csv"),
                    stop=self.stop,
                    ready=ready.set,
                    progress=self.tell,
                    **more,
                )

        self.thread = threading.Thread(target=run)
        self.thread.start()
        assert ready.wait(DEADLINE)

    def tell(self, result):
        self.result = result

    def wait(self, samples):
        deadline = time.monotonic() + DEADLINE
        while self.result.samples < samples:
            assert time.monotonic() < deadline, f"{self.result.samples} of {samples} samples"
            time.sleep(0.01)

    def end(self):
        self.stop.set()
        self.thread.join()
        return self.result


def heard(publisher):
    """Wait until what `publisher` puts has a subscriber: without a cache, what comes before is lost."""
    deadline = time.monotonic() + DEADLINE
    while not publisher.matching_status.matching:
        assert time.monotonic() < deadline, "no subscriber"
        time.sleep(0.01)


class Epochs:
    """The part of a daemon that a replay waits for: it hears of epochs and acknowledges them when told."""

    def __init__(self, session):
        self.session, self.known = session, {}
        self.subscriber = session.declare_subscriber(keys.samples_pattern("s"), self.hear)

    def hear(self, sample):
        heard = decode_block(sample.payload.to_bytes(), str(sample.encoding))
        self.known[heard.axis] = heard.epoch

    def acknowledge(self, seq):
        for axis, epoch in list(self.known.items()):
            status = {"axis": axis, "committed": {"epoch": epoch, "seq": seq}}
            self.session.put(keys.status_key("s", axis), json.dumps(status))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.subscriber.undeclare()


@pytest.fixture
def hub(tmp_path):
    endpoint = f"unixsock-stream/{tmp_path}/z.sock"
    with open_session("peer", listen=[endpoint]) as session:
        yield endpoint, session


def test_recorded_replayed_and_recorded_again_gives_the_same_samples_and_stamps(hub, tmp_path):
    endpoint, daemon = hub
    axes = [AXIS, Axis("axis-2", Mechanics(M=1.0, force_per_torque=1.0))]
    first = Recording(endpoint, tmp_path / "first")
    with open_session("client", connect=[endpoint]) as session:
        for axis in axes:
            with SamplePublisher(session, "s", axis.name, epoch=7) as publisher:
                for seq in range(0, 1000, 100):
                    publisher.put(block(seq, axis=axis.name, epoch=7))
                first.wait(1000 * (1 + axes.index(axis)))
        result = first.end()
        assert {name: one.missing for name, one in result.axes.items()} == {"axis-1": 0, "axis-2": 0}
        second = Recording(endpoint, tmp_path / "second")
        files = {
            axis.name: next(p for p in written(tmp_path / "first") if p.name.startswith(axis.name)) for axis in axes
        }
        tracks = [Track(axis.name, (read_recording(files[axis.name], axis),)) for axis in axes]
        settings = ReplaySettings(speed=200.0, original=True, stall=DEADLINE)
        player = threading.Thread(target=replay_tracks, args=(tracks, session, "s", settings))
        with Epochs(daemon) as epochs:
            player.start()  # its caches stay until it is acknowledged: a block sent before the routes stood comes late
            second.wait(2000)
            while player.is_alive():
                epochs.acknowledge(999)
                player.join(0.1)
        second.end()
    for axis in axes:
        (again,) = [path for path in written(tmp_path / "second") if path.name.startswith(axis.name)]
        one, two = read_recording(files[axis.name], axis), read_recording(again, axis)
        assert one.sha256() == two.sha256()
        assert one.begin_ns == two.begin_ns == START


def test_what_came_too_early_is_asked_of_the_cache_and_written_in_order(hub, tmp_path):
    endpoint, session = hub
    key, asked = keys.samples_key("s", "axis-1"), []

    def answer(query):
        asked.append(query.key_expr)
        for seq in (0, 100, 400):
            query.reply(key, encode_block(block(seq)), encoding="application/cbor")

    recorder = Recording(endpoint, tmp_path / "out")
    with session.declare_queryable(f"{key}/@adv/pub/here/1/_", answer), session.declare_publisher(key) as publisher:
        heard(publisher)
        for seq in (200, 300, 500, 600, 800):
            publisher.put(encode_block(block(seq)), encoding="application/cbor")
        recorder.wait(800)  # 700 is nowhere
        counters = recorder.end().axes["axis-1"]
    assert (counters.samples, counters.missing, counters.duplicates) == (800, 100, 0)
    assert 1 <= len(asked) <= 2  # Zenoh may ask too
    (path,) = written(tmp_path / "out")
    check(read_recording(path, AXIS), [block(seq) for seq in (0, 100, 200, 300, 400, 500, 600, 800)])


def test_garbage_beside_a_stream_is_counted_and_not_written(hub, tmp_path):
    endpoint, _session = hub
    recorder = Recording(endpoint, tmp_path / "out", axes=["axis-1"])
    key = keys.samples_key("s", "axis-1")
    with open_session("client", connect=[endpoint]) as other, SamplePublisher(other, "s", "axis-1") as publisher:
        with other.declare_publisher(key) as garbage:
            heard(garbage)
            garbage.put(b"\xff\xff", encoding="application/cbor")
        other.put(keys.samples_key("s", "axis-2"), b"\xff\xff", encoding="application/cbor")
        publisher.put(block(0))
        recorder.wait(100)
        result = recorder.end()
    assert list(result.axes) == ["axis-1"]
    assert result.refused.total() == result.refused["bad_cbor"] == 1


def test_a_recording_that_does_not_say_when_it_was_made_cannot_keep_its_time(hub, tmp_path):
    _endpoint, session = hub
    path = tmp_path / "r.csv"
    path.write_text("t,torque,position\n0,1,2\n0.01,1,2\n")
    with pytest.raises(InputError, match="does not say when it was made"):
        replay_tracks([Track("axis-1", (read_recording(path, AXIS),))], session, "s", ReplaySettings(original=True))


def test_a_folder_that_cannot_be_made_is_one_line(hub, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(RecordingError, match="cannot be made"):
        record(hub[1], "s", tmp_path / "file" / "out", RollRule())


def test_a_recorder_that_is_killed_loses_nothing_that_it_had_received(hub, tmp_path):
    endpoint, session = hub
    command = [
        sys.executable,
        "-m",
        "monitor",
        "record",
        "--out",
        tmp_path / "out",
        "--connect",
        endpoint,
        "--site",
        "s",
    ]
    process = subprocess.Popen([*command, "--format", "csv"], stderr=subprocess.PIPE, text=True)
    assert "recording" in process.stderr.readline()
    with SamplePublisher(session, "s", "axis-1", epoch=3) as publisher:
        for seq in range(0, 2000, 100):
            publisher.put(block(seq, epoch=3))
        part = tmp_path / "out" / "axis-1.part"
        whole = sum(8 + len(encode_block(block(seq, epoch=3))) for seq in range(0, 2000, 100))
        deadline = time.monotonic() + DEADLINE
        while not part.exists() or part.stat().st_size < whole:
            assert time.monotonic() < deadline
            time.sleep(0.01)
        os.kill(process.pid, signal.SIGKILL)
        process.communicate()
    done = subprocess.run(
        [*command, "--format", "csv", "--duration", "0.2", "--json"], capture_output=True, text=True, timeout=60
    )
    assert json.loads(done.stdout)["axes"]["axis-1"]["recovered"] == 2000
    (path,) = written(tmp_path / "out")
    check(read_recording(path, AXIS), [block(seq, epoch=3) for seq in range(0, 2000, 100)])
