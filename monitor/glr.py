"""Has the mean of the last windows left the baseline, and how high must the bar be? Pure.

Generalised likelihood ratio over the time of the change (Lorden 1971; Siegmund & Venkatraman 1995): for every number of
last windows m, the mean deviation over its standard error. It is near the optimum for a change of any size, where a
CUSUM is for one. The error holds what a plain CUSUM leaves out: the baseline is an estimate too, neighbouring windows
err alike, some windows are less certain, and far from the temperatures and loads of the baseline less is known.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from monitor.moments import Fitted
from plant.recording import Floats

LONGEST = 32  # windows looked back over; at the bar of one false alarm a year they tell 0.8 of one window's scatter
CROWDING = 0.735  # integral of x nu(x)², nu(x) ~ exp(-0.583 x): how much neighbouring m and windows share
YEAR_NS = 31_557_600 * 10**9  # Julian year


@dataclass(frozen=True, slots=True, eq=False)
class Looked:
    """Deviations over the last m = 1, 2, ... windows, rows by m.

    Attributes:
        mean: weighted mean deviation. (m, J)
        error: its standard error. (m, J)
        plain: the same without what the baseline does not know at these temperatures and loads. (m, J)
    """

    mean: Floats
    error: Floats
    plain: Floats

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


@functools.lru_cache(maxsize=256)
def _inflation(rho: tuple[float, ...], count: int) -> Floats:
    """Variance of the mean of m autocorrelated deviates over that of independent ones. (count, J)"""
    r = np.array(rho)[None, :]
    m = np.arange(1, count + 1)[:, None]
    return np.asarray((1 + r) / (1 - r) - 2 * r * (1 - r**m) / (m * (1 - r) ** 2), dtype=np.float64)


def look(residuals: Floats, looseness: Floats, away: Floats, fit: Fitted, baseline_windows: int) -> Looked:
    """Means over the last m windows.

    Args:
        residuals: value minus prediction, oldest first; nan where a window did not tell. (n, J)
        looseness: variance of a window over that of the baseline's, >= 1. (n, J)
        away: temperature and load minus the baseline's means. (n, p)
        fit: scatter, slopes and autocorrelation of the baseline.
        baseline_windows: behind the level.
    """
    variance, correlation = fit.variance, fit.correlation
    known = np.isfinite(residuals)
    weight = np.where(known, 1.0 / looseness, 0.0)[::-1]
    total = np.maximum(np.cumsum(weight, axis=0), 1e-12)
    mean = np.cumsum(weight * np.where(known, residuals, 0.0)[::-1], axis=0) / total
    rho = tuple(np.round(correlation, 3).tolist())
    inflation = _inflation(rho, len(residuals))
    forever = (1 + correlation) / (1 - correlation)
    plain = variance * (inflation / total + forever / baseline_windows) + 2.0 * fit.wandering  # now, and then
    unsure = np.zeros_like(mean)
    if away.shape[1]:
        centre = np.cumsum(weight[:, :, None] * away[::-1][:, None, :], axis=0) / total[:, :, None]
        unsure = variance * np.einsum("mjp,jpq,mjq->mj", centre, fit.spread, centre)
    return Looked(mean, np.sqrt(plain + unsure), np.sqrt(plain))
