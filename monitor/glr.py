"""Has the mean of the last windows left the baseline, and how high must the bar be? Pure.

Generalised likelihood ratio over the time of the change (Lorden 1971; Siegmund & Venkatraman 1995): for every number of
last windows m, the mean deviation over its standard error. It is near the optimum for a change of any size, where a
CUSUM is for one. The error holds what a plain CUSUM leaves out: the baseline is an estimate too, neighbouring windows
err alike, some windows are less certain, and far from the temperatures and loads of the baseline less is known.

A change must also pass a floor (it is worth telling). Where the floor alone keeps back most of what chance does, the
bar may be lower at the same rate of false alarms: `common_bars` counts both.
"""

from __future__ import annotations

import dataclasses
import functools
from dataclasses import dataclass
from typing import Any

import numpy as np

from monitor.moments import BLOCK, Fitted
from plant.recording import Floats

LONGEST = 32  # windows looked back over; at the bar of one false alarm a year they tell 0.8 of one window's scatter
LEAST = 3.0  # standard errors: nothing less is told, even where the floor alone keeps the rate
OVERSHOOT = 0.583  # nu(x) ~ exp(-0.583 x): how far discrete steps overshoot
CROWDING = 0.735  # integral of x nu(x)²: how much neighbouring m and windows share
YEAR_NS = 31_557_600 * 10**9  # Julian year


@dataclass(frozen=True, slots=True, eq=False)
class Looked:
    """Deviations over the last m = 1, 2, ... windows, rows by m.

    Attributes:
        mean: weighted mean deviation. (m, J)
        error: its standard error. (m, J)
        plain: the same without what the baseline does not know at these temperatures and loads. (m, J)
        near: the same without what moves it untold, which is much alike over a few weeks. (m, J)
    """

    mean: Floats
    error: Floats
    plain: Floats
    near: Floats

    @property
    def t(self) -> Floats:
        """Deviation in standard errors. (m, J)"""
        return np.asarray(self.mean / self.error, dtype=np.float64)


@functools.lru_cache(maxsize=4096)
def bar(rate: float, steps_per_year: float, dof: float) -> float:
    """Deviation, in standard errors estimated with `dof`, that one healthy number passes `rate` times a year.

    Both sides together, over all m. Siegmund & Venkatraman 1995 for normal deviates, then Student's quantile of the
    same probability: the scatter is known from the baseline only.
    """
    from scipy.special import ndtr, stdtrit

    per_step = rate / steps_per_year
    low, high = 1.0, 12.0
    for _ in range(50):
        c = (low + high) / 2
        often = c * np.exp(-(c**2) / 2) / np.sqrt(2 * np.pi) * CROWDING
        low, high = (c, high) if often > per_step else (low, c)
    return float(-stdtrit(dof, ndtr(-max(high, 2.0))))


def common_bars(
    rate: float, steps_per_year: float, errors: Floats, floors: Floats, dof: Floats, most: Floats, sure: float
) -> Floats:
    """Deviations, in standard errors, that healthy numbers with floors pass `rate` times a year, all together. (m, J)

    Bonferroni over the numbers, the sum of Siegmund & Venkatraman's clumps over m (their integral, taken apart, the
    first term exact), each at the higher of bar and floor.

    Args:
        rate: false alarms. [1/a]
        steps_per_year: windows. [1/a]
        errors: standard errors of the means over the last m windows. (m, J)
        floors: smallest change that is told. (J,)
        dof: behind the errors. (m, J)
        most: errors no axis exceeds, (m, J); no bar is higher than with these ...
        sure: ... and so many degrees of freedom.
    """
    m = np.arange(1, len(errors) + 1)[:, None]
    needed = _normal(floors / errors, dof)
    low, high = LEAST, 12.0
    for _ in range(24):
        c = (low + high) / 2
        often = _clumps(np.maximum(c, needed), m).sum() > rate / steps_per_year
        low, high = (c, high) if often else (low, c)
    return np.asarray(np.minimum(_student(high, dof), _student(high, np.array(sure)) * most / errors), dtype=np.float64)


def _clumps(c: Floats, m: Any) -> Floats:
    """How often a step brings the mean over m windows beyond c, for the first time in a while. [1]"""
    from scipy.special import ndtr

    density = np.exp(-(c**2) / 2) / np.sqrt(2 * np.pi)
    later = c**3 * density * np.exp(-2 * OVERSHOOT * c / np.sqrt(m)) / (2 * m**2)
    return np.asarray(np.where(m == 1, 2 * ndtr(-c), later), dtype=np.float64)


def _normal(t: Floats, dof: Floats) -> Floats:
    """Normal deviate of the same probability as Student's t (Wallace 1959; good to a percent of the deviate)."""
    return np.asarray(_shrunk(dof) * np.sqrt(dof * np.log1p(np.minimum(t, 1e6) ** 2 / dof)), dtype=np.float64)


def _student(c: float, dof: Floats) -> Floats:
    """The inverse of `_normal`."""
    return np.asarray(np.sqrt(dof * np.expm1(np.minimum((c / _shrunk(dof)) ** 2 / dof, 50.0))), dtype=np.float64)


def _shrunk(dof: Floats) -> Floats:
    return (8 * dof + 1) / (8 * dof + 3)


@functools.lru_cache(maxsize=256)
def _inflation(rho: tuple[float, ...], count: int) -> Floats:
    """Variance of the mean of m autocorrelated deviates over that of independent ones. (count, J)"""
    r = np.array(rho)[None, :]
    m = np.arange(1, count + 1)[:, None]
    return np.asarray((1 + r) / (1 - r) - 2 * r * (1 - r**m) / (m * (1 - r) ** 2), dtype=np.float64)


def variances(total: Floats, fit: Fitted, baseline_windows: int) -> Floats:
    """Of the mean deviation over the last m windows, which weigh as `total` usual ones. (m, J)"""
    rho = tuple(np.round(fit.correlation, 3).tolist())
    forever = (1 + fit.correlation) / (1 - fit.correlation)
    scatter = fit.variance * (_inflation(rho, len(total)) / total + forever / baseline_windows)
    then = BLOCK / np.maximum(baseline_windows, BLOCK)  # wandering is that of blocks: the level averages over several
    return np.asarray(scatter + fit.wandering * (1.0 + then) + fit.untold, dtype=np.float64)


def widest(total: Floats, fit: Fitted, baseline_windows: int) -> Floats:
    """`variances` of an axis that wanders as far as any may. (m, J)"""
    return variances(total, dataclasses.replace(fit, wandering=np.maximum(fit.wandering, fit.most)), baseline_windows)


def freedom(total: Floats, fit: Fitted, baseline_windows: int) -> Floats:
    """Degrees of freedom of `variances` (Satterthwaite 1946): few blocks tell how far an axis wanders. (m, J)"""
    whole = variances(total, fit, baseline_windows)
    wandering = fit.wandering * (1.0 + BLOCK / np.maximum(baseline_windows, BLOCK))
    scatter = whole - wandering - fit.untold
    unsure = scatter**2 / fit.dof + wandering**2 / fit.wandering_dof
    return np.asarray(whole**2 / unsure, dtype=np.float64)


def look(residuals: Floats, looseness: Floats, away: Floats, fit: Fitted, baseline_windows: int) -> Looked:
    """Means over the last m windows.

    Args:
        residuals: value minus prediction, oldest first; nan where a window did not tell. (n, J)
        looseness: variance of a window over that of the baseline's, >= 1. (n, J)
        away: temperature and load minus the baseline's means. (n, p)
        fit: scatter, slopes and autocorrelation of the baseline.
        baseline_windows: behind the level.
    """
    known = np.isfinite(residuals)
    weight = np.where(known, 1.0 / looseness, 0.0)[::-1]
    total = np.maximum(np.cumsum(weight, axis=0), 1e-12)
    mean = np.cumsum(weight * np.where(known, residuals, 0.0)[::-1], axis=0) / total
    plain = variances(total, fit, baseline_windows)
    unsure = np.zeros_like(mean)
    if away.shape[1]:
        centre = np.cumsum(weight[:, :, None] * away[::-1][:, None, :], axis=0) / total[:, :, None]
        unsure = fit.variance * np.einsum("mjp,jpq,mjq->mj", centre, fit.spread, centre)
    whole = plain + unsure
    return Looked(mean, np.sqrt(whole), np.sqrt(plain), np.sqrt(whole - fit.untold))
