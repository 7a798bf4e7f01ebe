"""The CAN bridge: a bus in, the streams of its axes out on Zenoh, and a status that says what was counted. Does I/O.

The bus is read in a thread (`bus_can`); everything else happens here, in batches: `can_assembly` makes samples of
frames, blocks go to the publishers, and once a second a status goes to `<prefix>/<site>/<bridge>/bridge`.
"""

from __future__ import annotations

import contextlib
import dataclasses
import json
import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from plant import keys
from plant.acknowledgement import Acknowledgements
from plant.bridge_settings import BridgeSettings
from plant.bus_can import BusReader
from plant.can_assembly import Assembler
from plant.can_axis import Piece
from plant.can_batch import batch
from plant.errors import PayloadError
from plant.publisher import HEARTBEAT, SamplePublisher
from plant.wire import Block

if TYPE_CHECKING:
    import zenoh

BATCH = 0.1  # s from one batch of frames to the next: numpy is slow on few frames, and blocks wait longer
LINGER = 3 * HEARTBEAT  # s at the end, in which a subscriber notices a lost tail and fetches it
SCHEMA_VERSION = 1


class AxisStream:
    """Collects the samples of one axis and sends them as blocks."""

    def __init__(self, publisher: SamplePublisher, samples: int, seconds: float) -> None:
        """Send blocks of `samples`, or what there is after `seconds`."""
        self._publisher, self._samples, self._seconds = publisher, samples, seconds
        self._pieces: list[Piece] = []
        self._waiting = 0
        self._since = 0.0
        self.blocks = self.sent = self.bytes = self.refused_blocks = 0

    def add(self, piece: Piece, now: float) -> None:
        """Take the next samples; a jump of numbers or a new segment sends what is there first."""
        if self._pieces:
            last = self._pieces[-1]
            if piece.seq != last.seq + len(last) or piece.segment != last.segment or piece.t_ns[0] <= last.t_ns[-1]:
                self.flush()
        if not self._pieces:
            self._since = now
        self._pieces.append(piece)
        self._waiting += len(piece)
        if self._waiting >= self._samples:
            self.flush(whole=True)

    def due(self, now: float) -> None:
        """Send what has waited long enough."""
        if self._pieces and now - self._since >= self._seconds:
            self.flush()

    def flush(self, whole: bool = False) -> None:
        """Send what is there; with `whole` keep what does not fill a block."""
        if not self._pieces:
            return
        first = self._pieces[0]
        stamps = np.concatenate([piece.t_ns for piece in self._pieces])
        channels = {name: np.concatenate([piece.channels[name] for piece in self._pieces]) for name in first.channels}
        end = len(stamps) - len(stamps) % self._samples if whole else len(stamps)
        for begin in range(0, end, self._samples):
            cut = slice(begin, min(begin + self._samples, end))
            self._send(first.seq + begin, stamps[cut], {name: column[cut] for name, column in channels.items()})
        self._pieces, self._waiting = [], len(stamps) - end
        if self._waiting:
            rest = {name: column[end:] for name, column in channels.items()}
            self._pieces = [Piece(first.seq + end, stamps[end:], rest, first.segment)]

    def _send(self, seq: int, stamps: Any, channels: dict[str, Any]) -> None:
        steps = np.diff(stamps)
        step = int(steps[0]) if len(steps) and np.all(steps == steps[0]) else None
        try:
            block = Block(self._publisher.axis_name, self._publisher.epoch, seq, stamps, dt_ns=step, **channels)
            self.bytes += self._publisher.put(block)
        except PayloadError:
            self.refused_blocks += 1
            return
        self.blocks += 1
        self.sent += len(stamps)


class Bridge:
    """A bridge at work; see `run_bridge`."""

    def __init__(
        self, settings: BridgeSettings, session: zenoh.Session, reader: BusReader, stack: contextlib.ExitStack
    ) -> None:
        """Declare the publishers of all axes; `stack` undeclares them."""
        self._settings, self._reader = settings, reader
        self.assembler = Assembler(settings.layouts, settings.time.rule(), settings.block.rule())
        prefix, site = settings.zenoh.prefix, settings.site
        self._key = keys.bridge_key(site, settings.name, prefix)
        self._session = session
        self.streams: dict[str, AxisStream] = {}
        self.heard: dict[str, Acknowledgements] = {}
        self._epochs: dict[str, int] = {}
        for layout in settings.layouts:
            publisher = stack.enter_context(SamplePublisher(session, site, layout.axis, prefix=prefix))
            self.streams[layout.axis] = AxisStream(publisher, settings.block.samples, settings.block.seconds)
            self._epochs[layout.axis] = publisher.epoch
            self.heard[layout.axis] = stack.enter_context(
                Acknowledgements(session, site, layout.axis, publisher.epoch, prefix)
            )
        token = session.liveliness().declare_token(keys.alive_key(site, settings.name, prefix))
        stack.callback(token.undeclare)
        self._begun = time.monotonic()
        self._rate = (self._begun, 0)
        self.frames_per_second = 0.0

    def step(self) -> None:
        """Process what has come."""
        now = time.monotonic()
        if frames := self._reader.take():
            for axis, piece in self.assembler.take(batch(frames)):
                self.streams[axis].add(piece, now)
        for stream in self.streams.values():
            stream.due(now)

    def finish(self) -> None:
        """Send what is left."""
        self.step()
        now = time.monotonic()
        for axis, piece in self.assembler.finish():
            self.streams[axis].add(piece, now)
        for stream in self.streams.values():
            stream.flush()

    def linger(self) -> None:
        """Stay until the daemon has what was sent last, or could have asked for it again."""
        deadline = time.monotonic() + LINGER
        while time.monotonic() < deadline and not all(
            self.heard[axis].committed >= self.assembler.axes[axis].next_seq - 1 for axis in self.streams
        ):
            time.sleep(0.02)

    def status(self) -> dict[str, Any]:
        """Everything that is counted; the JSON of the status and of `tribowatch bridge --json`."""
        now = time.monotonic()
        frames = self.assembler.frames.frames
        if now - self._rate[0] >= 0.5:
            self.frames_per_second = (frames - self._rate[1]) / (now - self._rate[0])
            self._rate = now, frames
        can = self._settings.can
        return {
            "schema_version": SCHEMA_VERSION,
            "bridge": self._settings.name,
            "site": self._settings.site,
            "seconds": round(now - self._begun, 3),
            "frames_per_second": round(self.frames_per_second, 1),
            "bus": {
                "interface": can.interface,
                "channel": can.channel,
                **dataclasses.asdict(self._reader.counters),
            },
            "frames": self.assembler.frames.to_dict(),
            "clock": dataclasses.asdict(self.assembler.clock.counters),
            "axes": {axis: self._axis_status(axis) for axis in self.streams},
        }

    def _axis_status(self, axis: str) -> dict[str, Any]:
        stream, heard = self.streams[axis], self.heard[axis]
        return {
            "epoch": self._epochs[axis],
            **self.assembler.axes[axis].counters.to_dict(),
            "refused": self.assembler.refused(axis),
            "blocks": stream.blocks,
            "sent": stream.sent,
            "bytes": stream.bytes,
            "refused_blocks": stream.refused_blocks,
            "next_seq": self.assembler.axes[axis].next_seq,
            "committed_seq": heard.committed,
            "missing_at_daemon": heard.missing,
        }

    def publish_status(self, status: dict[str, Any]) -> None:
        """Tell the status to whoever listens."""
        self._session.put(self._key, json.dumps(status), encoding="application/json")


def run_bridge(
    settings: BridgeSettings,
    session: zenoh.Session,
    *,
    stop: threading.Event | None = None,
    duration: float | None = None,
    on_status: Callable[[dict[str, Any]], None] | None = None,
) -> dict[str, Any]:
    """Bridge until `stop`, `duration` seconds of wall time or ^C; give the last status.

    Args:
        settings: of the bridge file.
        session: open session; the caller closes it.
        stop: set by others to end.
        duration: [s]; None goes on.
        on_status: told every status.

    Raises:
        InputError: an interface or option that cannot be.
        ReachError: the bus cannot be opened at the start; later it is tried again without end.
    """
    stop = stop or threading.Event()
    can, block = settings.can, settings.block
    with contextlib.ExitStack() as stack:
        reader = stack.enter_context(
            BusReader(
                can.interface,
                can.channel,
                bitrate=can.bitrate,
                options=settings.options,
                silence=can.silence,
                longest_retry=can.longest_retry,
            )
        )
        bridge = Bridge(settings, session, reader, stack)
        begun = time.monotonic()
        told = begun - block.status
        stack.callback(bridge.linger)  # the last of three, on ^C and SIGTERM too
        stack.callback(lambda: bridge.publish_status(bridge.status()))
        stack.callback(bridge.finish)
        while not stop.wait(BATCH) and (duration is None or time.monotonic() - begun < duration):
            bridge.step()
            if time.monotonic() - told >= block.status:
                told = time.monotonic()
                status = bridge.status()
                bridge.publish_status(status)
                if on_status is not None:
                    on_status(status)
        bridge.finish()
        return bridge.status()
