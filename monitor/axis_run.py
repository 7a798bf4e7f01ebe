"""One axis in the daemon: its assembler, its windows on the way, its drift and its alarms. No I/O."""

from __future__ import annotations

import collections
import dataclasses
import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from monitor.audit_watch import AuditWatch
from monitor.config import Config
from monitor.drift import DriftRule, DriftState
from monitor.estimate import Estimate
from monitor.mismatch_watch import MismatchWatch
from monitor.samples import GapKind, Outcome, Samples, Window, WindowRule
from monitor.starvation import Starvation
from monitor.store_records import AlarmRecord, AxisRecord
from monitor.stream_clock import StreamClock
from monitor.windows import Assembler
from plant.axis import Axis
from plant.wire import Block

MOST = 2**63 - 1  # what a column of the database holds; a forged number of a sample may tell of as many missing


@dataclass(slots=True)
class AxisRun:
    """What the pipeline holds per axis.

    Attributes:
        record: what the database knows.
        axis: its constants; None for an axis that is not listed.
        assembler: settles its samples; None for an axis that is not listed, or whose sample time is not known yet.
        rule: of its drift.
        drift: state of its watch.
        alarms: by kind.
        waiting: (row, window) not yet given to a worker, in order.
        order: rows of all windows without a stored answer, in order: answers are judged in this order.
        answers: by row, those that came before their predecessors'.
        audit: whether sign, unit and scale of what it sends have been checked, and what came out.
        clock: its stamps against their arrival.
        starvation: what came since its last complete window.
        mismatch: what the model cannot explain, and what the latest diagnosis said.
        remodel: its model changed, and its stored windows have not been identified again yet.
        gaps: breaks of the stream by kind, ever.
        delay: from the arrival of the latest message to its turn. [s]
        completed: when each window of `order` was complete, on the monotonic clock, in the same order. [s]
        left_out: windows that were complete and yet left out when the hop was stretched, since the start.
        told: when its status was published. [s]
        visited: when its turn was in the rounds. [s]
        pruned: when its journal was tidied up. [s]
        queued: it waits for its turn at the workers.
        key: under which its samples came.
        asked: when its publishers' caches were asked for what is missing, while that is under way. [s]
        fetched: when that ended last. [s]
        outcome: what was settled since the last commit.
        heard: monotonic time of the latest message. [s] None = not since the start
        dirty: a counter changed since the last commit.
        untidy: the journal may hold samples that nobody needs any more.
    """

    record: AxisRecord
    axis: Axis | None = None
    assembler: Assembler | None = None
    rule: DriftRule = field(default_factory=DriftRule)
    drift: DriftState = field(default_factory=DriftState)
    alarms: dict[str, AlarmRecord] = field(default_factory=dict)
    waiting: collections.deque[tuple[int, Window]] = field(default_factory=collections.deque)
    order: collections.deque[int] = field(default_factory=collections.deque)
    answers: dict[int, Estimate] = field(default_factory=dict)
    audit: AuditWatch = field(default_factory=AuditWatch)
    clock: StreamClock = field(default_factory=StreamClock)
    starvation: Starvation = field(default_factory=Starvation)
    mismatch: MismatchWatch = field(default_factory=MismatchWatch)
    remodel: bool = False
    gaps: collections.Counter[str] = field(default_factory=collections.Counter)
    delay: float = 0.0
    completed: collections.deque[float] = field(default_factory=collections.deque)
    left_out: int = 0
    told: float = -math.inf
    visited: float = -math.inf
    pruned: float = -math.inf
    queued: bool = False
    key: str = ""
    asked: float | None = None
    fetched: float = -math.inf
    outcome: Outcome = field(default_factory=Outcome)
    heard: float | None = None
    dirty: bool = False
    untidy: bool = True

    @property
    def committed(self) -> dict[str, int] | None:
        """The acknowledgement: every sample of this epoch up to this number is stored, or reported as a gap."""
        stream = self.record.stream
        return {"epoch": stream.epoch, "seq": stream.next_seq - 1} if stream.next_seq > 0 else None

    def wait_for_answer(self, row: int, window: Window, now: float) -> None:
        """Line up a complete window; `now` [s] is monotonic."""
        self.waiting.append((row, window))
        self.order.append(row)
        self.completed.append(now)

    def leave_out(self, every: int) -> list[int]:
        """Keep the newest window that waits for a worker, and each `every`-th before it; rows of the others."""
        waiting = list(self.waiting)
        kept = waiting[::-1][::every][::-1]
        out = {row for row, _ in waiting} - {row for row, _ in kept}
        if not out:
            return []
        lined_up = [pair for pair in zip(self.order, self.completed, strict=True) if pair[0] not in out]
        self.waiting = collections.deque(kept)
        self.order = collections.deque(row for row, _ in lined_up)
        self.completed = collections.deque(at for _, at in lined_up)
        self.left_out += len(out)
        return sorted(out)

    def next_answer(self) -> tuple[int, Estimate] | None:
        """The answer to the oldest window, if it is there."""
        if not self.order or self.order[0] not in self.answers:
            return None
        self.completed.popleft()
        row = self.order.popleft()
        return row, self.answers.pop(row)

    def behind(self, now: float) -> float:
        """How long the oldest window without an answer has been complete. [s]"""
        return now - self.completed[0] if self.completed else 0.0

    @property
    def complaint(self) -> str | None:
        """Why it is not watched though it sends."""
        if self.assembler is None:
            return None
        rule = self.assembler.rule
        return self.starvation.complaint(rule.samples, self.clock, rule.hop * self.assembler.stretch)

    def reject(self, reason: str, count: int = 1) -> int:
        """Count what was refused; return how much of it there was so far."""
        if count:
            self.record.rejected[reason] = self.record.rejected.get(reason, 0) + count
            self.dirty = True
        return self.record.rejected.get(reason, 0)

    def add(self, out: Outcome) -> None:
        """Collect what the assembler settled, for the next commit."""
        self.outcome.accepted += out.accepted
        self.outcome.gaps += out.gaps
        self.outcome.windows += out.windows
        self.gaps.update(gap.kind.value for gap in out.gaps)
        if out.splinters:
            self.gaps[GapKind.PAUSE.value] += out.splinters
        self.starvation.note(out)
        for reason in ("duplicates", "late", "old_epoch", "stray_epoch", "stray_seq"):
            self.reject(reason, getattr(out, reason))

    def close_batch(self) -> Outcome:
        """Bring the record up to date with the batch; return the batch, for the store."""
        assert self.assembler is not None
        batch, self.outcome = self.outcome, Outcome()
        record = self.record
        record.samples += sum(len(part) for part in batch.accepted)
        record.missing = min(record.missing + sum(gap.missing for gap in batch.gaps), MOST)
        record.stream = self.assembler.state
        if record.stream.last_ns is not None:
            record.last_ns = record.stream.last_ns
        return batch


def needs_stream(axis: Axis) -> bool:
    """Whether the length of a window is known only when the stream shows its sample time."""
    return axis.analysis_sample_time is not None and axis.stream.sample_time is None


def step_of(block: Block) -> int:
    """Sample time of a block. [ns]; 0 = it holds one sample, which does not tell."""
    return block.dt_ns or (int(np.median(np.diff(block.t_ns))) if len(block) > 1 else 0)


def window_rule(axis: Axis, config: Config, step_ns: int | None = None) -> WindowRule:
    """Windows in raw samples: with `[analysis] sample_time`, a window covers that many times more of them.

    `step_ns` [ns] is what the stream shows, for an axis file that does not say it; where it shows nothing (single
    samples), the stream is taken to be sampled as the first recording.
    """
    nominal, analysis = axis.stream.sample_time, axis.analysis_sample_time
    if nominal is None:
        recorded = next((entry.sample_time for entry in axis.recordings if entry.sample_time), None)
        nominal = step_ns / 1e9 if step_ns else recorded
    ratio = max(1, round(analysis / nominal)) if nominal and analysis else 1
    return WindowRule(
        samples=config.window.samples * ratio,
        hop=config.window.hop * ratio,
        sample_time_ns=round(nominal * 1e9) if nominal else 0,
        patience=config.intake.reorder_seconds,
    )


def drift_rule(axis: Axis, config: Config) -> DriftRule:
    """The settings of the watch, for this axis."""
    return DriftRule(
        baseline_windows=config.drift.baseline_windows,
        baseline_span=config.drift.baseline_span,
        min_change=config.drift.min_change,
        jam_rise=config.drift.jam_rise,
        false_alarms_per_year=config.alarms.false_alarms_per_axis_year,
        bad_windows=config.alarms.bad_windows,
        force_unit=axis.force_unit,
        weight=axis.mechanics.weight if axis.mechanics.inertia_known else 0.0,
        limit_rise=config.drift.limit_rise,
    )


def samples_of(block: Block) -> Samples:
    """A block of the stream as the assembler takes it."""
    drive = block.torque if block.torque is not None else block.force
    assert drive is not None  # the payload was checked
    extra = {
        name: np.asarray(values, dtype=np.float64)
        for name in ("velocity", "temperature", "load")
        if (values := getattr(block, name)) is not None
    }
    return Samples(
        block.epoch,
        block.seq,
        block.t_ns,
        np.asarray(drive, dtype=np.float64),
        np.asarray(block.position, dtype=np.float64),
        is_force=block.torque is None,
        **extra,
    )


def travelling(axis: Axis) -> Axis:
    """The axis as it goes to a worker: without its recordings, which cannot be pickled and are not needed."""
    return dataclasses.replace(axis, recordings=())


def model_of(run: AxisRun) -> tuple[tuple[str, ...], dict[str, float]]:
    """Names of the promoted effects of an axis, and the values their search starts from."""
    return model_from(run.record.effects)


def model_from(effects: dict[str, Any]) -> tuple[tuple[str, ...], dict[str, float]]:
    """The same from the effects of a version of an axis."""
    start = {
        f"{effect}.{name}": float(value)
        for effect, values in effects.items()
        for name, value in (values or {}).items()
        if isinstance(value, int | float)
    }
    return tuple(sorted(effects)), start
