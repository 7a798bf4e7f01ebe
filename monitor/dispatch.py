"""Who is identified next: windows go to the workers, one axis after the other; answers come back in order."""

from __future__ import annotations

from collections.abc import Callable

from monitor.axis_run import AxisRun, model_of, travelling
from monitor.config import Config
from monitor.estimate import Estimate
from monitor.fleet import Fleet
from monitor.identify_window import Job
from monitor.store import Store
from monitor.workers import Workers, window_seed

AHEAD = 4  # windows of one axis that may be in the workers, per worker


class Dispatch:
    """Between the waiting windows and the workers. Belongs to the supervising thread."""

    def __init__(
        self,
        config: Config,
        fleet: Fleet,
        store: Store,
        workers: Workers,
        conclude: Callable[[AxisRun, int, Estimate], None],
    ) -> None:
        """`conclude` is called with every answer of an axis, in the order of its windows."""
        self._config, self._fleet, self._store, self._workers = config, fleet, store, workers
        self._conclude = conclude
        self.answered = 0  # windows, ever

    def submit(self) -> None:
        """Give windows to the workers, one axis after the other, as long as they have room."""
        ready, passed_over = self._fleet.ready, 0
        while self._workers.free and passed_over < len(ready):
            run = ready.popleft()
            if len(run.order) - len(run.waiting) < AHEAD * self._config.workers:
                self._submit(run)
                passed_over = 0
            else:
                passed_over += 1
            run.queued = bool(run.waiting)
            if run.queued:
                ready.append(run)

    def _submit(self, run: AxisRun) -> None:
        assert run.axis is not None
        row, window = run.waiting.popleft()
        samples = self._store.read(run.record.id, window.id)
        seed = window_seed(self._config.seed, run.record.name, window.id.epoch, window.id.first_seq)
        method, due = self._config.identification.method, run.audit.due(samples)
        effects, start = model_of(run)
        self._workers.submit(Job(row, travelling(run.axis), window, samples, seed, method, due, effects, start))

    def collect(self) -> None:
        """Conclude the answers that have come; one that came before its predecessor waits for it."""
        touched = {}
        for job, estimate in self._workers.collect():
            run = self._fleet.of_row(job.axis.name, job.row)
            if run is not None:
                touched[run.record.name] = run
                run.answers[job.row] = estimate
            self.answered += 1
        for run in touched.values():
            while (answer := run.next_answer()) is not None:
                self._conclude(run, *answer)
