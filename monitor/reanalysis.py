"""Identify stored windows again, into a history of their own: what was stored is only read.

The new history is a state directory like a daemon's, so every command reads it (`--state-dir`). It grows window by
window, each in one transaction; a run that was interrupted goes on where it ended.
"""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable, Iterator
from typing import Any

from monitor.axis_run import model_from
from monitor.axis_versions import axis_of
from monitor.errors import QueryError
from monitor.estimate import Estimate
from monitor.identify_window import CRASHED, Job
from monitor.query_raw import Answered, RawReader, StoredAxis
from monitor.reanalysis_compare import Tally
from monitor.store_reanalysis import Order, Target, model_of_version
from monitor.workers import Workers

Tell = Callable[[int, int, int], None]
PATIENCE = 1.0  # s between looks at workers that tell nothing: one of them may hang


def chosen(reader: RawReader, order: Order) -> list[StoredAxis]:
    """The axes that `order` means.

    Raises:
        QueryError: one that is not in the history.
    """
    known = reader.stored_axes()
    names = {axis.name for axis in known}
    for name in order.axes:
        if name not in names:
            raise QueryError(f"axis {name!r} is not in the history; there are: {', '.join(sorted(names)) or 'none'}")
    return [axis for axis in known if axis.name in order.axes or not order.axes]


def reanalyse(
    reader: RawReader,
    order: Order,
    target: Target,
    start_workers: Callable[[Callable[[], None]], Workers],
    tell: Tell = lambda _done, _total, _fresh: None,
) -> list[Tally]:
    """Do it; gives what came out, axis by axis, of this run and those before it.

    Args:
        reader: of the history.
        order: what is asked for.
        target: where the answers go.
        start_workers: makes the workers; takes what they call when an answer is there.
        tell: windows done, in all, and done in this run.
    """
    axes = chosen(reader, order)
    target.open(reader.stored_axes())
    run = _Run(reader, order, target, axes)
    jobs = run.jobs()
    if (first := next(jobs, None)) is not None:
        wake = threading.Event()
        workers = start_workers(wake.set)
        try:
            run.work(itertools.chain([first], jobs), workers, wake, tell)
        finally:
            workers.close()
    return run.compare()


class _Run:
    """One run of a re-analysis: all windows of all axes through the same workers."""

    def __init__(self, reader: RawReader, order: Order, target: Target, axes: list[StoredAxis]) -> None:
        self._reader, self._order, self._target, self._axes = reader, order, target, axes
        self._tallies = {axis.name: Tally(axis.name) for axis in axes}
        self._total = sum(reader.count_answered(axis.id, order.begin(axis), order.to_ns) for axis in axes)
        self._done, self._fresh = 0, 0
        self._versions: dict[int, int] = {}  # by job: of the model it is identified with

    def _stored(self, axis: StoredAxis) -> Iterator[Answered]:
        return self._reader.answered(axis.id, self._order.begin(axis), self._order.to_ns)

    def work(self, jobs: Iterator[Job], workers: Workers, wake: threading.Event, tell: Tell) -> None:
        """Keep the workers busy until everything is answered."""
        more = True
        while True:
            while more and workers.free:
                job = next(jobs, None)
                more = job is not None
                if job is not None:
                    workers.submit(job)
            for job, estimate in workers.collect():
                self._take(job, estimate)
            tell(self._done, self._total, self._fresh)
            if not more and not workers.busy:
                return
            wake.wait(PATIENCE)
            wake.clear()

    def jobs(self) -> Iterator[Job]:
        """A job for each window that is not answered yet and whose samples are still there."""
        number = 0
        for axis in self._axes:
            skipped = self._target.done(axis.name)
            for one in self._stored(axis):
                if one.window.id in skipped:
                    self._done += 1
                    continue
                samples = self._reader.samples(axis.id, one.window.id)
                if samples is None:
                    self._tallies[axis.name].gone += 1
                    self._done += 1
                    continue
                model = model_of_version(axis, max(axis.versions) if self._order.present else one.axis_version)
                effects, start = model_from(model.effects)
                number += 1
                self._versions[number] = model.version
                yield Job(
                    number, axis_of(axis.name, model.constants), one.window, samples, one.seed, one.method,
                    "audit" in one.result, effects, start,
                )  # fmt: skip

    def _take(self, job: Job, estimate: Estimate) -> None:
        self._done += 1
        self._fresh += 1
        version = self._versions.pop(job.row)
        if (estimate.reason or "").startswith(CRASHED):
            self._tallies[job.axis.name].failed += 1
        else:
            self._target.keep(job.axis.name, estimate, version)

    def compare(self) -> list[Tally]:
        """Both histories side by side, in the order of the windows."""
        for axis in self._axes:
            for then in self._stored(axis):
                now = self._target.answer(axis.name, then.window.id)
                if now is not None:
                    self._tallies[axis.name].add(then, now)
        return list(self._tallies.values())


def figures(tallies: list[Tally]) -> dict[str, Any]:
    """All axes together, and each."""
    axes = [one.to_dict() for one in tallies]
    counts = [name for name in (axes[0] if axes else {}) if name not in ("axis", "farthest", "differing")]
    total = {name: sum(one[name] for one in axes) for name in counts}
    return {**total, "farthest": max((one.farthest for one in tallies), default=0.0), "axes": axes}
