"""Compile every kernel once, or load it from the cache, and say so: `python -m plant.warm`."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator

import numpy as np

from plant.axis import TorqueHold
from plant.effects import find, names
from plant.effects.effect import Surroundings
from plant.kernels import CACHE_FOLDER
from plant.kernels.laws import LANES
from plant.machine import drive_forces, march, plan
from plant.presets import paper_axis, paper_friction
from plant.simulation import simulate_population

Job = tuple[str, Callable[[], object]]


def jobs() -> Iterator[Job]:
    """(what, compile it) for each kernel of the plant."""
    axis, friction = paper_axis(), paper_friction()
    t, force = np.array([0.0, 0.01, 0.02]), np.zeros(3)

    def machine() -> None:
        blocks = plan(Surroundings.of(axis), ()).blocks(friction.as_array[:, np.newaxis], np.empty((0, 1)))
        march(blocks, t, force[:-1], force[1:], 1)

    def population() -> None:
        simulate_population(axis, force, friction.as_array[np.newaxis], t=t, hold=TorqueHold.LINEAR)

    yield "machine", machine
    yield "population", population
    yield "dead time", lambda: drive_forces(t, force[:-1], force[1:], np.full(LANES, 0.001))
    for name in names():
        yield name, lambda name=name: [law.address for law in find(name).laws]  # type: ignore[misc]


def warm_up(more: Iterator[Job] | tuple[Job, ...] = ()) -> float:
    """Run all jobs, those of the plant and `more`, with one progress line on stderr.

    Returns:
        Seconds it took: under two when everything was in the cache, about half a minute when nothing was.
    """
    begin = time.perf_counter()
    todo = [*jobs(), *more]
    for i, (what, job) in enumerate(todo, 1):
        _show(f"kernels {i}/{len(todo)}: {what}", last=False)
        job()
    took = time.perf_counter() - begin
    _show(f"{len(todo)} kernels ready in {took:.1f} s, kept in {CACHE_FOLDER}", last=True)
    return took


def _show(line: str, *, last: bool) -> None:
    """One line that rewrites itself on a terminal; in a log only the last."""
    if sys.stderr.isatty():
        print(f"\r\x1b[K{line}", end="\n" if last else "", file=sys.stderr, flush=True)
    elif last:
        print(line, file=sys.stderr)


if __name__ == "__main__":
    warm_up()
