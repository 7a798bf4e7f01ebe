"""The figure the robotics literature quotes: force error of the inverse model, by parallel decimation.

Force and inverse model are taken at the rate the drive recorded, low-passed alike, and decimated alike to the rate of
the analysis (Gautier 1997; Janot, Gautier & Brunot 2019 for EMPS). What no model of an axis can follow, noise and
quantised steps above it, would otherwise be most of the figure: 7.5 instead of the published 6.0 % for their own model.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.signal import cheby1, sosfiltfilt

from identify.mismatch.data import Evidence, Judges, in_tenths, of_today
from identify.mismatch.extended import ExtendedProblem
from identify.mismatch.inverse import unexplained
from identify.mismatch.result import Pair
from identify.preprocess import SHORTEST_RUN, Samples, prepare
from plant.axis import Axis
from plant.recording import Recording

Floats = NDArray[np.float64]

RIPPLE = 0.05  # dB in the pass band of the decimating filter: that of scipy.signal.decimate and MATLAB's
PASSES = 0.8  # of the new half rate
DECIMATING = 8  # order
SHORTEST = 3 * (DECIMATING + 1)  # samples that pass it without phase
SAME_RATE = 0.7  # of the analysis' sample time: a recording at least this slow was not averaged


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class Native:
    """The fitted and the unseen samples, each recording at its own rate."""

    train: tuple[Samples, ...]
    held_out: tuple[Samples, ...]


def native(recordings: Sequence[Recording], axis: Axis, evidence: Evidence) -> Native:
    """Split `recordings` as `evidence` was split, as they were logged; `evidence` itself where it is as they were."""
    now = [recordings[number] for number in of_today(recordings)]
    periods = [float(np.median(np.diff(recording.t))) for recording in now]
    if not evidence.quiet and min(periods) > SAME_RATE * evidence.train.sample_time:
        return Native((evidence.train,), (evidence.held_out,))
    fast = [
        prepare(recording, dataclasses.replace(axis, analysis_sample_time=period))
        for recording, period in zip(now, periods, strict=True)
    ]
    *others, last = fast
    if others and evidence.judges is Judges.OTHERS:
        return Native((last,), tuple(others))
    if evidence.judges is Judges.TENTHS:
        return Native(*map(tuple, in_tenths(fast)))
    held, step = evidence.held_out.t, evidence.held_out.sample_time
    start, end = np.searchsorted(last.t, [held[0] - 0.5 * step, held[-1] + step])
    rest = [last.part(a, b) for a, b in ((0, int(start)), (int(end), len(last))) if a < b]
    return Native((*others, *rest), (last.part(int(start), int(end)),))


def force_errors(problem: ExtendedProblem, x: Floats, parts: Native) -> Pair:
    """100 ||F - F^|| / ||F|| of the drive force on fitted and on unseen samples; None without an inverse. [%]."""
    return Pair(_error(problem, x, parts.train), _error(problem, x, parts.held_out))


def _error(problem: ExtendedProblem, x: Floats, parts: Sequence[Samples]) -> float | None:
    """Pooled over `parts`."""
    lacking = force = 0.0
    for samples in parts:
        one = unexplained(problem, x, samples) if len(samples) > SHORTEST_RUN else None
        if one is None:
            continue
        factor = max(1, round(problem.samples.sample_time / samples.sample_time))
        for stretch in np.split(np.arange(len(one.index)), np.flatnonzero(np.diff(one.index) > 1) + 1):
            lacking += float(np.sum(_decimated(one.lacking[stretch], factor) ** 2))
            force += float(np.sum(_decimated(one.force[stretch], factor) ** 2))
    return 100.0 * float(np.sqrt(lacking / force)) if force > 0.0 else None


def _decimated(series: Floats, factor: int) -> Floats:
    """Every `factor`-th of a series (n,), low-passed without phase; nothing where it is too short for that."""
    if factor == 1:
        return series
    sections = cheby1(DECIMATING, RIPPLE, PASSES / factor, output="sos")
    return np.asarray(sosfiltfilt(sections, series)[::factor]) if len(series) > SHORTEST else series[:0]
