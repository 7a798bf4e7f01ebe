"""A CAN bus, received in a thread of its own that does nothing else, and opened anew when it dies. By python-can.

No Notifier: its thread ends silently when anything raises. Every kind of failure of `recv` closes the bus and opens it
again with growing pauses, and so does a long silence: some adapters never say that they were unplugged.
"""

from __future__ import annotations

import contextlib
import logging
import os
import socket
import threading
import time
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Self

import can

from plant.can_batch import DATA, ERROR, REMOTE, RawFrame
from plant.can_layout import EXTENDED
from plant.errors import InputError, ReachError

LISTEN = 0.1  # s that one recv waits; the longest time to notice a stop
MOST_WAITING = 200_000  # frames that wait to be processed, 20 s of a full bus; more are dropped, counted
ECHO = 2.0  # s in which a frame must come back
FIRST_PAUSE = 0.1  # s before the first attempt to open the bus again
RECEIVE_BUFFER = 8 << 20  # bytes asked of the kernel; it gives what net.core.rmem_max allows
FOREIGN_CLOCK = 86_400.0  # s; a stamp farther from now is not Unix time, and the host's clock is taken


@dataclass(slots=True)
class BusCounters:
    """What became of the bus.

    Attributes:
        state: opening, active, silent, or lost.
        reconnects: opened anew after an error.
        reopened: opened anew after a silence.
        overruns: frames dropped because nobody took them.
        foreign_stamps: frames whose stamp was no Unix time.
        last_error: what the adapter said.
        last_frame_ns: Unix time of the latest frame. [ns]
    """

    state: str = "opening"
    reconnects: int = 0
    reopened: int = 0
    overruns: int = 0
    foreign_stamps: int = 0
    last_error: str | None = None
    last_frame_ns: int | None = None


def open_bus(interface: str, channel: str, bitrate: int = 0, options: Mapping[str, Any] | None = None) -> can.BusABC:
    """Open a bus.

    Raises:
        InputError: an interface that python-can does not know, that lacks its driver, or a wrong option.
        ReachError: the device is not there or cannot be had.
    """
    words: dict[str, Any] = dict(options or {})
    if bitrate:
        words["bitrate"] = bitrate
    where = f"CAN bus {interface} {channel}"
    if not (library := logging.getLogger("can")).handlers:  # what matters of it is in the errors
        library.addHandler(logging.NullHandler())
    try:
        bus = can.Bus(channel=channel, interface=interface, **words)
    except can.CanInterfaceNotImplementedError as error:
        raise InputError(f"{where}: {error}; python-can's interfaces: socketcan, udp_multicast, virtual, ...") from None
    except (TypeError, ValueError) as error:
        raise InputError(f"{where}: {error}; see the options of this interface in python-can") from None
    except (can.CanError, OSError) as error:
        hint = ""
        if interface == "socketcan":
            hint = f"; is there a CAN device, and is it up: ip link set {channel} up type can bitrate 1000000"
        raise ReachError(f"{where}: cannot be opened: {_words(error)}{hint}") from None
    _enlarge(bus)
    return bus


def carries_frames(interface: str, channel: str, options: Mapping[str, Any] | None = None) -> bool:
    """Whether a frame sent on this bus reaches another program on this computer; for buses without hardware.

    Raises:
        InputError, ReachError: see `open_bus`.
    """
    with contextlib.ExitStack() as stack:
        one, other = (open_bus(interface, channel, 0, options) for _ in range(2))
        stack.callback(one.shutdown)
        stack.callback(other.shutdown)
        try:
            one.send(can.Message(arbitration_id=0x7FF, is_extended_id=False), timeout=1.0)
            return other.recv(ECHO) is not None
        except (can.CanError, OSError):
            return False


def _words(error: BaseException) -> str:
    cause = error.__cause__
    return f"{error}" + (f" ({cause})" if cause is not None else "")


def _enlarge(bus: can.BusABC) -> None:
    """Ask the kernel for a longer queue: its default holds 30 ms of a full bus."""
    force = getattr(socket, "SO_RCVBUFFORCE", 33)  # Linux; needs a privilege
    with (
        contextlib.suppress(OSError, NotImplementedError, ValueError, AttributeError),  # no socket behind this bus
        socket.socket(fileno=os.dup(bus.fileno())) as twin,
    ):
        try:
            twin.setsockopt(socket.SOL_SOCKET, force, RECEIVE_BUFFER)
        except OSError:
            twin.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER)


class BusReader:
    """Receives in a thread; `take()` gives what has come. A context manager: leaving it closes the bus."""

    def __init__(
        self,
        interface: str,
        channel: str,
        *,
        bitrate: int = 0,
        options: Mapping[str, Any] | None = None,
        silence: float = 5.0,
        longest_retry: float = 5.0,
    ) -> None:
        """Open the bus.

        Args:
            interface: of python-can.
            channel: device, multicast address or name.
            bitrate: 0 = as the link is set. [bit/s]
            options: further words for the interface.
            silence: without a frame for so long the bus is opened anew. [s]
            longest_retry: longest pause between two attempts. [s]

        Raises:
            InputError, ReachError: see `open_bus`.
        """
        self.counters = BusCounters()
        self._arguments = (interface, channel, bitrate, options)
        self._silence, self._longest_retry = silence, longest_retry
        self._bus: can.BusABC | None = open_bus(*self._arguments)
        self._frames: deque[RawFrame] = deque()
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"CAN {channel}", daemon=True)

    def __enter__(self) -> Self:
        """Begin to receive."""
        self._thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """Stop and close the bus."""
        self._stop.set()
        self._thread.join()
        self._close()

    def take(self) -> list[RawFrame]:
        """The frames that have come since the last call."""
        waiting = self._frames  # appended to by the other thread meanwhile
        return [waiting.popleft() for _ in range(len(waiting))]

    def _run(self) -> None:
        heard = time.time()
        pause = FIRST_PAUSE
        while not self._stop.is_set():
            try:
                if self._bus is None:
                    self._bus = open_bus(*self._arguments)
                    heard = time.time()
                message = self._bus.recv(LISTEN)
            except Exception as error:  # an adapter may raise anything; nothing may end this thread
                self._fail(_words(error), "lost")
                self.counters.reconnects += 1
                self._stop.wait(pause)
                pause = min(2 * pause, self._longest_retry)
                continue
            if message is not None:
                heard, pause = time.time(), FIRST_PAUSE
                self._keep(message, heard)
            elif abs(time.time() - heard) > self._silence:  # a clock that is set opens the bus anew once
                self._fail(None, "silent")
                self.counters.reopened += 1

    def _keep(self, message: can.Message, now: float) -> None:
        counters, stamp = self.counters, message.timestamp
        if not -FOREIGN_CLOCK < stamp - now < FOREIGN_CLOCK:
            counters.foreign_stamps += 1
            stamp = now
        t_ns = int(stamp * 1e9)
        counters.state, counters.last_frame_ns = "active", t_ns
        if len(self._frames) >= MOST_WAITING:
            counters.overruns += 1
        else:
            self._frames.append(raw_frame(message, t_ns))

    def _fail(self, said: str | None, state: str) -> None:
        self.counters.state = state
        if said is not None:
            self.counters.last_error = said
        self._close()

    def _close(self) -> None:
        if self._bus is not None:
            with contextlib.suppress(Exception):  # of an adapter that is gone
                self._bus.shutdown()
            self._bus = None


def raw_frame(message: can.Message, t_ns: int) -> RawFrame:
    """A message of python-can as a plain tuple."""
    if message.is_error_frame:
        return ERROR, message.arbitration_id, t_ns, b""
    kind = REMOTE if message.is_remote_frame else DATA
    key = message.arbitration_id
    return kind, key | EXTENDED if message.is_extended_id else key, t_ns, message.data
