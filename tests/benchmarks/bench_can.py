"""How many frames a second does the bridge take, and at what price? `make bench-can`.

A bus of datagrams on this computer carries SYNC at 1 kHz and four drives with two PDOs each: 9000 frames a second, what
a saturated 1 Mbit/s bus carries at most. Bridge and receiver are processes of their own. The receiver counts samples by
number, so "lost" means lost anywhere between the sender's socket and the last subscriber. Beside it, in the same run,
what one would write without us: a python-can Notifier whose listener calls cantools' `decode_message`; it publishes the
same blocks.
"""

from __future__ import annotations

import argparse
import itertools
import json
import multiprocessing
import random
import socket
import struct
import sys
import tempfile
import threading
import time
from pathlib import Path

GROUP = "239.74.163.2"
DRIVES = 4
PERIOD = 0.001
FRAMES = 1 + 2 * DRIVES  # of one period
DBC = 'VERSION ""\nNS_ :\nBS_:\nBU_: M\n' + "".join(
    f"BO_ {0x180 + node} A{node}: 8 M\n"
    ' SG_ Status : 0|16@1+ (1,0) [0|0] "" M\n'
    ' SG_ Position : 16|32@1- (1E-06,0) [0|0] "m" M\n'
    ' SG_ Torque : 48|16@1- (0.008,0) [0|0] "Nm" M\n'
    f"BO_ {0x280 + node} B{node}: 6 M\n"
    ' SG_ Velocity : 0|32@1- (1E-06,0) [0|0] "m/s" M\n'
    ' SG_ Temperature : 32|16@1- (0.1,0) [0|0] "degC" M\n'
    for node in range(1, DRIVES + 1)
)


def send(port: int, frames_per_second: float, seconds: float) -> dict[str, float]:
    """Put periods on the bus, evenly; datagrams are made before, as python-can makes them."""
    import can
    from can.interfaces.udp_multicast.utils import pack_message

    def packed(key: int, data: bytes) -> bytes:
        return pack_message(can.Message(arbitration_id=key, is_extended_id=False, data=data))

    syncs = [packed(0x80, bytes([number + 1])) for number in range(240)]
    answers = []
    for step in range(200):
        datagrams = []
        for node in range(1, DRIVES + 1):
            datagrams.append(packed(0x180 + node, struct.pack("<Hih", 0x0627, 1000 * node + step, step - 100)))
            datagrams.append(packed(0x280 + node, struct.pack("<ih", step, 215)))
        answers.append(datagrams)
    bus = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    bus.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
    periods = round(seconds * frames_per_second / FRAMES)
    begun = time.perf_counter()
    for period in range(periods):
        ahead = begun + period * FRAMES / frames_per_second - time.perf_counter()
        if ahead > 0.0005:
            time.sleep(ahead)
        bus.sendto(syncs[period % 240], (GROUP, port))
        for datagram in answers[period % 200]:
            bus.sendto(datagram, (GROUP, port))
    took = time.perf_counter() - begun
    bus.sendto(syncs[periods % 240], (GROUP, port))  # closes the last sample
    bus.close()
    return {"periods": periods, "rate": periods * FRAMES / took}


def ours(folder: str, endpoint: str, port: int, stop, told) -> None:
    """The bridge, in a process of its own."""
    from plant.bridge_can import run_bridge
    from plant.bridge_file import read_bridge
    from plant.zenoh_session import open_session

    axes = "".join(
        f'[[axis]]\nname = "a{node}"\nnode = {node}\ncounts_per_unit = 1e6\nrated_torque = 8.0\n'
        'pdo = [{ objects = ["6041:16", "6064:32", "6077:16"] }, { objects = ["606C:32", "2033:16:temperature"] }]\n'
        for node in range(1, DRIVES + 1)
    )
    path = Path(folder) / "bridge.toml"
    path.write_text(
        f'name = "bench"\nsite = "s"\n[zenoh]\nconnect = ["{endpoint}"]\n[can]\ninterface = "udp_multicast"\n'
        f'channel = "{GROUP}"\nsilence = 600.0\noptions = {{ port = {port}, hop_limit = 0 }}\n'
        f'[time]\nperiod = {PERIOD}\norigin = "time_object"\n{axes}'
    )
    ended = threading.Event()
    threading.Thread(target=lambda: (stop.wait(), ended.set()), daemon=True).start()
    with open_session("client", connect=[endpoint]) as session:
        begun = time.process_time()
        ready = threading.Timer(0.5, lambda: told.send("ready"))
        ready.start()
        status = run_bridge(read_bridge(path), session, stop=ended)
        told.send(
            {
                "cpu": time.process_time() - begun,
                "frames": status["frames"]["frames"],
                "bus": status["bus"],
                "lost": sum(one["lost"] + one["absent"] for one in status["axes"].values()),
            }
        )


def plain(folder: str, endpoint: str, port: int, stop, told) -> None:
    """What one would write: Notifier, `decode_message`, a block when a hundred samples are there."""
    import can
    import cantools
    import numpy as np

    from plant.publisher import SamplePublisher
    from plant.zenoh_session import open_session

    database = cantools.database.load_string(DBC, "dbc")
    with open_session("client", connect=[endpoint]) as session:
        publishers = {0x180 + node: SamplePublisher(session, "s", f"a{node}") for node in range(1, DRIVES + 1)}
        rows = {key: [] for key in publishers}
        latest = {}
        heard = [0]

        class Listener(can.Listener):
            def on_message_received(self, message):
                heard[0] += 1
                if message.arbitration_id == 0x80:
                    return
                values = database.decode_message(message.arbitration_id, message.data, decode_choices=False)
                key = message.arbitration_id
                if key not in rows:
                    latest[key - 0x100] = values
                    return
                other = latest.get(key, {})
                sample = (message.timestamp, values["Position"], values["Torque"], other.get("Velocity", np.nan),
                          other.get("Temperature", np.nan))  # fmt: skip
                rows[key].append(sample)
                if len(rows[key]) == 100:
                    self.publish(key)

            def publish(self, key):
                t, position, torque, velocity, temperature = np.array(rows[key]).T
                rows[key] = []
                stamps = np.maximum.accumulate(np.rint(t * 1e9).astype(np.int64) + np.arange(len(t)))
                publishers[key].send(stamps, position, torque=torque, velocity=velocity, temperature=temperature)

        bus = can.Bus(interface="udp_multicast", channel=GROUP, port=port, hop_limit=0)
        listener = Listener()
        begun = time.process_time()
        notifier = can.Notifier(bus, [listener])
        told.send("ready")
        stop.wait()
        notifier.stop()
        for key in rows:
            if rows[key]:
                listener.publish(key)
        told.send(
            {"cpu": time.process_time() - begun, "frames": heard[0], "bus": {"last_error": str(notifier.exception)}}
        )
        bus.shutdown()
        for publisher in publishers.values():
            publisher.__exit__(None, None, None)


def run(kind, frames_per_second: float, seconds: float) -> dict:
    """One bridge, one sender, one receiver (this process, which is the hub)."""
    import zenoh.ext

    from monitor.inbox import Inbox
    from monitor.recovery_zenoh import Recovery
    from plant import keys
    from plant.wire import decode_block
    from plant.zenoh_session import open_session

    heard = {f"a{node}": {} for node in range(1, DRIVES + 1)}  # samples of a block by its number
    inbox, ended = Inbox(20_000), threading.Event()

    def note(payload: bytes, encoding: str) -> None:
        block = decode_block(payload, encoding)
        heard[block.axis][block.seq] = len(block)

    def receive(sample) -> None:
        note(sample.payload.to_bytes(), str(sample.encoding))

    def total() -> int:
        return sum(sum(blocks.values()) for blocks in heard.values())

    def mend(recovery: Recovery) -> None:
        """As the daemon does: what Zenoh's own recovery left out is asked of the publisher's cache."""
        while not ended.wait(0.5):
            for axis, blocks in heard.items():
                known = [(0, 0), *sorted(list(blocks.items()))]
                if any(seq + n < after for (seq, n), (after, _) in itertools.pairwise(known)):
                    recovery.fetch(keys.samples_key("s", axis))
            for message in inbox.take(20_000, 0.0)[0]:
                if not message.complete:
                    note(message.payload, message.encoding)

    port = random.SystemRandom().randrange(20_000, 40_000)
    context = multiprocessing.get_context("spawn")
    with tempfile.TemporaryDirectory(prefix="b") as folder:
        endpoint = f"unixsock-stream/{folder}/z.sock"
        with open_session("peer", listen=[endpoint]) as hub:
            subscriber = zenoh.ext.declare_advanced_subscriber(
                hub, keys.samples_pattern("s"), receive,
                history=zenoh.ext.HistoryConfig(detect_late_publishers=True),
                recovery=zenoh.ext.RecoveryConfig(periodic_queries=None, heartbeat=True),
            )  # fmt: skip
            mending = threading.Thread(target=mend, args=(Recovery(hub, inbox),))
            mending.start()
            stop = context.Event()
            ear, mouth = context.Pipe(duplex=False)
            bridge = context.Process(target=kind, args=(folder, endpoint, port, stop, mouth))
            bridge.start()
            assert ear.recv() == "ready"
            time.sleep(0.5)
            began = time.perf_counter()
            sent = send(port, frames_per_second, seconds)
            took = time.perf_counter() - began
            time.sleep(2.0)
            stop.set()
            told = ear.recv()
            bridge.join()
            deadline = time.monotonic() + 10
            while total() < sent["periods"] * DRIVES and time.monotonic() < deadline:
                time.sleep(0.05)
            ended.set()
            mending.join()
            subscriber.undeclare()
    frames = int(sent["periods"] * FRAMES + 1)
    return {
        "bridge": kind.__name__,
        "asked": frames_per_second,
        "frames_per_second": round(sent["rate"], 1),
        "seconds": round(took, 2),
        "frames": frames,
        "frames_lost": frames - told["frames"],
        "samples": int(sent["periods"] * DRIVES),
        "samples_lost": int(sent["periods"] * DRIVES) - total(),
        "reported_lost": told.get("lost"),
        "cpu_share": round(told["cpu"] / took, 4),
        "cpu_us_per_frame": round(1e6 * told["cpu"] / max(1, told["frames"]), 2),
        "overruns": told["bus"].get("overruns", 0),
    }


def main() -> None:
    """Run the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0, help="of the run at 9000 frames/s")
    parser.add_argument("--rates", type=float, nargs="*", default=[12000.0, 16000.0, 24000.0], help="then 5 s of each")
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    results = []
    for kind in (ours, plain):
        results.append(run(kind, 9000.0, arguments.seconds))
        sys.stderr.write(f"{results[-1]}\n")
    for rate in arguments.rates:
        for kind in (ours, plain):
            results.append(run(kind, rate, 5.0))
            sys.stderr.write(f"{results[-1]}\n")
    if arguments.json:
        sys.stdout.write(json.dumps({"schema_version": 1, "runs": results}) + "\n")
        return
    sys.stdout.write(
        "| bridge | frames/s | frames | lost | samples lost | reported | CPU share | us per frame |\n"
        + 8 * "|---"
        + "|\n"
    )
    for one in results:
        reported = "-" if one["reported_lost"] is None else one["reported_lost"]
        sys.stdout.write(
            f"| {one['bridge']} | {one['frames_per_second']:.0f} | {one['frames']} | {one['frames_lost']} | "
            f"{one['samples_lost']} | {reported} | {one['cpu_share']:.0%} | {one['cpu_us_per_frame']:.1f} |\n"
        )


if __name__ == "__main__":
    main()
