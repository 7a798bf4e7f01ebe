"""Where to look for effects: sizes, places and wave lengths, from the force that the model does not explain."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.faults import groups
from identify.mismatch.extended import ExtendedProblem
from identify.mismatch.guise import Setting
from identify.mismatch.inverse import unexplained
from identify.preprocess import Samples, smooth_velocity
from plant.effects.effect import Surroundings

Floats = NDArray[np.float64]

SPAN = 0.04  # s to each side of a local slope
CUT = 12.0  # Hz: what position sensors resolve as force
RESTING = 0.02  # of the fastest speed: slower counts as rest
SELDOM = 0.005, 0.995  # of the samples: so much of them may be noise
PLACES = 6  # starting points taken from the residual


@dataclass(frozen=True, slots=True, eq=False)
class Left:
    """Force that the model leaves over while the axis slides.

    Attributes:
        position: [m] (k,)
        force: drive force minus inverse model. [N] (k,)
        odd: its half that flips with the direction: friction. [N] (k,)
    """

    position: Floats
    force: Floats
    odd: Floats


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


def left_force(problem: ExtendedProblem, x: Floats) -> Left:
    """What the model leaves over, away from rests and reversals."""
    samples = problem.samples
    nothing = np.empty(0)
    lacking = unexplained(problem, x, samples, CUT)
    if lacking is None:
        return Left(nothing, nothing, nothing)
    velocity = smooth_velocity(samples, SPAN)
    resting = np.abs(velocity) <= max(RESTING * problem.scales.speed, 1e-12)
    reach = max(1, round(SPAN / samples.sample_time))
    near_rest = np.convolve(resting.astype(float), np.ones(2 * reach + 1), mode="same") > 0
    keep = ~near_rest[lacking.index]
    at, force = lacking.index[keep], lacking.lacking[keep]
    return Left(samples.position[at], force, force * np.sign(velocity[at]))


def setting_of(problem: ExtendedProblem, x: Floats, native_time: float = 0.0) -> Setting:
    """Where to look for effects in these samples, given a baseline fit x; `native_time` before averaging [s]."""
    samples, scales = problem.samples, problem.scales
    left = left_force(problem, x)
    velocity = smooth_velocity(samples, SPAN)
    rest = np.abs(velocity) < RESTING * scales.speed
    motor = scales.mass * (Surroundings.of(problem.axis).motor_share or 0.0)
    low, high = np.quantile(samples.force - motor * acceleration_of(samples, velocity), SELDOM)
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
        free_offset=not problem.gravity_known and problem.known is None,
        native_time=native_time,
        reverses=bool(low < 0.0 < high),
    )


def spots(left: Left, travel: float) -> tuple[float, ...]:
    """Positions at which the odd residual force stands out, most telling first. [m]."""
    y, force = left.position, left.odd
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


def periods(left: Left, travel: float) -> tuple[float, ...]:
    """Wave lengths over position at which the residual force repeats, most telling first. [m]."""
    y, force = left.position, left.force
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
    return max((end - begin for begin, end in groups(flags)), default=0)
