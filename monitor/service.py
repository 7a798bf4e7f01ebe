"""The daemon: opens what it needs in order, runs the pipeline until told to stop, closes in reverse order.

`kill -9` at any moment loses nothing that was acknowledged; the next start goes on where the history ends.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import signal
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

import structlog

from monitor.config import Config, read_axes, read_config
from monitor.errors import AlreadyRunningError, DatabaseError, FencedError
from monitor.logs import configure_logging
from plant.axis import Axis

if TYPE_CHECKING:
    from monitor.pipeline import Pipeline
    from monitor.service_parts import Parts

log = structlog.get_logger()
OUTAGE_SECONDS = 2.0  # between attempts while the database cannot be used; publishers send again what they keep
FENCED_SECONDS = 5.0  # before we try again: two daemons that cannot see each other must not wrestle
GRACE = 4.0  # s to drain and close; after it the process ends hard, which loses nothing


def run_daemon(
    config_path: Path, *, stop: threading.Event | None = None, ready: Callable[[], None] | None = None
) -> int:
    """Run until SIGTERM, SIGINT or `stop`; drain and close within 5 s.

    Args:
        config_path: the configuration file.
        stop: an own way to stop it, for programs that run it in a thread.
        ready: called once when samples are taken.

    Returns:
        Exit code: 0 stopped by `stop`, 143 by SIGTERM, 130 by SIGINT.

    Raises:
        ConfigError: the configuration or an axis file cannot be used.
        ReachError: port in use, database or state directory out of reach, another daemon running there.
    """
    config = read_config(Path(config_path))
    axes = read_axes(config)
    configure_logging(config.log.level, config.log.format)
    stop = stop or threading.Event()
    with own(config.state_dir), _signals(stop) as received:
        closed = threading.Event()
        threading.Thread(target=_end_hard, args=(stop, closed, received), name="end", daemon=True).start()
        try:
            _run(config, axes, stop, ready)
        finally:
            if not received:
                closed.set()  # else the interpreter's own end is watched too
    return 128 + received[0] if received else 0


def _run(config: Config, axes: dict[str, Axis], stop: threading.Event, ready: Callable[[], None] | None) -> None:
    """Open everything and work until `stop`; what goes wrong on the way is waited out."""
    for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ.setdefault(variable, "1")
    os.environ.setdefault("NUMBA_CACHE_DIR", str(config.state_dir / "numba"))
    from monitor.service_parts import on_duty, opened

    with contextlib.ExitStack() as stack:
        parts = opened(config, stack)
        while not stop.is_set():
            changes = parts.roster.changes
            try:
                with on_duty(parts, axes, stop) as pipeline:
                    if ready is not None:
                        ready()
                        ready = None
                    while not stop.is_set() and parts.roster.changes == changes:
                        _turn(parts, pipeline)
            except FencedError as error:  # we were frozen, or cut off from the others: nothing of ours was written
                log.warning("another daemon took over", why=str(error))
                stop.wait(FENCED_SECONDS)
            except DatabaseError as error:
                if ready is not None:  # not even begun: the person who starts us is there to read it
                    raise
                parts.pulse.endure(str(error))
                parts.store.renew()
                stop.wait(OUTAGE_SECONDS)


def _turn(parts: Parts, pipeline: Pipeline) -> None:
    """One turn of the corridor, and of those beside it."""
    pipeline.step()
    parts.postman.pump(pipeline.runs.values())
    parts.board.turn(len(parts.inbox), pipeline.backlog, parts.workers.busy)
    parts.pulse.beat(lambda: f"watching {len(pipeline.runs)} axes, {pipeline.backlog} windows waiting")


def _end_hard(stop: threading.Event, closed: threading.Event, received: list[int]) -> None:
    """End the process when it has not closed in time: Zenoh's close may hang on a bad link."""
    stop.wait()
    if not closed.wait(GRACE):
        log.warning("did not close in time, ending hard; nothing acknowledged is lost", seconds=GRACE)
        os._exit(128 + received[0] if received else 1)


@contextlib.contextmanager
def own(state_dir: Path) -> Iterator[None]:
    """Hold the state directory: one daemon each."""
    try:
        state_dir.mkdir(parents=True, exist_ok=True)
        handle = os.open(state_dir / "daemon.lock", os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
    except OSError as error:
        raise DatabaseError(
            f"{state_dir}: cannot write the state directory ({error.strerror}); make it writable or change state_dir"
        ) from None
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(handle)
        raise AlreadyRunningError(
            f"{state_dir}: another daemon is running here; stop it or use another state_dir"
        ) from None
    try:
        yield
    finally:
        os.close(handle)


@contextlib.contextmanager
def _signals(stop: threading.Event) -> Iterator[list[int]]:
    """SIGTERM and SIGINT set `stop`; gives the signals received. Outside the main thread nothing is changed."""
    received: list[int] = []

    def handle(number: int, _frame: FrameType | None) -> None:
        received.append(number)
        stop.set()

    if threading.current_thread() is not threading.main_thread():
        yield received
        return
    before = {number: signal.signal(number, handle) for number in (signal.SIGTERM, signal.SIGINT)}
    try:
        yield received
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
