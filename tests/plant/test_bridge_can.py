"""The bridge at work: a bus of python-can within this process, real Zenoh sessions, faults of bus and drives."""

import contextlib
import itertools
import json
import struct
import threading
import time

import can
import numpy as np
import pytest
import zenoh
import zenoh.ext

from plant import bus_can, keys
from plant.bridge_can import run_bridge
from plant.bridge_file import read_bridge
from plant.bus_can import BusReader, open_bus
from plant.drive_can import play_scenario
from plant.errors import InputError, ReachError
from plant.scenario_file import read_scenario
from plant.wire import decode_block
from plant.zenoh_session import open_session

DEADLINE = 30.0
BUSES = (f"bus-{number}" for number in itertools.count())
DRIVE = "node = {node}\ncounts_per_unit = 1e6\nrated_torque = 8.0\n"


def wait_until(condition):
    deadline = time.monotonic() + DEADLINE
    while not (found := condition()):
        assert time.monotonic() < deadline, "did not happen in time"
        time.sleep(0.005)
    return found


class Line:
    """A bridge in a thread between a virtual bus and a listener on Zenoh."""

    def __init__(self, folder, nodes=(1,), can_lines="silence = 60.0", time_lines="", axis_lines=""):
        self.channel, self.endpoint = next(BUSES), f"unixsock-stream/{folder}/z.sock"
        axes = "".join(f'[[axis]]\nname = "axis-{node:04d}"\n{DRIVE.format(node=node)}{axis_lines}' for node in nodes)
        path = folder / "bridge.toml"
        path.write_text(
            f'name = "b-1"\nsite = "s"\n[zenoh]\nconnect = ["{self.endpoint}"]\n[can]\ninterface = "virtual"\n'
            f'channel = "{self.channel}"\n{can_lines}\n[block]\nstatus = 0.05\nseconds = 0.05\n'
            f'[time]\norigin = "time_object"\n{time_lines}\n{axes}'
        )
        self.settings = read_bridge(path)
        self.blocks, self.statuses, self.result, self.error = [], [], None, None
        self.stop = threading.Event()

    def __enter__(self):
        self._stack = contextlib.ExitStack()
        hub = self._stack.enter_context(open_session("peer", listen=[self.endpoint]))
        subscriber = zenoh.ext.declare_advanced_subscriber(  # as the daemon does: first blocks may come before the link
            hub,
            keys.samples_pattern("s"),
            lambda sample: self.blocks.append(decode_block(sample.payload.to_bytes(), str(sample.encoding))),
            history=zenoh.ext.HistoryConfig(detect_late_publishers=True),
            recovery=zenoh.ext.RecoveryConfig(periodic_queries=None, heartbeat=True),
        )
        self._stack.callback(subscriber.undeclare)
        self._stack.enter_context(
            hub.declare_subscriber(
                keys.bridge_key("s", "b-1"), lambda sample: self.statuses.append(json.loads(sample.payload.to_bytes()))
            )
        )
        session = self._stack.enter_context(open_session("client", connect=[self.endpoint]))
        self.alive = lambda: [str(reply.ok.key_expr) for reply in hub.liveliness().get(keys.alive_pattern("s"))]
        self._thread = threading.Thread(target=self._run, args=(session,))
        self._thread.start()
        wait_until(lambda: self.statuses or self.error)
        return self

    def _run(self, session):
        try:
            self.result = run_bridge(self.settings, session, stop=self.stop)
        except Exception as error:
            self.error = error

    def end(self):
        self.stop.set()
        self._thread.join()
        assert self.error is None, self.error
        return self.result

    def __exit__(self, *_):
        self.stop.set()
        self._thread.join()
        self._stack.close()

    def bus(self):
        return contextlib.closing(Sender(self.channel))

    def received(self, axis="axis-0001"):
        return sum(len(block) for block in self.blocks if block.axis == axis)


class Sender:
    def __init__(self, channel):
        self._bus, self.number = open_bus("virtual", channel), 0

    def send(self, key, data, **more):
        self._bus.send(can.Message(arbitration_id=key, is_extended_id=False, data=data, **more))

    def cycle(self, count, nodes=(1,), status=0x0627):
        for _ in range(count):
            self.send(0x80, bytes([self.number % 240 + 1]))
            for node in nodes:
                self.send(0x180 + node, struct.pack("<Hih", status, self.number, 5))
            self.number += 1

    def close(self):
        self._bus.shutdown()


def test_a_scenario_on_the_bus_arrives_as_the_machine_measured_it(tmp_path):
    scenario = read_scenario("wear")
    bursts = [scenario.burst(number) for number in range(2)]
    with Line(tmp_path) as line:
        played = play_scenario(scenario, line.settings, last=2)
        wait_until(lambda: line.received() >= 4000)
        assert keys.alive_key("s", "b-1") in line.alive()
        status = line.end()
    assert (played.bursts, played.samples) == (2, 4000)
    assert status["frames"]["frames"] == played.frames
    assert (status["axes"]["axis-0001"]["sent"], status["axes"]["axis-0001"]["lost"]) == (4000, 0)
    assert status["axes"]["axis-0001"]["boot_ups"] == 1
    stamps, position, torque, seq = (
        np.concatenate([values(block) for block in line.blocks])
        for values in (
            lambda block: block.t_ns,
            lambda block: block.position,
            lambda block: block.torque,
            lambda block: block.seq + np.arange(len(block)),
        )
    )
    assert seq.tolist() == list(range(4000))
    for number, burst in enumerate(bursts):
        part = slice(2000 * number, 2000 * (number + 1))
        np.testing.assert_array_equal(stamps[part], burst.begin_ns + 10_000_000 * np.arange(2000))
        np.testing.assert_allclose(position[part], burst.recording.position, atol=5.1e-7)
        np.testing.assert_allclose(torque[part], burst.recording.force / scenario.axis.mechanics.gain, atol=4.1e-3)


def test_several_drives_share_a_bus_and_a_dead_one_harms_nobody(tmp_path):
    with Line(tmp_path, nodes=(1, 2, 3)) as line, line.bus() as bus:
        bus.cycle(300, nodes=(1, 2, 3))
        bus.cycle(300, nodes=(1, 3))
        bus.cycle(1, nodes=())
        wait_until(lambda: line.received("axis-0001") == 600 and line.received("axis-0003") == 600)
        status = line.end()
    assert [status["axes"][f"axis-000{node}"]["sent"] for node in (1, 2, 3)] == [600, 300, 600]


def test_a_bus_that_dies_is_opened_anew_and_the_stream_goes_on(tmp_path, monkeypatch):
    dead, real = threading.Event(), can.interfaces.virtual.VirtualBus._recv_internal

    def recv(self, timeout):
        if dead.is_set():
            raise can.CanOperationError("adapter unplugged")
        return real(self, timeout)

    with Line(tmp_path, can_lines="silence = 60.0\nlongest_retry = 0.1") as line, line.bus() as bus:
        bus.cycle(200)
        wait_until(lambda: line.received() >= 199)
        monkeypatch.setattr(can.interfaces.virtual.VirtualBus, "_recv_internal", recv)
        dead.set()
        wait_until(lambda: line.statuses[-1]["bus"]["reconnects"] >= 2)
        assert line.statuses[-1]["bus"]["state"] == "lost"
        assert "unplugged" in line.statuses[-1]["bus"]["last_error"]
        dead.clear()
        wait_until(lambda: line.statuses[-1]["bus"]["reconnects"] and _heard_again(line, bus))
        before = line.received()
        bus.cycle(200)
        wait_until(lambda: line.received() >= before + 199)
        sent = line.end()["axes"]["axis-0001"]["sent"]
        wait_until(lambda: line.received() == sent)


def _heard_again(line, bus):
    bus.cycle(1)
    return line.statuses[-1]["bus"]["state"] == "active"


def test_a_silent_bus_is_opened_anew(tmp_path):
    with Line(tmp_path, can_lines="silence = 0.2") as line:
        wait_until(lambda: line.statuses[-1]["bus"]["reopened"] >= 1)
        assert line.statuses[-1]["bus"]["state"] == "silent"
        with line.bus() as bus:
            bus.cycle(150)
            wait_until(lambda: line.received() >= 100)


def test_an_emergency_storm_and_garbage_do_not_disturb_the_stream(tmp_path):
    rng = np.random.default_rng(3)
    with Line(tmp_path) as line, line.bus() as bus:
        for _ in range(20):
            bus.cycle(20)
            for _ in range(50):
                bus.send(0x81, struct.pack("<HB5x", 0x8611, 1))
                bus.send(int(rng.integers(0x200, 0x580)), rng.bytes(int(rng.integers(0, 9))))
            bus.send(0x181, b"", is_remote_frame=True)
            bus.send(0x40, b"", is_error_frame=True)
        bus.cycle(1)
        wait_until(lambda: line.received() >= 400)
        status = line.end()
    axis, frames = status["axes"]["axis-0001"], status["frames"]
    assert (axis["lost"], axis["filled"], axis["emergencies"]) == (0, 0, 1000)
    assert (frames["bus_off"], frames["remote"], frames["unknown"]) == (20, 20, 1000)
    assert frames["frames"] == 2 * 401 + 1000 + 1000 + 20 + 20


def test_a_drive_that_resets_shows_and_its_gap_is_counted(tmp_path):
    with Line(tmp_path) as line, line.bus() as bus:
        bus.cycle(200)
        bus.cycle(30, nodes=())
        bus.send(0x701, b"\x00")
        bus.cycle(200, status=0x0250)
        bus.cycle(1)
        wait_until(lambda: line.received() >= 400)
        axis = line.end()["axes"]["axis-0001"]
    assert (axis["lost"], axis["boot_ups"], axis["sent"]) == (30, 1, 401)
    seq = np.concatenate([block.seq + np.arange(len(block)) for block in line.blocks])
    assert np.flatnonzero(np.diff(seq) == 31).tolist() == [199]


def test_a_layout_that_does_not_fit_sends_nothing_and_says_why(tmp_path):
    with Line(tmp_path) as line, line.bus() as bus:
        for number in range(300):
            bus.send(0x80, b"")
            bus.send(0x181, struct.pack("<Hhh", 0x0627, number, 5))
        said = wait_until(lambda: line.statuses[-1]["axes"]["axis-0001"]["refused"])
        line.end()
    assert "6 bytes, the layout has 8" in said
    assert line.blocks == []


@pytest.mark.parametrize(
    ("interface", "channel", "kind", "words"),
    [
        ("nonsense", "x", InputError, "nonsense x"),
        ("socketcan", "no-such-can0", ReachError, "ip link set no-such-can0 up"),
    ],
)
def test_a_bus_that_cannot_be_opened_is_one_line(interface, channel, kind, words):
    with pytest.raises(kind, match=words) as caught:
        BusReader(interface, channel)
    assert "\n" not in str(caught.value)


def test_stamps_of_an_adapter_that_counts_from_its_start_are_replaced(monkeypatch):
    reader = BusReader("virtual", next(BUSES))
    reader._keep(can.Message(timestamp=12.5, arbitration_id=1, is_extended_id=False), time.time())
    ((_, _, t_ns, _),) = reader.take()
    assert abs(t_ns * 1e-9 - time.time()) < 60
    assert reader.counters.foreign_stamps == 1
    monkeypatch.setattr(bus_can, "MOST_WAITING", 1)
    for _ in range(3):
        reader._keep(can.Message(timestamp=time.time(), arbitration_id=1, is_extended_id=False), time.time())
    assert reader.counters.overruns == 2
    with reader:
        pass
