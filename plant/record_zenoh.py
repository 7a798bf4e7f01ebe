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

import zenoh
import zenoh.ext

from plant import keys
from plant.errors import ParameterError, PayloadError, RecordingError
from plant.record_files import PART, AxisRecorder, RecordCounters, RollRule
from plant.wire import decode_block

MOST_WAITING = 20_000  # blocks that wait to be written; more are dropped, counted
LISTEN = 0.1  # s; the longest time to notice a stop


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
    result, waiting = Recorded(), queue.Queue[tuple[str, bytes, str]](MOST_WAITING)

    def keep(sample: zenoh.Sample) -> None:
        try:
            waiting.put_nowait((str(sample.key_expr), sample.payload.to_bytes(), str(sample.encoding)))
        except queue.Full:
            result.dropped += 1

    begun = time.monotonic()
    wanted = [keys.samples_key(site, name, prefix) for name in axes] or [keys.samples_pattern(site, prefix)]
    with contextlib.ExitStack() as stack:
        desk = _Desk(folder, rule, prefix, result, stack)
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
                desk.write(*waiting.get(timeout=LISTEN))
            result.seconds = time.monotonic() - begun
            if progress is not None:
                progress(result)
        while not waiting.empty():
            desk.write(*waiting.get_nowait())
    result.seconds = time.monotonic() - begun
    return result


class _Desk:
    """One recorder per axis."""

    def __init__(
        self, folder: Path, rule: RollRule, prefix: str, result: Recorded, stack: contextlib.ExitStack
    ) -> None:
        self._folder, self._rule, self._prefix, self._result, self._stack = folder, rule, prefix, result, stack
        self._recorders: dict[str, AxisRecorder] = {}

    def recover(self) -> None:
        """Finish the journals that an earlier run left behind."""
        for part in sorted(self._folder.glob(f"*{PART}")):
            self._recorder(part.name.removesuffix(PART))

    def write(self, key: str, payload: bytes, encoding: str) -> None:
        """Write one block, or count why not."""
        try:
            block = decode_block(payload, encoding)
            if block.axis != keys.axis_of(key, self._prefix)[1]:
                raise PayloadError("wrong_axis", f"{key} carries a block of {block.axis}")
        except PayloadError as error:
            self._result.refused[error.reason] += 1
            return
        except ParameterError:
            self._result.refused["bad_key"] += 1
            return
        self._recorder(block.axis).take(block)

    def _recorder(self, axis: str) -> AxisRecorder:
        if axis not in self._recorders:
            recorder = self._stack.enter_context(AxisRecorder(self._folder, axis, self._rule))
            self._recorders[axis] = recorder
            self._result.axes[axis] = recorder.counters
        return self._recorders[axis]
