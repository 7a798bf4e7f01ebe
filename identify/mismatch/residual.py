"""The force the model does not explain, sample by sample: for pictures, and for places to look at."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.mismatch.guise import Setting
from identify.preprocess import Samples, smooth_velocity
from identify.problem import FrictionProblem

Floats = NDArray[np.float64]

SPAN = 0.04  # s to each side of a local parabola
RESTING = 0.02  # of the fastest speed: slower counts as rest
PLACES = 6  # starting points taken from the residual


@dataclass(frozen=True, slots=True, eq=False)
class Residual:
    """Residual force over the recordings.

    Attributes:
        force: drive force minus inertia, weight and modelled friction. [N] (n,)
        position, velocity, acceleration: smoothed. [m], [m/s], [m/s²] (n,)
        sliding: True where friction has one value. (n,)
    """

    force: Floats
    position: Floats
    velocity: Floats
    acceleration: Floats
    sliding: NDArray[np.bool_]

    @property
    def odd(self) -> Floats:
        """The half that flips with the direction: friction. [N] (n,)."""
        return np.asarray(self.force * np.sign(self.velocity), dtype=np.float64)


def acceleration_of(samples: Samples, velocity: Floats, span: float = SPAN) -> Floats:
    """Acceleration as the slope of the smoothed velocity over ± `span` seconds. [m/s²] (n,)."""
    reach = max(1, round(span / samples.sample_time))
    n = len(samples)
    low = np.clip(np.arange(n) - reach, 0, n - 1)
    high = np.clip(np.arange(n) + reach, 0, n - 1)
    same = (samples.run[low] == samples.run) & (samples.run[high] == samples.run)
    with np.errstate(invalid="ignore", divide="ignore"):
        slope = (velocity[high] - velocity[low]) / (samples.t[high] - samples.t[low])
    return np.where(same & np.isfinite(slope), slope, 0.0)


def residual_force(problem: FrictionProblem, x: Floats) -> Residual:
    """What the baseline part of x leaves over, from smoothed motion."""
    samples = problem.samples
    velocity = smooth_velocity(samples, SPAN)
    acceleration = acceleration_of(samples, velocity)
    law = problem.law(x[None])[:, 0]
    speed = np.abs(velocity)
    level = law[0] + law[1] * np.exp(-speed * law[2])
    friction = level * np.sign(velocity) + law[3] * velocity
    force = samples.force - law[4] * acceleration - law[5] - friction
    sliding = speed > max(RESTING * problem.scales.speed, 1e-12)
    reach = max(1, round(SPAN / samples.sample_time))
    near_rest = np.convolve((~sliding).astype(float), np.ones(2 * reach + 1), mode="same") > 0
    return Residual(force, samples.position, velocity, acceleration, sliding & ~near_rest)


def setting_of(problem: FrictionProblem, x: Floats) -> Setting:
    """Where to look for effects in these samples, given a baseline fit x."""
    samples, scales = problem.samples, problem.scales
    left = residual_force(problem, x)
    velocity = np.abs(left.velocity)
    rest = velocity < RESTING * scales.speed
    return Setting(
        axis=problem.axis,
        force=scales.force,
        speed=scales.speed,
        travel=scales.travel,
        mass=scales.mass,
        lowest=float(samples.position.min()),
        highest=float(samples.position.max()),
        peak=float(np.abs(samples.force).max()),
        duration=float(samples.t.max()),
        sample_time=samples.sample_time,
        rests=_longest(rest) * samples.sample_time,
        spots=spots(left, scales.travel),
        periods=periods(left, scales.travel),
        free_offset=not problem.gravity_known,
    )


def spots(left: Residual, travel: float) -> tuple[float, ...]:
    """Positions at which the odd residual force stands out, most telling first. [m]."""
    y, force = left.position[left.sliding], left.odd[left.sliding]
    if len(y) < 50:
        return ()
    found: list[tuple[float, float]] = []
    for width in (0.01 * travel, 0.03 * travel):
        bins = np.floor((y - y.min()) / width).astype(int)
        count = np.bincount(bins)
        total = np.bincount(bins, force - np.median(force))
        weight = np.abs(total) / np.sqrt(np.maximum(count, 1))
        found += [(float(weight[b]), float(y.min() + (b + 0.5) * width)) for b in np.argsort(-weight)[:PLACES]]
    chosen: list[float] = []
    for _, place in sorted(found, reverse=True):
        if all(abs(place - other) > 0.02 * travel for other in chosen):
            chosen.append(place)
    return tuple(float(np.clip(place, y.min(), y.max())) for place in chosen[:PLACES])


def periods(left: Residual, travel: float) -> tuple[float, ...]:
    """Wave lengths over position at which the residual force repeats, most telling first. [m]."""
    y, force = left.position[left.sliding], left.force[left.sliding]
    if len(y) < 100:
        return ()
    force = force - force.mean()
    shortest = max(2e-3, travel / 120)
    waves = np.arange(1.5 / travel, 1.0 / shortest, 0.2 / travel)
    power = np.abs(np.exp(-2j * np.pi * np.outer(waves, y - y.mean())) @ force)
    peaks = np.flatnonzero((power[1:-1] > power[:-2]) & (power[1:-1] >= power[2:])) + 1
    order = peaks[np.argsort(-power[peaks])]
    return tuple(float(1.0 / waves[k]) for k in order[:PLACES])


def _longest(flags: NDArray[np.bool_]) -> int:
    """Length of the longest run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(int), [0]])))
    return int((edges[1::2] - edges[0::2]).max()) if len(edges) else 0
