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
from concurrent.futures import Executor
from pathlib import Path
from types import FrameType

import structlog

from monitor.config import Config, open_to_all, read_axes, read_config
from monitor.errors import AlreadyRunningError, DatabaseError, FencedError
from monitor.logs import configure_logging
from plant.axis import Axis

log = structlog.get_logger()
WHO = "daemon"
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
    # pool before the session: its fork server must not inherit sockets or Zenoh's threads
    for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ.setdefault(variable, "1")
    os.environ.setdefault("NUMBA_CACHE_DIR", str(config.state_dir / "numba"))
    from monitor.access import security_settings
    from monitor.command_zenoh import CommandServer
    from monitor.commands import CommandBox
    from monitor.http_audience import audience
    from monitor.http_webhook import Postman
    from monitor.inbox import Inbox
    from monitor.intake_zenoh import Intake
    from monitor.laboratory import Laboratory
    from monitor.notify_systemd import Notifier
    from monitor.pipeline import Pipeline
    from monitor.publish_zenoh import Publications
    from monitor.pulse import Pulse
    from monitor.query_zenoh import HistoryServer
    from monitor.recovery_zenoh import Recovery
    from monitor.refusals_zenoh import RefusalLog
    from monitor.sharing import Roster
    from monitor.sharing_zenoh import Attendance
    from monitor.store import Store
    from monitor.workers import Workers
    from plant.zenoh_session import open_session

    with contextlib.ExitStack() as stack:
        store = Store(config.database_url, synchronous=config.history.synchronous, receivers=config.receivers)
        stack.callback(store.close)
        inbox = Inbox(config.intake.queue_blocks, config.intake.queue_bytes)
        commands = CommandBox(inbox.wake)
        stack.callback(commands.close)
        settings = config.identification
        workers = Workers(
            config.workers,
            retries=settings.retries,
            timeout=settings.timeout_seconds,
            start_pool=_pool_of(config),
            wake=inbox.wake,
        )
        stack.callback(workers.close)
        elsewhere = {"start_pool": _pool_of(config)} if settings.cluster else {}
        laboratory = Laboratory(config.diagnosis.timeout_seconds, inbox.wake, **elsewhere)
        stack.callback(laboratory.close)
        net = config.zenoh
        if config.security.identity and config.security.log_refused:
            stack.callback(RefusalLog().close)
        session = open_session(net.mode, net.listen, net.connect, **security_settings(config))
        stack.callback(session.close)
        publications = Publications(session, config.site, net.prefix)
        stack.callback(publications.close)
        onlookers = stack.enter_context(audience(config, commands))
        publish = onlookers.beside(publications.publish)
        server = HistoryServer(session, config.site, net.prefix, config.database_url)
        stack.callback(server.close)
        operators = CommandServer(session, config.site, net.prefix, commands)
        stack.callback(operators.close)
        postman = Postman(config.webhook, store, wake=inbox.wake)
        stack.callback(postman.close)
        roster = Roster(config.sharing.member, inbox.wake)
        if roster.member:
            attendance = Attendance(session, config.site, net.prefix, roster)
            stack.callback(attendance.close)
        publications.alive(WHO)
        for endpoint in open_to_all(config):
            log.warning("anybody on the network may feed and read here: see docs/security.md", endpoint=endpoint)

        @contextlib.contextmanager
        def on_duty() -> Iterator[Pipeline]:
            """The corridor for the axes that are ours as things stand, until somebody comes or goes."""
            ours = roster.share()
            if roster.member:
                store.claim(roster.member, [name for name in axes if ours(name)])
            pipeline = Pipeline(
                config, axes, store, workers, inbox, publish,
                commands=commands, laboratory=laboratory, owns=ours, fetch=Recovery(session, inbox).fetch,
            )  # fmt: skip
            pipeline.tell_untold()
            intake = Intake(session, config.site, net.prefix, inbox)  # anew: publishers send again what they keep
            watched = sum(ours(name) for name in axes)
            shared = {"members": roster.members} if roster.member else {}
            log.info(
                "watching", site=config.site, axes=watched, listen=list(net.listen), backlog=pipeline.backlog, **shared
            )
            notifier.tell(READY=1, STATUS=f"watching {watched} axes")
            try:
                yield pipeline
            finally:
                log.info("stopping" if stop.is_set() else "handing over", backlog=pipeline.backlog)
                intake.close()
            pipeline.drain()

        notifier = Notifier()
        stack.callback(notifier.tell, STOPPING=1)
        pulse = Pulse(notifier, database=store.answer, oldest_job=workers.oldest, job_limit=settings.timeout_seconds)
        while not stop.is_set():
            changes = roster.changes
            try:
                with on_duty() as pipeline:
                    if ready is not None:
                        ready()
                        ready = None
                    while not stop.is_set() and roster.changes == changes:
                        pipeline.step()
                        postman.pump(pipeline.runs.values())
                        onlookers.board.turn(len(inbox), pipeline.backlog, workers.busy)
                        pulse.beat(lambda: f"watching {len(pipeline.runs)} axes, {pipeline.backlog} windows waiting")
            except FencedError as error:  # we were frozen, or cut off from the others: nothing of ours was written
                log.warning("another daemon took over", why=str(error))
                stop.wait(FENCED_SECONDS)
            except DatabaseError as error:
                if ready is not None:  # not even begun: the person who starts us is there to read it
                    raise
                pulse.endure(str(error))
                store.renew()
                stop.wait(OUTAGE_SECONDS)


def _pool_of(config: Config) -> Callable[[int], Executor]:
    """How the workers are started: here, or on the cluster that the configuration names."""
    from monitor.workers import local_pool

    if not (address := config.identification.cluster):
        return local_pool
    from monitor.cluster_dask import DaskPool

    identity = Path(config.security.identity) if config.security.identity else None
    return lambda _workers: DaskPool(address, identity)


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
