"""The recorder: listens to the streams of a site and writes them to files. Does I/O."""

from __future__ import annotations

import contextlib
import queue
import threading
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import zenoh
import zenoh.ext

from plant import keys
from plant.errors import ParameterError, PayloadError, RecordingError
from plant.record_files import PART, AxisRecorder, RecordCounters, RollRule
from plant.wire import Block, decode_block

MOST_WAITING = 20_000  # blocks that wait to be written; more are dropped, counted
LISTEN = 0.1  # s; the longest time to notice a stop
HELD = 0.5, 15.0  # s; least and most that blocks wait for those missing before them


@dataclass(slots=True)
class Recorded:
    """What was recorded.

    Attributes:
        axes: by name.
        refused: blocks by the reason why they could not be read.
        dropped: blocks that nobody wrote in time.
        seconds: of wall time. [s]
    """

    axes: dict[str, RecordCounters] = field(default_factory=dict)
    refused: Counter[str] = field(default_factory=Counter)
    dropped: int = 0
    seconds: float = 0.0

    @property
    def samples(self) -> int:
        """Of all axes."""
        return sum(one.samples for one in self.axes.values())


def record(
    session: zenoh.Session,
    site: str,
    folder: Path,
    rule: RollRule,
    *,
    axes: Sequence[str] = (),
    prefix: str = keys.PREFIX,
    duration: float | None = None,
    stop: threading.Event | None = None,
    ready: Callable[[], None] | None = None,
    progress: Callable[[Recorded], None] | None = None,
) -> Recorded:
    """Record until `stop`, `duration` seconds of wall time or ^C.

    Args:
        session: open session; the caller closes it.
        site: of the keys.
        folder: where the files go; made if need be.
        rule: when a file is full.
        axes: names; none means all of the site.
        prefix: of the keys.
        duration: [s]; None goes on.
        stop: set by others to end.
        ready: called once when samples are taken.
        progress: told after each batch.

    Raises:
        RecordingError: the folder cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RecordingError(f"{folder}: cannot be made: {error.strerror}") from None
    stop = stop or threading.Event()
    result, waiting = Recorded(), queue.Queue[_Message](MOST_WAITING)

    def keep(sample: zenoh.Sample, fetched: bool = False) -> None:
        try:
            message = _Message(str(sample.key_expr), sample.payload.to_bytes(), str(sample.encoding), fetched)
            waiting.put_nowait(message)
        except queue.Full:
            result.dropped += 1

    def ask(key: str, answered: threading.Event) -> None:
        def take(reply: zenoh.Reply) -> None:
            if (sample := reply.ok) is not None:
                keep(sample, fetched=True)

        session.get(
            f"{key}/@adv/**",
            zenoh.handlers.Callback(take, drop=answered.set),
            target=zenoh.QueryTarget.ALL,
            consolidation=zenoh.ConsolidationMode.NONE,
            accept_replies=zenoh.ReplyKeyExpr.ANY,
        )

    begun = time.monotonic()
    wanted = [keys.samples_key(site, name, prefix) for name in axes] or [keys.samples_pattern(site, prefix)]
    with contextlib.ExitStack() as stack:
        desk = _Desk(folder, rule, prefix, result, stack, ask)
        desk.recover()
        for key in wanted:
            subscriber = zenoh.ext.declare_advanced_subscriber(
                session,
                key,
                keep,
                history=zenoh.ext.HistoryConfig(detect_late_publishers=True),
                recovery=zenoh.ext.RecoveryConfig(periodic_queries=None, heartbeat=True),
            )
            stack.callback(subscriber.undeclare)
        if ready is not None:
            ready()
        while not stop.is_set() and (duration is None or time.monotonic() - begun < duration):
            with contextlib.suppress(queue.Empty):
                desk.take(waiting.get(timeout=LISTEN))
            desk.settle(waiting.empty())
            result.seconds = time.monotonic() - begun
            if progress is not None:
                progress(result)
        while not waiting.empty():
            desk.take(waiting.get_nowait())
        desk.release()
    result.seconds = time.monotonic() - begun
    return result


class _Message(NamedTuple):
    """A block as it came; `fetched` when it was asked for."""

    key: str
    payload: bytes
    encoding: str
    fetched: bool


@dataclass(slots=True)
class _Hold:
    """Blocks of one axis that wait, in order of arrival, while the publishers are asked for those before them."""

    since: float
    blocks: list[tuple[Block, bool]] = field(default_factory=list)
    answered: threading.Event = field(default_factory=threading.Event)


class _Desk:
    """One recorder per axis.

    Zenoh discards the first blocks of a stream that come after later ones, as happens when both ends have just joined:
    what is missing is asked for once, of the caches of its publishers, and what follows waits for the answer.
    """

    def __init__(
        self,
        folder: Path,
        rule: RollRule,
        prefix: str,
        result: Recorded,
        stack: contextlib.ExitStack,
        ask: Callable[[str, threading.Event], None],
    ) -> None:
        """`ask` asks for all that the caches hold of a key and sets the event after the last answer."""
        self._folder, self._rule, self._prefix, self._result, self._stack = folder, rule, prefix, result, stack
        self._ask = ask
        self._recorders: dict[str, AxisRecorder] = {}
        self._holds: dict[str, _Hold] = {}

    def recover(self) -> None:
        """Finish the journals that an earlier run left behind."""
        for part in sorted(self._folder.glob(f"*{PART}")):
            self._recorder(part.name.removesuffix(PART))

    def take(self, message: _Message) -> None:
        """Write one block, hold it while others are missing before it, or count why it cannot be read."""
        block = self._read(message)
        if block is None:
            return
        recorder = self._recorder(block.axis)
        if block.axis not in self._holds:
            if message.fetched or not recorder.misses(block):
                recorder.take(block, message.fetched)
                return
            self._holds[block.axis] = hold = _Hold(time.monotonic())
            self._ask(message.key, hold.answered)
        self._holds[block.axis].blocks.append((block, message.fetched))

    def settle(self, idle: bool) -> None:
        """Write what was held for long enough; `idle` when every answer that came has been taken."""
        least, most = HELD
        for axis, hold in list(self._holds.items()):
            waited = time.monotonic() - hold.since
            if (waited >= least and hold.answered.is_set() and idle) or waited >= most:
                self._write(axis)

    def release(self) -> None:
        """Write all that is held."""
        for axis in list(self._holds):
            self._write(axis)

    def _write(self, axis: str) -> None:
        for block, fetched in sorted(self._holds.pop(axis).blocks, key=lambda one: (one[0].epoch, one[0].seq)):
            self._recorders[axis].take(block, fetched)

    def _read(self, message: _Message) -> Block | None:
        try:
            block = decode_block(message.payload, message.encoding)
            if block.axis != keys.axis_of(message.key, self._prefix)[1]:
                raise PayloadError("wrong_axis", f"{message.key} carries a block of {block.axis}")
        except PayloadError as error:
            self._result.refused[error.reason] += 1
            return None
        except ParameterError:
            self._result.refused["bad_key"] += 1
            return None
        return block

    def _recorder(self, axis: str) -> AxisRecorder:
        if axis not in self._recorders:
            recorder = self._stack.enter_context(AxisRecorder(self._folder, axis, self._rule))
            self._recorders[axis] = recorder
            self._result.axes[axis] = recorder.counters
        return self._recorders[axis]
