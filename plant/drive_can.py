"""The machine on a CAN bus: plays a scenario as a CiA 402 drive would, with the master's SYNC and TIME. Does I/O.

Each burst begins with the TIME object of its own date, so that months pass in minutes and every sample still has its
true stamp; a bridge with `origin = "time_object"` takes it from there. Between bursts the drive sends its heartbeat.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import can
import numpy as np

from plant import cia402
from plant.bridge_settings import BridgeSettings
from plant.bus_can import open_bus
from plant.can_layout import EXTENDED, AxisLayout, encode_frame
from plant.errors import InputError, ParameterError, ReachError
from plant.recording import Recording
from plant.scenario import NANOSECONDS, Burst, Scenario

ENABLED = 0x0637  # statusword: operation enabled, voltage on, remote, target reached
MOST_FRAMES = 8000  # per second: below what one Python process receives from udp_multicast while others work
HEARTBEAT = 1.0  # s
SLOW = 10  # samples from one frame without torque and position to the next, like transmission type 10


@dataclass(frozen=True, slots=True)
class Played:
    """What was put on the bus: complete bursts, their samples, all frames, wall time [s]."""

    bursts: int
    samples: int
    frames: int
    seconds: float
    interrupted: bool


def burst_frames(recording: Recording, layout: AxisLayout, gain: float) -> Iterator[list[tuple[int, bytes]]]:
    """What the drive answers to each SYNC: (key, data) of its PDOs, quantised as its counts are.

    Args:
        recording: in SI, force at the belt.
        layout: of the drive.
        gain: `Mechanics.gain`. [N per N·m]

    Raises:
        InputError: the layout asks for what the machine does not measure.
    """
    count = len(recording)
    values = {"position": recording.position, "torque": recording.force / gain, "force": recording.force}
    values |= {"statusword": np.full(count, float(ENABLED)), "error_code": np.zeros(count)}
    for name in ("velocity", "temperature", "load"):
        if getattr(recording, name) is not None:
            values[name] = getattr(recording, name)
    missing = [name for name in layout.channels() if name not in values]
    if missing:
        raise InputError(f"the simulated drive of {layout.axis} has no {', '.join(missing)}: leave it out of pdo")
    payloads = [
        (frame.key, 1 if frame.is_sampled else SLOW, encode_frame(frame, values, count)) for frame in layout.frames
    ]
    for row in range(count):
        yield [(key, payload[row].tobytes()) for key, every, payload in payloads if row % every == 0]


class Master:
    """The bus master and its drive: SYNC with a counter, TIME, heartbeat, PDOs."""

    def __init__(self, bus: can.BusABC, settings: BridgeSettings, node: int | None) -> None:
        """Send the boot-up of the node."""
        self._bus, self._time, self._node = bus, settings.time, node
        self._counter = 0
        self.frames = 0
        self._beat = 0.0
        if node is not None:
            self.send(cia402.HEARTBEAT + node, bytes([cia402.BOOT_UP]))

    def send(self, key: int, data: bytes) -> None:
        """Put one frame on the bus.

        Raises:
            ReachError: the bus does not take it.
        """
        extended = bool(key & EXTENDED)
        message = can.Message(arbitration_id=key & ~EXTENDED, is_extended_id=extended, data=data)
        try:
            self._bus.send(message, timeout=1.0)
        except (can.CanError, OSError) as error:
            raise ReachError(f"the CAN bus {self._bus.channel_info} does not take frames: {error}") from None
        self.frames += 1

    def sync(self) -> None:
        """Send SYNC, and the heartbeat when it is due."""
        self._counter = self._counter % self._time.overflow + 1
        self.send(self._time.rule().sync_key, bytes([self._counter]))
        if self._node is not None and (now := time.monotonic()) - self._beat >= HEARTBEAT:
            self._beat = now
            self.send(cia402.HEARTBEAT + self._node, b"\x05")

    def tell_time(self, unix_ns: int) -> None:
        """Send the TIME object."""
        self.send(cia402.TIME, cia402.time_of_day(unix_ns))


def play_scenario(
    scenario: Scenario,
    settings: BridgeSettings,
    *,
    speed: float | None = None,
    first: int = 0,
    last: int | None = None,
    most_frames: float = MOST_FRAMES,
    stop: threading.Event | None = None,
    on_burst: Callable[[Burst], object] | None = None,
) -> Played:
    """Play bursts `first` to `last` (excluded) of `scenario` on the bus of a bridge file.

    Args:
        scenario: what happens.
        settings: which bus, and the layout of the scenario's axis.
        speed: event seconds per second of wall clock; None goes as fast as `most_frames` allows. > 0
        first: number of the first burst.
        last: number after the last burst; None goes on to the end.
        most_frames: per second; a faster time-lapse is slowed down to it. > 0
        stop: set by others to end early.
        on_burst: called after each burst.

    Raises:
        InputError: the bridge file does not list the axis, its SYNC period is not the scenario's sample time, or the
            layout is not a drive's.
        ReachError: the bus cannot be opened or does not take frames.
    """
    if speed is not None and not speed > 0:
        raise ParameterError("speed", speed, "> 0", "event seconds per second")
    stop = stop or threading.Event()
    layout = settings.layout(scenario.axis.name)
    if layout is None:
        listed = ", ".join(one.axis for one in settings.layouts)
        raise InputError(
            f"the bridge file does not list axis {scenario.axis.name!r} of the scenario; it lists {listed}"
        )
    bursts = range(first, len(scenario) if last is None else min(last, len(scenario)))
    begun, samples, done = time.monotonic(), 0, 0
    bus = open_bus(settings.can.interface, settings.can.channel, settings.can.bitrate, settings.options)
    try:
        master = Master(bus, settings, layout.node)
        pace = _Pace(begun, speed, most_frames)
        for number in bursts:
            burst = scenario.burst(number)
            _check_period(burst.recording, settings)
            begin = (burst.begin_ns - scenario.begin_ns(first)) / NANOSECONDS
            master.tell_time(burst.begin_ns)
            for at, answers in zip(
                burst.recording.t, burst_frames(burst.recording, layout, scenario.axis.mechanics.gain), strict=True
            ):
                if pace.wait(begin + float(at), master.frames, stop):
                    return Played(done, samples, master.frames, time.monotonic() - begun, True)
                master.sync()
                for key, data in answers:
                    master.send(key, data)
                samples += 1
            master.sync()  # closes the last sample
            done += 1
            if on_burst:
                on_burst(burst)
        return Played(done, samples, master.frames, time.monotonic() - begun, False)
    finally:
        bus.shutdown()


def _check_period(recording: Recording, settings: BridgeSettings) -> None:
    if abs(recording.period - settings.time.period) > 1e-9:
        raise InputError(
            f"SYNC comes every {settings.time.period:g} s, the scenario samples every {recording.period:g} s; "
            "make [time] period of the bridge file the same"
        )


class _Pace:
    """When a sample may leave: when its time has come, and not more frames a second than allowed."""

    def __init__(self, begun: float, speed: float | None, most_frames: float) -> None:
        self._begun, self._speed, self._seconds_per_frame = begun, speed, 1.0 / most_frames

    def wait(self, event_seconds: float, frames: int, stop: threading.Event) -> bool:
        """Wait; True when stopped."""
        due = frames * self._seconds_per_frame
        if self._speed is not None:
            due = max(due, event_seconds / self._speed)
        ahead = self._begun + due - time.monotonic()
        if ahead > 0.002:  # sleeping for less takes longer than the wait
            return stop.wait(ahead)
        return stop.is_set()
