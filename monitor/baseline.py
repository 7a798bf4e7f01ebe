"""What is normal for an axis: friction at reference speeds over its first healthy windows, with its scatter. Pure."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

from monitor import cusum
from monitor.estimate import Curve
from plant.recording import Floats

MARGIN = 0.75  # of the fastest speed, up to which friction is compared
REFERENCES = 5  # reference speeds, spread over the range the axis visits
SHAPES = ("friction at low speed", "friction at mid speed", "friction at high speed", "Coulomb level", "viscous slope")
WIDTHS = (0.0, 0.25, 0.5, 1.0)  # how much of the identification's own variance shows between windows


@dataclass(frozen=True, slots=True)
class Indicator:
    """One number watched: its baseline, its scatter and its chart.

    Attributes:
        name: one of `SHAPES`.
        unit: N, or N*s/m for the slope (N*m, N*m*s/rad on a rotary axis).
        mean: baseline value.
        extra: variance between windows that the identification does not know of (maximum likelihood).
        width: share of the identification's variance that shows between windows.
        widest: largest standard error seen in the baseline.
        scale: change that equals a relative change of 1 of the axis' friction.
        k, h: allowance and threshold of the CUSUM, in units of the scatter.
    """

    name: str
    unit: str
    mean: float
    extra: float
    width: float
    widest: float
    scale: float
    k: float
    h: float

    def deviation(self, value: float, error: float) -> float:
        """Standardised deviation; a window far less certain than the baseline's counts with its own error."""
        own = 1.0 if error > 2 * self.widest else self.width
        return (value - self.mean) / float(np.sqrt(self.extra + own * error**2))


@dataclass(frozen=True, slots=True)
class Baseline:
    """The learned normal state.

    Attributes:
        windows: how many made it.
        from_ns, to_ns: first and last sample. [ns]
        steps_per_year: non-overlapping informative windows, at the cadence of the baseline. [1/a]
        speeds: reference speeds. [m/s or rad/s] (REFERENCES,)
        friction: mean friction there. [N or N·m] (REFERENCES,)
        stribeck_velocity: median, for the shapes of changes. [m/s or rad/s]
        covariance: of one window's friction there, from the baseline. [N²] (REFERENCES, REFERENCES)
        indicators: what is watched.
    """

    windows: int
    from_ns: int
    to_ns: int
    steps_per_year: float
    speeds: tuple[float, ...]
    friction: tuple[float, ...]
    stribeck_velocity: float
    covariance: tuple[tuple[float, ...], ...]
    indicators: tuple[Indicator, ...]

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Baseline:
        """Read what `dataclasses.asdict` wrote, through JSON."""
        return cls(
            **{
                **values,
                "speeds": tuple(values["speeds"]),
                "friction": tuple(values["friction"]),
                "covariance": tuple(tuple(row) for row in values["covariance"]),
                "indicators": tuple(Indicator(**one) for one in values["indicators"]),
            }
        )


@dataclass(frozen=True, slots=True)
class Learned:
    """One window of the baseline in the making."""

    start_ns: int
    end_ns: int
    curve: Curve
    stribeck_velocity: float | None = None


def indicators_of(speeds: Floats, values: Floats, errors: Floats) -> tuple[Floats, Floats]:
    """The numbers watched and their standard errors, from friction at the reference speeds; order of `SHAPES`."""
    upper = slice(len(speeds) // 2, None)
    design = np.column_stack([np.ones(len(speeds[upper])), speeds[upper]])
    line = np.linalg.pinv(design)  # level and slope of the upper half, where Stribeck's bump is gone
    level, slope = line @ values[upper]
    level_error, slope_error = np.sqrt((line**2) @ errors[upper] ** 2)
    at = [0, len(speeds) // 2, -1]
    return np.array([*values[at], level, slope]), np.array([*errors[at], level_error, slope_error])


def learn(
    windows: tuple[Learned, ...], needed: int, min_change: float, rate: float, force_unit: str = "N"
) -> Baseline | None:
    """Make the baseline from `windows`, or None while fewer than `needed` share a range of speeds.

    Args:
        windows: identified, non-overlapping, in order of time.
        needed: windows that make a baseline. [1] >= 5
        min_change: relative change the watch is tuned to find soon; half of it is tolerated for ever. [1]
        rate: false alarms of all indicators, both sides, together. [1/a]
        force_unit: N or N*m.
    """
    speeds = reference_speeds([window.curve for window in windows])
    if speeds is None:
        return None
    seen = [(window, at) for window in windows if (at := window.curve.at(speeds)) is not None]
    if len(seen) < needed:
        return None
    v = np.array(speeds)
    values = np.array([at[0] for _, at in seen])
    numbers, errors = (np.array(rows) for rows in zip(*(indicators_of(v, *at) for _, at in seen), strict=True))
    friction = values.mean(axis=0)
    first, last = seen[0][0], seen[-1][0]
    steps = (len(seen) - 1) / max(last.end_ns - first.end_ns, 1) * cusum.YEAR_NS
    middle = float(abs(friction[len(v) // 2]))
    scales = [*np.abs(friction[[0, len(v) // 2, -1]]), middle, middle / speeds[-1]]
    slope_unit = f"{force_unit}*s/{'rad' if force_unit == 'N*m' else 'm'}"
    share = rate / (2 * len(SHAPES))
    indicators = tuple(
        _indicator(name, slope_unit if name == SHAPES[-1] else force_unit, x, s, float(scale), min_change, steps, share)
        for name, x, s, scale in zip(SHAPES, numbers.T, errors.T, scales, strict=True)
    )
    spread = np.atleast_2d(np.cov(values.T))
    covariance = 0.7 * spread + 0.3 * np.diag(np.diag(spread))  # 20 windows do not know 15 numbers: shrink
    return Baseline(
        len(seen),
        first.start_ns,
        last.end_ns,
        steps,
        speeds,
        tuple(friction.tolist()),
        _stribeck_velocity([window for window, _ in seen], speeds),
        tuple(tuple(row) for row in covariance.tolist()),
        indicators,
    )


def _stribeck_velocity(windows: list[Learned], speeds: tuple[float, ...]) -> float:
    known = [window.stribeck_velocity for window in windows if window.stribeck_velocity]
    return float(np.median(known)) if known else speeds[len(speeds) // 2] / 2


def reference_speeds(curves: list[Curve]) -> tuple[float, ...] | None:
    """Speeds that four of five windows visited, spread on the logarithm; None where fewer than three are shared.

    They end somewhat below the fastest: an axis that wears becomes slower, and must stay comparable.
    """
    curves = [curve for curve in curves if len(curve.speeds) > 0]
    if not curves:
        return None
    low = float(np.quantile([curve.speeds[0] for curve in curves], 0.8, method="higher"))
    high = MARGIN * float(np.quantile([curve.fastest for curve in curves], 0.2, method="lower"))
    widest = max(curves, key=lambda curve: len(curve.speeds)).speeds
    common = [speed for speed in widest if low * (1 - 1e-9) <= speed <= high * (1 + 1e-9)]
    if len(common) < 3:
        return None
    picks = np.unique(np.linspace(0, len(common) - 1, REFERENCES).round().astype(int))
    return tuple(common[i] for i in picks)


def _indicator(
    name: str, unit: str, x: Floats, s: Floats, scale: float, min_change: float, steps: float, rate: float
) -> Indicator:
    mean, extra, width = scatter(x, s)
    deviation = float(np.sqrt(extra + width * np.mean(s**2)))
    shift = max(1.0, min_change * scale / deviation)
    k, h = cusum.design(shift, steps, rate, len(x))
    return Indicator(name, unit, mean, extra, width, float(s.max()), scale, k, h)


def scatter(x: Floats, s: Floats) -> tuple[float, float, float]:
    """Mean, extra variance and width of `Indicator` by maximum likelihood over x ~ N(mean, extra + width s²).

    The variance is corrected for the mean's degree of freedom, as in n/(n - 1).
    """
    n = len(x)
    total = float(np.var(x, ddof=1)) + 1e-12 * float(np.mean(x)) ** 2 + 1e-30
    best = (-np.inf, float(x.mean()), total, 0.0)
    for width in WIDTHS:
        for extra in total * np.concatenate(([1e-6], np.geomspace(1e-2, 2.0, 40))):
            variance = extra + width * s**2
            mean = float(np.sum(x / variance) / np.sum(1 / variance))
            likelihood = -0.5 * float(np.sum(np.log(variance) + (x - mean) ** 2 / variance))
            if likelihood > best[0]:
                best = (likelihood, mean, float(extra), width)
    correction = n / (n - 1)
    return best[1], best[2] * correction, best[3] * (correction if best[3] else 1.0)


def to_dict(baseline: Baseline) -> dict[str, Any]:
    """Plain values for JSON."""
    return dataclasses.asdict(baseline)
