"""Residual force over two coordinates at once: where on the rail, and how fast and which way, or when."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.mismatch.compare import Fit
from identify.mismatch.data import Evidence, join
from identify.mismatch.inverse import Unexplained, unexplained
from identify.mismatch.locate import coordinates
from identify.mismatch.maps import CUT, unit_of
from identify.preprocess import Samples

Floats = NDArray[np.float64]

ACROSS = 40  # cells along the position
ALONG = {"velocity": 20, "time": 24}  # cells along the other coordinate
FEWEST = 3  # samples in a cell that is drawn
SPAN = (0.002, 0.998)  # quantiles of a coordinate that are drawn: single stray samples make no picture


@dataclass(frozen=True, slots=True, eq=False)
class Grid:
    """Mean residual force in cells of position and another coordinate; NaN where fewer than `FEWEST` samples fall.

    Attributes:
        other: velocity (with the sign of the direction) or time.
        unit: of `other`.
        length: unit of the position.
        position: edges of the cells. [m] (a + 1,)
        edges: edges along `other`. (b + 1,)
        count: samples in each cell. (b, a)
        before: of the baseline. [N] (b, a)
        after: of the extended model. [N] (b, a) None where there is none
    """

    other: str
    unit: str
    length: str
    position: Floats
    edges: Floats
    count: NDArray[np.int64]
    before: Floats
    after: Floats | None


def grids_of(baseline: Fit, named: Fit | None, evidence: Evidence) -> tuple[Grid, ...]:
    """Position by velocity over all recordings; position by time over the fitted ones, where one clock ran."""
    drawn = [("velocity", join((evidence.train, evidence.held_out)))]
    if np.all(np.diff(evidence.train.t) > 0.0):  # else several recordings, each with a clock of its own
        drawn.append(("time", evidence.train))
    found = [_grid(baseline, named, samples, other) for other, samples in drawn]
    return tuple(one for one in found if one is not None)


def _grid(baseline: Fit, named: Fit | None, samples: Samples, other: str) -> Grid | None:
    """Residual force of both models over position and `other`; None where it cannot be had."""
    axis = baseline.problem.axis
    before = unexplained(baseline.problem, baseline.x, samples, CUT)
    after = None if named is None else unexplained(named.problem, named.x, samples, CUT)
    if before is None:
        return None
    known = coordinates(samples, axis)
    across = _edges(known["position"][before.index], ACROSS)
    along = _edges(known[other][before.index], ALONG[other])
    if len(across) < 2 or len(along) < 2:
        return None

    def sorted_into(left: Unexplained) -> tuple[Floats, Floats]:
        """Mean force in each cell, and how many samples it has."""
        at = known[other][left.index], known["position"][left.index]
        count, _, _ = np.histogram2d(*at, bins=(along, across))
        total, _, _ = np.histogram2d(*at, bins=(along, across), weights=left.lacking)
        return np.where(count >= FEWEST, total / np.maximum(count, 1.0), np.nan), count

    force, count = sorted_into(before)
    extended = None if after is None else sorted_into(after)[0]
    unit, length = unit_of(other, axis.position_unit), axis.position_unit
    return Grid(other, unit, length, across, along, count.astype(np.int64), force, extended)


def _edges(values: Floats, cells: int) -> Floats:
    """Edges of `cells` equal cells over `values` but for stray ones; empty where all are alike. (cells + 1,)"""
    low, high = np.quantile(values, SPAN)
    return np.linspace(low, high, cells + 1) if high > low else np.empty(0)
