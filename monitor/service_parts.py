"""What the daemon is made of: opened in order, closed in reverse. Does I/O.

Import it only when the environment is prepared: numba and BLAS look at theirs once, when they are loaded.
"""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path

import structlog

from monitor.access import security_settings
from monitor.board import Board
from monitor.command_zenoh import CommandServer
from monitor.commands import CommandBox
from monitor.config import Config, open_to_all
from monitor.http_audience import Publish, audience
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
from monitor.workers import Workers, local_pool
from plant.axis import Axis
from plant.zenoh_session import open_session

log = structlog.get_logger()
WHO = "daemon"


@dataclass(frozen=True, slots=True)
class Parts:
    """What lives as long as the daemon.

    Attributes:
        config: its configuration.
        store: the history.
        inbox: messages that wait.
        commands: commands that wait.
        workers: identify windows.
        laboratory: diagnoses.
        publish: tells everybody who listens: what, axis, content.
        board: what the page shows of the daemon itself.
        postman: webhooks.
        roster: who else is alive.
        notifier: of systemd.
        pulse: beats while there is progress.
        intake: begins to take the streams; publishers send again what they keep.
        fetch: asks publishers' caches for what is missing of a key; False = too many are being asked.
    """

    config: Config
    store: Store
    inbox: Inbox
    commands: CommandBox
    workers: Workers
    laboratory: Laboratory
    publish: Publish
    board: Board
    postman: Postman
    roster: Roster
    notifier: Notifier
    pulse: Pulse
    intake: Callable[[], Intake]
    fetch: Callable[[str], bool]


def opened(config: Config, stack: contextlib.ExitStack) -> Parts:
    """Open everything; `stack` closes it.

    Raises:
        ConfigError: something cannot be opened as configured.
        ReachError: port in use, database out of reach.
    """
    site, net, settings = config.site, config.zenoh, config.identification
    store = Store(config.database_url, synchronous=config.history.synchronous, receivers=config.receivers)
    stack.callback(store.close)
    inbox = Inbox(config.intake.queue_blocks, config.intake.queue_bytes)
    commands = CommandBox(inbox.wake)
    stack.callback(commands.close)
    workers = Workers(
        config.workers,
        retries=settings.retries,
        timeout=settings.timeout_seconds,
        start_pool=pool_of(config),
        wake=inbox.wake,
    )
    stack.callback(workers.close)
    elsewhere = {"start_pool": pool_of(config)} if settings.cluster else {}
    laboratory = Laboratory(config.diagnosis.timeout_seconds, inbox.wake, **elsewhere)
    stack.callback(laboratory.close)
    # only now, for the workers' fork server must inherit neither sockets nor Zenoh's threads
    if config.security.identity and config.security.log_refused:
        stack.callback(RefusalLog().close)
    session = open_session(net.mode, net.listen, net.connect, **security_settings(config))
    stack.callback(session.close)
    publications = Publications(session, site, net.prefix)
    stack.callback(publications.close)
    onlookers = stack.enter_context(audience(config, commands))
    stack.callback(HistoryServer(session, site, net.prefix, config.database_url).close)
    stack.callback(CommandServer(session, site, net.prefix, commands).close)
    postman = Postman(config.webhook, store, wake=inbox.wake)
    stack.callback(postman.close)
    roster = Roster(config.sharing.member, inbox.wake)
    if roster.member:
        stack.callback(Attendance(session, site, net.prefix, roster).close)
    publications.alive(WHO)
    for endpoint in open_to_all(config):
        log.warning("anybody on the network may feed and read here: see docs/security.md", endpoint=endpoint)
    notifier = Notifier()
    stack.callback(notifier.tell, STOPPING=1)
    pulse = Pulse(notifier, database=store.answer, oldest_job=workers.oldest, job_limit=settings.timeout_seconds)
    return Parts(
        config, store, inbox, commands, workers, laboratory, onlookers.beside(publications.publish), onlookers.board,
        postman, roster, notifier, pulse,
        intake=lambda: Intake(session, site, net.prefix, inbox), fetch=Recovery(session, inbox).fetch,
    )  # fmt: skip


@contextlib.contextmanager
def on_duty(parts: Parts, axes: Mapping[str, Axis], stop: threading.Event) -> Iterator[Pipeline]:
    """The corridor for the axes that are ours as things stand, until somebody comes or goes."""
    config, roster = parts.config, parts.roster
    ours = roster.share()
    mine = [name for name in axes if ours(name)]
    if roster.member:
        parts.store.claim(roster.member, mine)
    pipeline = Pipeline(
        config, axes, parts.store, parts.workers, parts.inbox, parts.publish,
        commands=parts.commands, laboratory=parts.laboratory, owns=ours, fetch=parts.fetch,
    )  # fmt: skip
    pipeline.tell_untold()
    intake = parts.intake()
    shared = {"members": roster.members} if roster.member else {}
    listen, backlog = list(config.zenoh.listen), pipeline.backlog
    log.info("watching", site=config.site, axes=len(mine), listen=listen, backlog=backlog, **shared)
    parts.notifier.tell(READY=1, STATUS=f"watching {len(mine)} axes")
    try:
        yield pipeline
    finally:
        log.info("stopping" if stop.is_set() else "handing over", backlog=pipeline.backlog)
        intake.close()
    pipeline.drain()


def pool_of(config: Config) -> Callable[[int], Executor]:
    """How the workers are started: here, or on the cluster that the configuration names."""
    if not (address := config.identification.cluster):
        return local_pool
    from monitor.cluster_dask import DaskPool

    identity = Path(config.security.identity) if config.security.identity else None
    return lambda _workers: DaskPool(address, identity)
