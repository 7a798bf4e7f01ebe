"""What a recording says of inertia, constant force and friction, roughly and without any starting value.

The weak form of eq. (5): force and motion are seen through a smooth kernel whose derivatives are known, so that the
position is never differentiated: sum(F phi) = m sum(y phi'') + c + F_c sum(sign(v) phi) + F_v sum(y phi'), and a
bump that decays with speed, as in eq. (1), because its neglect would pass for a delay.
Good to some percent, which is what judging signs and units takes; identification is elsewhere.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from plant.axis import TorqueHold
from plant.recording import Recording

Floats = NDArray[np.float64]

KERNEL_SECONDS = 0.25  # longer than noise and quantisation, shorter than a stroke
KERNEL_SAMPLES = (9, 401)
GAP = 2.5  # median periods without a sample end a segment
SLOW = 0.05  # of the 95 % speed: below it the axis may stick, where friction is anything
BUMP = 4.0  # of that speed: the decay of the bump, a fifth of the 95 % speed
LONGEST = 60_000  # samples looked at
LONGEST_DELAY = 0.1  # s
SEEN_DELAY = (0.3, 0.005)  # of the residual's and of the force's variance must go with it


@dataclass(frozen=True, slots=True)
class Fit:
    """The rough inverse model, with standard errors that allow for the kernel's correlation.

    Attributes:
        mass: force per acceleration. [kg; kg·m² rotary]
        mass_error: standard error, infinite where there is no acceleration to speak of.
        constant: mean of the forces of both directions at speed. [N; N·m]
        constant_error: standard error, infinite where the axis moved one way only.
        friction: half the difference of both directions, at the median speed. [N; N·m]
        friction_error: standard error, infinite where the axis moved one way only.
        speed: the median speed of motion. [m/s or rad/s]
        residual: rms of the force that this model leaves. [N; N·m]
        force: rms of the force it explains, its mean taken off. [N; N·m]
        rows: independent equations, about.
        delay: of the position behind the force; negative when the force is the late one. [s]
        delay_gain: part of the residual's variance that the delay explains. 0 ... 1
    """

    mass: float
    mass_error: float
    constant: float
    constant_error: float
    friction: float
    friction_error: float
    speed: float
    residual: float
    force: float
    rows: float
    delay: float = 0.0
    delay_gain: float = 0.0


@dataclass(frozen=True, slots=True)
class _Kernel:
    """phi and its first two derivatives, on a grid of `period`."""

    flat: Floats
    slope: Floats
    bend: Floats

    @classmethod
    def of(cls, period: float) -> _Kernel:
        """(1 - x²)^4, wide enough for `period` [s], normalised so that polynomials of degree two come out exact."""
        half = int(np.clip(round(KERNEL_SECONDS / period), *KERNEL_SAMPLES)) // 2
        x = np.arange(-half, half + 1) / (half + 1)
        tau = x * (half + 1) * period
        flat = (1 - x**2) ** 4
        slope = -8 * x * (1 - x**2) ** 3
        bend = (1 - x**2) ** 2 * (56 * x**2 - 8)
        bend -= flat * bend.sum() / flat.sum()
        return cls(flat / flat.sum(), -slope / (slope @ tau), bend / (bend @ tau**2 / 2))


def segments(recording: Recording) -> Iterator[tuple[float, Floats, Floats]]:
    """Yield (period, force, position) of each gapless stretch on an even grid, of samples that can be used."""
    t, force, y = recording.t, recording.force, recording.position
    good = np.isfinite(t) & np.isfinite(force) & np.isfinite(y)
    t, force, y = (values[good][:LONGEST] for values in (t, force, y))
    if len(t) < 3 or np.any(np.diff(t) < 0):
        return
    period = float(np.median(np.diff(t)))
    if period <= 0:
        return
    ends = [0, *(np.flatnonzero(np.diff(t) > GAP * period) + 1), len(t)]
    for first, last in itertools.pairwise(ends):
        if last - first < 3:
            continue
        grid = np.arange(t[first], t[last - 1], period)
        part = slice(first, last)
        held = recording.hold in (TorqueHold.HOLD, TorqueHold.MEAN)  # acts half a sample after its stamp
        late = t[part] + 0.5 * period if held else t[part]
        yield period, np.interp(grid, late, force[part]), np.interp(grid, t[part], y[part])


def finest_step(values: Floats) -> float:
    """Least difference between distinct values, rounding of floats aside: a sensor's step, or finer; 0 if none."""
    distinct = np.unique(values[np.isfinite(values)][:LONGEST])
    steps = np.diff(distinct)
    steps = steps[steps > 1e-9 * np.abs(distinct).max(initial=0.0)]
    return float(steps.min()) if len(steps) else 0.0


def velocities(recording: Recording) -> list[tuple[float, Floats]]:
    """(period, smoothed velocity) of each gapless stretch that is longer than the kernel. [s], [m/s or rad/s]"""
    found = []
    for period, _, y in segments(recording):
        kernel = _Kernel.of(period)
        if len(y) > len(kernel.slope):
            found.append((period, np.convolve(y - y.mean(), kernel.slope, "valid")))
    return found


def fit(recording: Recording) -> Fit | None:
    """Fit the rough inverse model; None where there are too few usable samples in motion."""
    found = list(segments(recording))
    if not found:
        return None
    most = min(max(1, int(LONGEST_DELAY / found[0][0])), 40)
    lags = (
        list(range(-most, most + 1))
        if most <= 12
        else [*range(-most, -12, 4), *range(-12, 13), *range(16, most + 1, 4)]
    )
    step = finest_step(recording.position)
    rows = [row for segment in found if (row := _Rows.of(*segment, step=step, lags=lags)) is not None]
    return _solve(rows, lags) if rows else None


@dataclass(frozen=True, slots=True)
class _Rows:
    """One segment through the kernel, rows in motion only: regressors (k,), and the force at each lag (k, lags)."""

    period: float
    width: int
    bend: Floats
    side: Floats
    bump: Floats
    slope: Floats
    forces: Floats

    @classmethod
    def of(cls, period: float, force: Floats, y: Floats, step: float, lags: list[int]) -> _Rows | None:
        kernel = _Kernel.of(period)
        width, margin = len(kernel.flat), max(map(abs, lags))
        if len(y) < 3 * width + 2 * margin:
            return None
        velocity = np.convolve(y - y.mean(), kernel.slope, "valid")
        slow = max(SLOW * float(np.quantile(np.abs(velocity), 0.95)), step / (width * period))
        if slow == 0:
            return None
        way = np.clip(velocity / slow, -1, 1)
        side = np.convolve(way, kernel.flat, "valid")
        bump = np.convolve(way * np.exp(-np.abs(velocity) / (BUMP * slow)), kernel.flat, "valid")
        resting = np.convolve((np.abs(velocity) < slow).astype(np.float64), kernel.flat, "valid")
        half = width // 2
        bend = np.convolve(y - y.mean(), kernel.bend, "valid")[half:-half]
        smooth = np.convolve(force, kernel.flat, "valid")[half:-half]
        rows = np.arange(margin, len(side) - margin, _stride(width))
        rows = rows[resting[rows] < 0.3]
        forces = np.column_stack([smooth[rows - lag] for lag in lags])
        return cls(period, width, bend[rows], side[rows], bump[rows], velocity[half:-half][rows], forces)


def _stride(width: int) -> int:
    """Rows this far apart still overlap so much that none between them adds anything."""
    return max(1, width // 16)


def _solve(segments: list[_Rows], lags: list[int]) -> Fit | None:
    """Least squares over all segments, at every lag at once; the lag that leaves least is the delay."""
    names = ("bend", "side", "bump", "slope")
    bend, side, bump, slope = (np.concatenate([getattr(rows, name) for rows in segments]) for name in names)
    targets = np.concatenate([rows.forces for rows in segments])
    width, period = segments[0].width, segments[0].period
    correlated = 0.5 * width / _stride(width)  # neighbouring rows share most of their samples
    if len(targets) < 4 * correlated:
        return None
    two_way = min(np.mean(side > 0.5), np.mean(side < -0.5)) > 0.02
    matrix = np.column_stack([bend, np.ones_like(bend)] + ([side, slope, bump] if two_way else []))
    scale = np.sqrt(np.mean(matrix**2, axis=0))
    scale[scale == 0] = 1.0
    left, singular, right = np.linalg.svd(matrix / scale, full_matrices=False)
    inverse = np.where(singular > 1e-9 * singular[0], 1 / np.maximum(singular, 1e-300), 0.0)
    solutions = (right.T * inverse) @ (left.T @ targets) / scale[:, None]
    squares = np.sum((targets - matrix @ solutions) ** 2, axis=0)
    now, best = lags.index(0), int(np.argmin(squares))
    gained, whole = squares[now] - squares[best], len(targets) * np.var(targets[:, now])
    if best in (0, len(lags) - 1) or gained < SEEN_DELAY[0] * squares[now] or gained < SEEN_DELAY[1] * whole:
        best = now  # at the edge of what is searched, or hardly better: no delay
    variance = squares[best] / max(len(targets) - correlated * matrix.shape[1], 1.0)
    covariance = (right.T * inverse**2) @ right * variance * correlated / np.outer(scale, scale)
    solution = solutions[:, best]
    at = np.zeros(matrix.shape[1])
    speed = float(np.median(np.abs(slope)))
    if two_way:
        at[2:] = 1.0, speed, float(np.mean(np.abs(bump[np.abs(np.abs(slope) - speed) < 0.3 * speed])))
    return Fit(
        mass=float(solution[0]),
        mass_error=float(np.sqrt(covariance[0, 0])),
        constant=float(solution[1]),
        constant_error=float(np.sqrt(covariance[1, 1])) if two_way else float("inf"),
        friction=float(at @ solution),
        friction_error=float(np.sqrt(max(at @ covariance @ at, 0.0))) if two_way else float("inf"),
        speed=speed,
        residual=float(np.sqrt(squares[best] / len(targets))),
        force=float(np.std(targets[:, best])),
        rows=len(targets) / correlated,
        delay=lags[best] * period,
        delay_gain=1 - float(squares[best] / squares[now]) if squares[now] > 0 else 0.0,
    )
