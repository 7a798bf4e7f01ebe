"""The corridor with everything real but the wire: store, workers, files; messages are put by hand, time is a number."""

import dataclasses

import numpy as np
import pytest

from monitor.alarms import State
from monitor.commands import Command, CommandBox
from monitor.config import Config
from monitor.errors import DatabaseError, QueryError
from monitor.fleet import MAX_UNKNOWN
from monitor.inbox import Inbox, Message
from monitor.pipeline import Pipeline
from monitor.queries import Reader
from monitor.samples import WindowId
from monitor.store import Store
from monitor.workers import Workers
from plant.presets import paper_axis
from plant.wire import CBOR, Block, encode_block
from tests.scenarios.harness import START_NS, STEP_NS, blocks_of, burst, wait_for

AXIS = dataclasses.replace(paper_axis(), name="axis-1")
SMALL = {
    "window": {"samples": 200, "hop": 200},
    "intake": {"stale_after": 100.0},
    "drift": {"baseline_windows": 5, "baseline_span": 0.0},
}


class Bench:
    """A pipeline on a clock that only the test moves."""

    def __init__(self, folder, workers, axes=(AXIS,), laboratory=None, fetch=None, **settings):
        self.now = 1000.0
        self.url = f"sqlite:///{folder / 'tribowatch.db'}"
        self.store = Store(self.url)
        self.inbox = Inbox(100)
        self.commands = CommandBox(self.inbox.wake)
        self.told = []
        self.untellable = ""
        self.pipeline = Pipeline(
            Config(site="site", state_dir=folder, **{**SMALL, **settings}), {axis.name: axis for axis in axes},
            self.store, workers, self.inbox, self.publish,
            commands=self.commands, laboratory=laboratory, fetch=fetch,
            clock=lambda: self.now, wall=lambda: int(self.now * 1e9),
        )  # fmt: skip

    def publish(self, what, axis, content):
        if what == self.untellable:
            raise ConnectionError("killed between storing and telling")
        self.told.append((what, axis, content))

    def put(self, block, key="tribowatch/site/axis-1/samples"):
        self.inbox.put(Message(key, CBOR, encode_block(block), self.now))

    def step(self, seconds=1.0):
        self.now += seconds
        self.pipeline.step(0.0)

    def finish(self, timeout=60.0):
        """Go on until every window is answered."""
        self.step()
        wait_for(lambda: self.step(0.0) or self.pipeline.backlog == 0, timeout, "answers")

    def order(self, action, axis="axis-1", author="Ada", **arguments):
        """Hand in a command and let the pipeline execute it."""
        answer = self.commands.submit(Command(action, axis, arguments, author))
        self.step(0.0)
        return answer.result(0)

    def heard(self, what):
        return [content for told, _, content in self.told if told == what]


@pytest.fixture(scope="module")
def workers():
    one = Workers(2)
    yield one
    one.close()


@pytest.fixture
def bench(tmp_path, workers):
    return Bench(tmp_path, workers)


def test_nothing_is_acknowledged_before_it_is_in_the_journal(bench):
    torque, position = burst(AXIS, samples=200)
    for block in blocks_of("axis-1", 1, 0, START_NS, torque, position):
        bench.put(block)
    bench.step(0.0)  # received, the commit is not due
    assert bench.heard("status") == []
    bench.step()
    assert bench.heard("status")[-1]["committed"] == {"epoch": 1, "seq": 199}
    with Reader(bench.url) as reader:
        assert reader.axis("axis-1").samples == 200
    bench.finish()


def test_a_gap_is_waited_for_then_reported(bench):
    torque, position = burst(AXIS, samples=600)
    blocks = list(blocks_of("axis-1", 1, 0, START_NS, torque, position))
    for block in (*blocks[:1], *blocks[3:]):
        bench.put(block)
    bench.step()
    assert bench.heard("status")[-1]["committed"]["seq"] == 99
    assert bench.heard("status")[-1]["held_blocks"] == 3
    bench.step(5.0)
    bench.step()
    status = bench.heard("status")[-1]
    assert (status["committed"]["seq"], status["missing"], status["samples"]) == (599, 200, 400)
    bench.finish()
    with Reader(bench.url) as reader:
        assert [(gap["from_seq"], gap["to_seq"]) for gap in reader.history("axis-1")["gaps"]] == [(100, 300)]


def test_a_stray_epoch_in_a_pause_stops_neither_windows_nor_watch_after_a_restart(tmp_path, workers):
    torque, position = burst(AXIS, samples=2000)
    part = slice(0, 600)

    def send(bench, epoch, seq, start_ns, rows=part):
        for block in blocks_of("axis-1", epoch, seq, start_ns, torque[rows], position[rows]):
            bench.put(block)
        bench.finish()

    bench = Bench(tmp_path, workers, history={"keep_raw_windows": 2})
    send(bench, 5, 0, START_NS)
    send(bench, 2**62, 10**12, START_NS + 10**12, slice(0, 100))
    bench.step(5.0)
    bench.step(5.0)
    assert bench.heard("status")[-1]["committed"] == {"epoch": 2**62, "seq": 10**12 + 99}
    bench.store.close()
    again = Bench(tmp_path, workers, history={"keep_raw_windows": 2})
    send(again, 5, 600, START_NS + 10**13)
    status = again.heard("status")[-1]
    assert (status["committed"], status["samples"]) == ({"epoch": 5, "seq": 1199}, 1300)
    assert [one["window"]["first_seq"] for one in again.heard("parameters")] == [600, 800, 1000]
    assert again.pipeline.runs["axis-1"].drift.last[0] == 5
    for _ in range(3):
        again.step(6.0)
    assert again.store.read(1, WindowId(5, 800, 200)).seq == 800  # the newest two are kept, the stray's samples are not
    with pytest.raises(DatabaseError):
        again.store.read(1, WindowId(2**62, 10**12, 100))


def test_what_a_publisher_still_has_is_fetched_before_a_gap_is_declared(tmp_path, workers):
    asked = []
    bench = Bench(tmp_path, workers, fetch=lambda key: asked.append(key) is None)
    torque, position = burst(AXIS, samples=600)
    blocks = list(blocks_of("axis-1", 1, 0, START_NS, torque, position))
    for block in (*blocks[:1], *blocks[3:]):
        bench.put(block)
    bench.step()
    bench.step(1.1)
    bench.step(8.0)  # a busy computer: the patience is long over
    assert asked == ["tribowatch/site/axis-1/samples"]
    assert bench.heard("status")[-1]["missing"] == 0
    for block in blocks[:2]:  # the cache has lost the third one
        bench.inbox.put(Message(asked[0], CBOR, encode_block(block), bench.now, fetched=True))
    bench.inbox.put(Message(asked[0], "", b"", bench.now, complete=True))
    bench.step()
    bench.step(3.0)
    bench.step()
    status = bench.heard("status")[-1]
    assert (status["committed"]["seq"], status["missing"], status["samples"]) == (599, 100, 500)
    assert status["rejected"] == {}
    assert len(asked) <= 2
    bench.finish()


def test_a_fetch_that_never_ends_holds_a_gap_up_no_longer_than_it_may_take(tmp_path, workers):
    bench = Bench(tmp_path, workers, fetch=lambda _key: False)
    torque, position = burst(AXIS, samples=600)
    blocks = list(blocks_of("axis-1", 1, 0, START_NS, torque, position))
    for block in (*blocks[:1], *blocks[2:]):
        bench.put(block)
    bench.step()
    bench.step(14.0)
    assert bench.heard("status")[-1]["missing"] == 0
    bench.step(2.0)
    bench.step()
    assert bench.heard("status")[-1]["missing"] == 100
    bench.finish()


def test_silence_is_stale_and_resolves_nothing(bench):
    torque, position = burst(AXIS, samples=200)
    for block in blocks_of("axis-1", 1, 0, START_NS, torque, position):
        bench.put(block)
    bench.finish()
    bench.step(90.0)
    assert bench.heard("alerts") == []
    bench.step(20.0)
    alert = bench.heard("alerts")[-1]
    assert (alert["kind"], alert["transition"]["after"]) == ("stale", "unacknowledged")
    assert "nothing received" in alert["alert"]["text"]
    for block in blocks_of("axis-1", 1, 200, START_NS + 10**12, torque, position):
        bench.put(block)
    bench.step()
    bench.step()
    assert bench.heard("alerts")[-1]["transition"]["after"] == "returned_unacknowledged"
    bench.finish()


def test_an_operator_acknowledges_and_a_second_time_changes_nothing(bench):
    torque, position = burst(AXIS, samples=200)
    bench.put(next(blocks_of("axis-1", 1, 0, START_NS, torque, position)))
    bench.step()
    bench.step(200.0)
    assert bench.order("acknowledge", author="Ada", kind="stale") == {
        "schema_version": 1, "action": "acknowledge", "axis": "axis-1",
        "kind": "stale", "changed": True, "state": "acknowledged", "until": None,
    }  # fmt: skip
    assert not bench.order("acknowledge", author="Bob", kind="stale")["changed"]
    assert bench.heard("alerts")[-1]["transition"]["author"] == "Ada"
    assert bench.store.alarms(1)["stale"].alarm.state is State.ACKNOWLEDGED
    with pytest.raises(QueryError, match="no alarm 'wear'"):
        bench.order("acknowledge", author="Ada", kind="wear")


def test_bad_data_in_a_row_raise_data_quality_and_good_data_end_it(bench):
    torque, position = burst(AXIS, samples=2000)
    frozen = np.full(2000, np.nan)
    for block in blocks_of("axis-1", 1, 0, START_NS, torque, frozen):
        bench.put(block)
    bench.finish()
    alert = bench.heard("alerts")[-1]
    assert (alert["kind"], alert["transition"]["after"]) == ("data_quality", "unacknowledged")
    for block in blocks_of("axis-1", 1, 2000, START_NS + 10**12, torque, position):
        bench.put(block)
    bench.finish()
    assert bench.heard("alerts")[-1]["transition"]["after"] == "returned_unacknowledged"


def test_strangers_are_counted_up_to_a_limit(bench):
    stamps = START_NS + np.arange(2) * STEP_NS
    for number in range(MAX_UNKNOWN + 20):
        name = f"stranger-{number}"
        block = Block(name, 1, 0, stamps, np.zeros(2), torque=np.zeros(2), dt_ns=STEP_NS)
        bench.put(block, f"tribowatch/site/{name}/samples")
        bench.step(0.0)
    bench.put(block, "tribowatch/site/alive/samples")
    bench.step()
    assert bench.pipeline.fleet.unknown_keys == 21
    with Reader(bench.url) as reader:
        axes = reader.axes()
    assert len(axes) == MAX_UNKNOWN + 1
    assert [axis.samples for axis in axes if not axis.listed] == [2] * MAX_UNKNOWN
    status = bench.heard("status")[-1]
    assert not status["listed"]
    assert "not listed" in status["state"]


def test_what_the_queue_could_not_hold_is_counted(bench):
    torque, position = burst(AXIS, samples=2000)
    for block in blocks_of("axis-1", 1, 0, START_NS, torque, position, size=10):
        bench.put(block)  # 200 blocks, the queue holds 100
    bench.finish()
    with Reader(bench.url) as reader:
        axis = reader.axis("axis-1")
    assert axis.rejected["queue_full"] == 100
    assert axis.samples == 1000


def test_axes_take_turns(tmp_path, workers):
    other = dataclasses.replace(AXIS, name="axis-2")
    bench = Bench(tmp_path, workers, axes=(AXIS, other))
    torque, position = burst(AXIS, samples=2000)
    for name, samples in (("axis-1", 2000), ("axis-2", 400)):
        for block in blocks_of(name, 1, 0, START_NS, torque[:samples], position[:samples], size=200):
            bench.put(block, f"tribowatch/site/{name}/samples")
    bench.finish()
    order = [axis for what, axis, _ in bench.told if what == "parameters"]
    assert order.count("axis-1") == 10
    assert max(n for n, axis in enumerate(order) if axis == "axis-2") < 9  # it did not wait behind the other ten


def test_a_faster_stream_is_averaged_down_and_a_window_covers_more_samples(tmp_path, workers):
    stream = dataclasses.replace(AXIS.stream, sample_time=None)
    axis = dataclasses.replace(AXIS, analysis_sample_time=0.05, stream=stream)  # the rate is learned from the stream
    bench = Bench(tmp_path, workers, axes=(axis,))
    torque, position = burst(AXIS, samples=2000)
    for block in blocks_of("axis-1", 1, 0, START_NS, torque, position):
        bench.put(block)
    bench.finish()
    windows = [one["window"] for one in bench.heard("parameters")]
    assert [(one["first_seq"], one["raw_samples"], one["samples"]) for one in windows] == [
        (0, 1000, 200), (1000, 1000, 200),
    ]  # fmt: skip


def test_what_was_stored_but_not_told_is_told_after_a_restart(tmp_path, workers):
    bench = Bench(tmp_path, workers)
    torque, position = burst(AXIS, samples=200)
    bench.put(next(blocks_of("axis-1", 1, 0, START_NS, torque, position)))
    bench.step()
    bench.untellable = "alerts"
    with pytest.raises(ConnectionError):
        bench.step(200.0)
    bench.store.close()
    again = Bench(tmp_path, workers)
    again.pipeline.tell_untold()
    assert [one["kind"] for one in again.heard("alerts")] == ["stale"]
    assert again.store.untold() == []


def test_old_answers_become_roll_ups(tmp_path, workers):
    bench = Bench(tmp_path, workers, history={"keep_days": 2.0})
    torque, position = burst(AXIS, samples=200)
    for day in range(5):
        for block in blocks_of("axis-1", 1, 200 * day, START_NS + day * 86_400 * 10**9, torque, position):
            bench.put(block)
    bench.finish()
    for _ in range(3):
        bench.step(2.0)
    with Reader(bench.url) as reader:
        axis, series = reader.axis("axis-1"), reader.history("axis-1")["series"]["coulomb_force"]
    assert (axis.verdicts, series["answers"], len(series["points"])) == ({"identified": 5}, 5, 5)
    assert len(bench.store.pending()) == 0
    with bench.store._engine.connect() as connection:
        assert connection.exec_driver_sql("select count(*) from estimate").scalar_one() == 3
