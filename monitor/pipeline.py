"""The corridor: message -> journal -> window -> identification -> history -> drift -> alarm -> publication.

One supervising thread calls `step` again and again. It is the only one that writes the database; whatever is published
was stored before. The order of one axis' answers is the order of its windows, so results do not depend on the workers.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any

import structlog

from monitor.alarm_desk import AlarmDesk, Publish
from monitor.alarms import Event
from monitor.axis_run import AxisRun, drift_rule, needs_stream, samples_of, step_of, travelling, window_rule
from monitor.config import Config
from monitor.drift import DriftState, Finding, indicators, judge
from monitor.errors import DatabaseError, QueryError
from monitor.estimate import Estimate
from monitor.identify_window import Job
from monitor.inbox import Inbox, Message
from monitor.payloads import estimate_payload, model_payload, status_payload
from monitor.store import Store
from monitor.windows import Assembler
from monitor.workers import Workers, window_seed
from plant import keys
from plant.axis import Axis
from plant.errors import ParameterError, PayloadError
from plant.wire import decode_block

log = structlog.get_logger()

MESSAGES_PER_STEP = 500
STATUS_SECONDS = 1.0
PRUNE_SECONDS = 5.0
MAX_UNKNOWN = 100  # axes that are not listed and yet counted one by one
LOGGED = {10**k for k in range(18)}  # of many equal refusals
AHEAD = 4  # windows of one axis that may be in the workers, per worker


class Pipeline:
    """All axes of one daemon. Time comes from `clock` (monotonic, s) and `wall` (Unix, ns)."""

    def __init__(
        self,
        config: Config,
        axes: Mapping[str, Axis],
        store: Store,
        workers: Workers,
        inbox: Inbox,
        publish: Publish,
        *,
        clock: Callable[[], float] = time.monotonic,
        wall: Callable[[], int] = time.time_ns,
    ) -> None:
        """Take up every listed axis where the history left it."""
        self._config, self._store, self._workers, self._inbox = config, store, workers, inbox
        self._publish, self._clock, self._wall = publish, clock, wall
        self.alarms = AlarmDesk(config, store, publish, wall)
        self._last_commit = self._last_status = self._last_prune = clock()
        self._started = clock()
        self._turn = 0
        self._open = False
        self.unknown_keys = 0
        self.runs = self._take_up(axes)

    def _take_up(self, axes: Mapping[str, Axis]) -> dict[str, AxisRun]:
        runs = {}
        by_id = {}
        for name, record in self._store.register(axes.values()).items():
            run = by_id[record.id] = runs[name] = AxisRun(record)
            if (axis := axes.get(name)) is None:
                continue
            run.axis, run.rule = axis, drift_rule(axis, self._config)
            if not needs_stream(axis):
                self._assemble(run, axis, None)
            run.drift = DriftState.from_dict(record.drift) if record.drift else DriftState()
            run.alarms = self._store.alarms(record.id)
        for row, axis_id, window in self._store.pending():
            run = by_id[axis_id]
            if run.axis is not None:
                run.waiting.append((row, window))
                run.order.append(row)
        return runs

    def _assemble(self, run: AxisRun, axis: Axis, step_ns: int | None) -> Assembler:
        gaps = self._store.gaps_of(run.record.id, run.record.stream.epoch)
        run.assembler = Assembler(window_rule(axis, self._config, step_ns), run.record.stream, gaps)
        return run.assembler

    # --- one turn -----------------------------------------------------------------------------------------

    def step(self, timeout: float = 0.05) -> None:
        """Receive, settle, commit, identify, judge, tell: whatever is due; wait at most `timeout` [s] for input."""
        messages, dropped = self._inbox.take(MESSAGES_PER_STEP, timeout)
        self._receive_all(messages)
        for key, count in dropped.items():
            if run := self._run_of(key):
                run.reject("queue_full", count)
        now = self._clock()
        self._settle(now)
        if now - self._last_commit >= self._config.intake.commit_seconds:
            self.commit()
        self._collect()
        self._dispatch()
        self._prune(now)
        self._tell_all(now)

    def drain(self) -> None:
        """Take what has arrived and commit it; windows without an answer are done again after a restart."""
        while len(self._inbox):
            self._receive_all(self._inbox.take(MESSAGES_PER_STEP, 0.0)[0])
        self.commit()
        self._collect()
        self._tell_all(self._clock(), at_once=True)

    # --- in -----------------------------------------------------------------------------------------------

    def _run_of(self, key: str) -> AxisRun | None:
        """The axis a key names; unknown ones are noted, up to a limit."""
        try:
            _, name = keys.axis_of(key, self._config.zenoh.prefix)
        except ParameterError:
            self.unknown_keys += 1
            return None
        run = self.runs.get(name)
        if run is None:
            if sum(one.axis is None for one in self.runs.values()) >= MAX_UNKNOWN:
                self.unknown_keys += 1
                return None
            run = self.runs[name] = AxisRun(self._store.add_unknown(name))
            log.warning("an axis streams that the configuration does not list", axis=name)
        return run

    def _receive_all(self, messages: list[Message]) -> None:
        """Take messages; one that trips an error of ours is counted and passed over, its neighbours are served."""
        for message in messages:
            run = self._run_of(message.key)
            if run is None:
                continue
            try:
                self._receive(run, message)
            except DatabaseError:
                raise
            except Exception:
                if run.reject("internal_error") in LOGGED:
                    log.exception("a message tripped an error of ours", axis=run.record.name)

    def _receive(self, run: AxisRun, message: Message) -> None:
        run.heard = message.arrived
        try:
            block = decode_block(message.payload, message.encoding)
            if block.axis != run.record.name:
                raise PayloadError("wrong_axis", f"the payload names axis {block.axis!r}")
        except PayloadError as error:
            count = run.reject(error.reason)
            if count in LOGGED:
                log.warning("payload refused", axis=run.record.name, reason=error.reason, why=str(error), count=count)
            return
        if run.axis is None:
            run.record.samples += len(block)
            run.record.last_ns = int(block.t_ns[-1])
            run.dirty = True
            return
        assembler = run.assembler or self._assemble(run, run.axis, step_of(block))
        run.add(assembler.offer(samples_of(block), message.arrived))

    def _settle(self, now: float) -> None:
        for run in self.runs.values():
            if run.assembler is not None and run.assembler.held:
                run.add(run.assembler.settle(now))

    def commit(self) -> None:
        """Write what was settled; after this, and only after this, it is acknowledged."""
        self._last_commit = self._clock()
        dirty = [run for run in self.runs.values() if run.dirty or run.outcome.accepted or run.outcome.gaps]
        if not dirty:
            return
        by_id = {run.record.id: run for run in dirty}
        for run in dirty:
            run.dirty = False
        batch = []
        for run in dirty:
            batch.append((run.record, run.close_batch() if run.assembler else run.outcome))
            for gap in batch[-1][1].gaps:
                if gap.missing:
                    log.warning(
                        "gap", axis=run.record.name, missing=gap.missing, first=gap.from_seq, why=gap.kind.value
                    )
        for record, row, window in self._store.commit(batch):
            by_id[record.id].waiting.append((row, window))
            by_id[record.id].order.append(row)
        for (_, out), run in zip(batch, dirty, strict=True):
            run.untidy |= bool(out.gaps)  # the end of a segment may leave samples that no window will take
            if out.accepted:
                self._tell_status(run)

    # --- identification -----------------------------------------------------------------------------------

    def _dispatch(self) -> None:
        """Give windows to the workers, one axis after the other."""
        names = list(self.runs)
        idle = 0
        while self._workers.free and names and idle < len(names):
            run = self.runs[names[self._turn % len(names)]]
            self._turn += 1
            ahead = len(run.order) - len(run.waiting)
            if not run.waiting or ahead >= AHEAD * self._config.workers:
                idle += 1
                continue
            idle = 0
            self._submit(run)

    def _submit(self, run: AxisRun) -> None:
        assert run.axis is not None
        row, window = run.waiting.popleft()
        samples = self._store.read(run.record.id, window.id)
        seed = window_seed(self._config.seed, run.record.name, window.id.epoch, window.id.first_seq)
        method = self._config.identification.method
        self._workers.submit(Job(row, travelling(run.axis), window, samples, seed, method))

    def _collect(self) -> None:
        touched = {}
        for job, estimate in self._workers.collect():
            run = touched[job.axis.name] = self.runs[job.axis.name]
            run.answers[job.row] = estimate
        for run in touched.values():
            while run.order and run.order[0] in run.answers:
                row = run.order.popleft()
                self._conclude(run, row, run.answers.pop(row))

    def _conclude(self, run: AxisRun, row: int, estimate: Estimate) -> None:
        """Judge one answer, store it with everything it changed, then tell."""
        findings, watched = self._judge(run, estimate)
        run.record.drift = run.drift.to_dict()
        name = run.record.name
        touched, changes = self.alarms.observe(run, findings, estimate.window.end_ns)
        ids = self._store.save(run.record, row, estimate, watched, touched, changes)
        run.untidy = True
        self._publish("parameters", name, estimate_payload(self._config.site, name, estimate, watched))
        if estimate.verdict == "identified":
            self._publish("model", name, model_payload(self._config.site, name, estimate, run.axis))
        self.alarms.tell(run, ids, changes)

    def _judge(self, run: AxisRun, estimate: Estimate) -> tuple[list[Finding], list[dict[str, Any]]]:
        """Drift; an error of ours there must not cost the answer, nor stop the other axes."""
        try:
            run.drift, findings = judge(run.drift, estimate, run.rule)
            return findings, indicators(run.drift, estimate)
        except Exception:
            run.reject("judgement_error")
            log.exception("an answer could not be judged", axis=run.record.name, window=str(estimate.window.id))
            return [], []

    # --- housekeeping -------------------------------------------------------------------------------------

    def _prune(self, now: float) -> None:
        if now - self._last_prune < PRUNE_SECONDS:
            return
        self._last_prune = now
        for run in self.runs.values():
            if run.untidy:
                run.untidy = False
                keep = self._config.history.keep_raw_windows
                self._store.prune(run.record.id, run.record.stream.needed_from(), keep)

    def _tell_all(self, now: float, *, at_once: bool = False) -> None:
        if now - self._last_status < STATUS_SECONDS and not at_once:
            return
        self._last_status = now
        for run in self.runs.values():
            self.alarms.watch_silence(run, now - (self._started if run.heard is None else run.heard))
            self._tell_status(run)

    def _tell_status(self, run: AxisRun) -> None:
        silent = None if run.heard is None else self._clock() - run.heard
        self._publish("status", run.record.name, status_payload(self._config, run, silent, self._wall()))

    def tell_untold(self) -> None:
        """After a restart: publish the transitions that were stored but perhaps not told."""
        self.alarms.tell_untold({run.record.id: name for name, run in self.runs.items()})

    def command(self, axis: str, kind: str, event: Event, author: str, until_ns: int | None = None) -> bool:
        """An operator's command to an alarm (acknowledge, shelve, ...); False where it changes nothing.

        Raises:
            QueryError: no such axis, or no such alarm of it.
        """
        if axis not in self.runs:
            raise QueryError(f"axis {axis!r} is not known")
        return self.alarms.command(self.runs[axis], kind, event, author, until_ns)

    @property
    def backlog(self) -> int:
        """Windows without a stored answer."""
        return sum(len(run.order) for run in self.runs.values())
