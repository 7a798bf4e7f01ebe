"""Residual force along one coordinate: means in bins, split into what turns with the direction and what does not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.mismatch.compare import Fit
from identify.mismatch.data import Evidence, join
from identify.mismatch.inverse import Unexplained, unexplained
from identify.mismatch.locate import WHERE, coordinates

Floats = NDArray[np.float64]

CUT = 12.0  # Hz of the residual force; bins average what noise is left
BINS = 48  # along a coordinate
FEWEST = 8  # samples of each direction in a bin that is drawn
BOTH = 0.5  # share of bins with both directions, below which halves are taken over all samples
AS_DRAWN = {"direction": "speed", "velocity": "speed"}  # even and odd half already split by direction
ALWAYS = ("position", "speed")
EVEN_BINS = {"time", *WHERE}  # others: as many samples in each bin


@dataclass(frozen=True, slots=True, eq=False)
class Halves:
    """Residual force in the bins of a coordinate; NaN where too few samples fall into one.

    Attributes:
        even: half that is the same in both directions of travel. [N] (k,)
        odd: half that flips with the direction: friction. [N] (k,)
        rms: of the residual force. [N] (k,)
    """

    even: Floats
    odd: Floats
    rms: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Map:
    """Residual force along one coordinate, of the baseline and of the extended model (None where there is none)."""

    coordinate: str
    unit: str
    middle: Floats
    before: Halves
    after: Halves | None


def maps_of(baseline: Fit, named: Fit | None, evidence: Evidence, wanted: Sequence[str]) -> tuple[Map, ...]:
    """Residual force along the wanted coordinates, then along position and speed."""
    axis = baseline.problem.axis
    names = dict.fromkeys([*(AS_DRAWN.get(name, name) for name in wanted), *ALWAYS])
    found = []
    for parts in ((evidence.train,), (evidence.train, evidence.held_out)):
        samples = join(parts)
        before = unexplained(baseline.problem, baseline.x, samples, CUT)
        after = None if named is None else unexplained(named.problem, named.x, samples, CUT)
        if before is None:
            return ()
        along = coordinates(samples, axis)
        along["speed"] = np.abs(along["velocity"])
        for name in names:
            if name in along and (name == "time") == (len(parts) == 1):  # clocks of two recordings are not one
                edges = _edges(name, along[name][before.index])
                if len(edges) > 2:
                    unit = unit_of(name, axis.position_unit)
                    middle = 0.5 * (edges[1:] + edges[:-1])
                    halves = [
                        None if one is None else _halves(one, along[name], along["direction"], edges)
                        for one in (before, after)
                    ]
                    if halves[0] is not None:
                        found.append(Map(name, unit, middle, halves[0], halves[1]))
    order = list(names)
    return tuple(sorted(found, key=lambda one: order.index(one.coordinate)))


def _edges(name: str, x: Floats) -> Floats:
    """Edges of the bins along coordinate values x."""
    if name in EVEN_BINS:
        low, high = np.quantile(x, [0.002, 0.998])
        return np.linspace(low, high, BINS + 1) if high > low else np.empty(0)
    return np.unique(np.quantile(x, np.linspace(0.0, 1.0, BINS // 2 + 1)))


def _halves(left: Unexplained, along: Floats, direction: Floats, edges: Floats) -> Halves:
    """Means of the residual force in each bin, split by the direction of travel."""
    count = len(edges) - 1
    place = np.digitize(along[left.index], edges) - 1
    place[along[left.index] == edges[-1]] = count - 1
    inside = (place >= 0) & (place < count)
    place, force, sign = place[inside], left.lacking[inside], direction[left.index][inside]
    forward, backward = (_mean(place[sign == way], force[sign == way], count) for way in (1.0, -1.0))
    even, odd = 0.5 * (forward + backward), 0.5 * (forward - backward)
    if np.mean(np.isfinite(even)) < BOTH:
        even, odd = _mean(place, force, count), _mean(place[sign != 0], (force * sign)[sign != 0], count)
    return Halves(even, odd, np.sqrt(_mean(place, force**2, count)))


def _mean(place: NDArray[np.int64], value: Floats, count: int) -> Floats:
    """Mean of `value` in each of `count` bins; NaN where there are too few."""
    number = np.bincount(place, minlength=count)
    total = np.bincount(place, value, minlength=count)
    return np.where(number >= FEWEST, total / np.maximum(number, 1), np.nan)


def unit_of(name: str, length: str) -> str:
    """Unit of a coordinate; `length` is that of a position."""
    units = {
        "position": length,
        "distance_since_reversal": length,
        "speed": f"{length}/s",
        "velocity": f"{length}/s",
        "acceleration": f"{length}/s^2",
        "torque": "N*m",
        "torque_rate": "N*m/s",
        "motor_angle": "rad",
        "pulley_angle": "rad",
        "frequency": "Hz",
        "direction": "1",
    }
    return units.get(name, "s")
