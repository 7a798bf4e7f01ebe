"""Many windows over any executor: threads, processes, or a cluster behind the same `concurrent.futures` interface."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import Executor, Future
from itertools import pairwise
from typing import Any

import numpy as np

from identify.errors import InputError
from identify.identification import identify_friction
from identify.result import IdentificationResult
from plant.axis import Axis
from plant.recording import Recording

Start = Mapping[str, float]


def identify_many(
    recordings: Sequence[Recording],
    axes: Axis | Sequence[Axis],
    *,
    executor: Executor | None = None,
    seeds: int | Sequence[int] = 0,
    starts: Sequence[Start | None] | None = None,
    chunk: int = 1,
    **options: Any,
) -> list[IdentificationResult]:
    """Identify many windows; the answers do not depend on how many workers there are, or on which gets what.

    Args:
        recordings: one window each.
        axes: one for all, or one each.
        executor: where the work is done; None does it here. It must hand back results in `Future`s.
        seeds: one per window; a single number is spread over the windows, so that no two search alike.
        starts: values to try first, one mapping or None per window. Windows of one axis that follow each other are
            best warm-started by the caller, for the answer of one is the start of the next.
        chunk: windows per task: more where a task travels far (cluster), fewer where windows differ in length.
        options: handed to `identify_friction`, for instance `method` or `criterion`.

    Returns:
        One result per window, in their order.

    Raises:
        InputError: lists of different lengths, or a chunk below 1.
    """
    count = len(recordings)
    each_axis = [axes] * count if isinstance(axes, Axis) else list(axes)
    each_seed = spread_seeds(seeds, count) if isinstance(seeds, int) else list(seeds)
    each_start = [None] * count if starts is None else list(starts)
    for name, values in (("axes", each_axis), ("seeds", each_seed), ("starts", each_start)):
        if len(values) != count:
            raise InputError(f"{len(values)} {name} for {count} recordings: give one for each")
    if chunk < 1:
        raise InputError(f"chunk is {chunk}, but must be at least 1 window")
    jobs = list(zip(recordings, each_axis, each_seed, each_start, strict=True))
    if executor is None:
        return _identify(jobs, options)
    edges = [*range(0, count, chunk), count]
    futures: list[Future[list[IdentificationResult]]] = [
        executor.submit(_identify, jobs[first:last], options) for first, last in pairwise(edges)
    ]
    return [result for future in futures for result in future.result()]


def spread_seeds(seed: int, count: int) -> list[int]:
    """Seeds for `count` windows from one; window k gets the same however many follow."""
    return [int(np.random.SeedSequence([seed, k]).generate_state(1)[0]) for k in range(count)]


def _identify(
    jobs: Iterable[tuple[Recording, Axis, int, Start | None]], options: Mapping[str, Any]
) -> list[IdentificationResult]:
    """Work through some windows in this thread or process."""
    return [
        identify_friction(recording, axis, seed=seed, start=start, **options) for recording, axis, seed, start in jobs
    ]
