"""All axes of one daemon: those of the configuration, taken up where the history left them, and strangers."""

from __future__ import annotations

import collections
import dataclasses
from collections.abc import Callable, Iterator, Mapping

import structlog

from monitor.axis_run import AxisRun, drift_rule, needs_stream, window_rule
from monitor.config import Config
from monitor.drift import DriftState
from monitor.samples import Window
from monitor.store import Store
from monitor.windows import Assembler
from plant import keys
from plant.axis import Axis
from plant.errors import ParameterError

log = structlog.get_logger()

MAX_UNKNOWN = 100  # axes that are not listed and yet counted one by one


class Fleet:
    """The axes by name. Belongs to the supervising thread."""

    def __init__(
        self,
        config: Config,
        axes: Mapping[str, Axis],
        store: Store,
        now: float,
        owns: Callable[[str], bool] = lambda _name: True,
    ) -> None:
        """Take up every axis of the history at monotonic time `now` [s]; those of `axes` are listed.

        `owns` tells by name which are ours, where several daemons share a site; the others' are left to them.
        """
        self._config, self._store, self._owns = config, store, owns
        self.unknown_keys = 0
        self.usual = 0.0  # windows that live axes would have completed with the usual hop, ever
        self.ready: collections.deque[AxisRun] = collections.deque()  # with windows for the workers, in turn
        self.runs = self._take_up(axes, now)
        self._strangers = sum(run.axis is None for run in self.runs.values())
        self._by_key: dict[str, AxisRun] = {}

    def __iter__(self) -> Iterator[AxisRun]:
        """Every axis, listed or not."""
        return iter(self.runs.values())

    def _take_up(self, axes: Mapping[str, Axis], now: float) -> dict[str, AxisRun]:
        runs = {}
        by_id = {}
        records = {name: one for name, one in self._store.register(axes.values()).items() if self._owns(name)}
        for name, record in records.items():
            run = by_id[record.id] = runs[name] = AxisRun(record)
            if (axis := axes.get(name)) is None:
                continue
            run.axis, run.rule = axis, drift_rule(axis, self._config)
            if not needs_stream(axis):
                self.assemble(run, axis, None)
            run.drift = DriftState.from_dict(record.drift) if record.drift else DriftState()
            run.alarms = self._store.alarms(record.id)
        for row, axis_id, window in self._store.pending():
            if (ours := by_id.get(axis_id)) is not None and ours.axis is not None:
                self.line_up(ours, row, window, now)
        for axis_id, kind, count in self._store.gap_counts():
            if axis_id in by_id:
                by_id[axis_id].gaps[kind] = count
        return runs

    def line_up(self, run: AxisRun, row: int, window: Window, now: float) -> None:
        """A window is complete at monotonic time `now` [s]: it waits for its axis' turn."""
        run.wait_for_answer(row, window, now)
        if not run.queued:
            run.queued = True
            self.ready.append(run)

    def count(self, run: AxisRun, samples: int) -> None:
        """So many samples of an axis were taken."""
        if run.assembler is not None and not run.clock.waits:
            self.usual += samples / run.assembler.rule.hop

    def thin(self, factor: int) -> dict[int, list[int]]:
        """Leave out what waits on live axes and a hop stretched by `factor` would not have made; rows by axis id."""
        live = [run for run in self if not run.clock.waits]
        return {run.record.id: rows for run in live if (rows := run.leave_out(factor))}

    def stretch(self, factor: int) -> None:
        """Begin only every `factor`-th window on live axes; a replay has time to wait."""
        for run in self:
            if run.assembler is not None:
                run.assembler.stretch = 1 if run.clock.waits else factor

    def assemble(self, run: AxisRun, axis: Axis, step_ns: int | None) -> Assembler:
        """Give `run` its assembler; `step_ns` [ns] is the sample time where only the stream shows it."""
        gaps = self._store.gaps_of(run.record.id, run.record.stream.epoch)
        run.assembler = Assembler(window_rule(axis, self._config, step_ns), run.record.stream, gaps)
        return run.assembler

    def of_key(self, key: str) -> AxisRun | None:
        """The axis a key names; unknown ones are noted, up to a limit."""
        if (run := self._by_key.get(key)) is not None:
            return run
        try:
            _, name = keys.axis_of(key, self._config.zenoh.prefix)
        except ParameterError:
            self.unknown_keys += 1
            return None
        run = self.runs.get(name) or self._note_stranger(name)
        if run is not None:
            self._by_key[key] = run
        return run

    def _note_stranger(self, name: str) -> AxisRun | None:
        if not self._owns(name):
            return None
        if self._strangers >= MAX_UNKNOWN:
            self.unknown_keys += 1
            return None
        self._strangers += 1
        run = self.runs[name] = AxisRun(self._store.add_unknown(name))
        log.warning("an axis streams that the configuration does not list", axis=name)
        return run

    def rename(self, old: str, new: str) -> None:
        """An axis goes by another name from now on."""
        run = self.runs.pop(old)
        self.runs[new] = run
        self._by_key.clear()
        if run.axis is not None:
            run.axis = dataclasses.replace(run.axis, name=new)

    def forget(self, name: str) -> None:
        """An axis that is not listed was deleted."""
        self.runs.pop(name)
        self._by_key.clear()
        self._strangers -= 1

    def of_row(self, name: str, row: int) -> AxisRun | None:
        """The axis `name` whose window has this row; after a rename the one that has it, None where it was deleted."""
        run = self.runs.get(name)
        if run is not None and row in run.order:
            return run
        return next((one for one in self if row in one.order), None)

    @property
    def backlog(self) -> int:
        """Windows without a stored answer."""
        return sum(len(run.order) for run in self)
