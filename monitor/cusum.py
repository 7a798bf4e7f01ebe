"""How high a CUSUM's threshold must be so that a healthy axis cries wolf no more often than set. Pure.

One-sided CUSUM S <- max(0, S + z - k) with alarm at S > h over standardised deviations z; run length by Siegmund's
approximation (Siegmund 1985, Sequential Analysis, §II.6, with the boundary shifted by 1.166 for discrete time). The
baseline's mean and scatter come from only n windows and stay wrong for the whole year: the rate is averaged over both
errors, else it would be broken for unlucky axes.
"""

from __future__ import annotations

import functools

import numpy as np

from plant.recording import Floats

OVERSHOOT = 1.166  # 2 * 0.583, Siegmund's correction for discrete time
YEAR_NS = 31_557_600 * 10**9  # Julian year


def run_length(k: float, h: float | Floats, bias: Floats | float = 0.0, scale: Floats | float = 1.0) -> Floats:
    """Mean number of steps to a (false) alarm when z is normal with mean `bias` and standard deviation `scale`. [1]

    Siegmund's form is within 6 % of the exact value (Markov chain, see the test) for k <= 1, but up to four times too
    long for k of 1.5 to 3, where single large deviations decide: their rate is added, which errs to the safe side.
    """
    from scipy.special import ndtr

    drift = (np.asarray(bias) - k) / np.asarray(scale)
    boundary = np.asarray(h) / np.asarray(scale) + OVERSHOOT
    x = np.clip(-2.0 * drift * boundary, -600.0, 600.0)
    small = np.abs(drift) < 1e-6
    safe = np.where(small, 1.0, drift)
    siegmund = np.where(small, boundary**2, (np.exp(x) - x - 1.0) / (2.0 * safe**2))
    at_once = ndtr((np.asarray(bias) - k - h) / np.asarray(scale))
    return np.asarray(1.0 / (1.0 / siegmund + at_once), dtype=np.float64)


@functools.cache
def _baseline_errors(n: int) -> tuple[Floats, Floats, Floats]:
    """Nodes (bias, scale) and weights of the errors of a baseline from `n` windows, in units of its scatter."""
    from scipy.special import chdtri

    x = np.linspace(-5.0, 5.0, 81)
    normal = np.exp(-(x**2) / 2)
    levels = (np.arange(41) + 0.5) / 41
    scale = np.sqrt((n - 1) / chdtri(n - 1, 1.0 - levels))  # true over estimated scatter
    bias = scale[:, None] * x[None, :] / np.sqrt(n)
    weights = np.broadcast_to(normal / normal.sum() / len(levels), bias.shape)
    return bias, np.broadcast_to(scale[:, None], bias.shape), weights


def alarms_per_year(k: float, h: float, steps_per_year: float, n: int) -> float:
    """Expected false alarms of one side of one chart, averaged over the errors of its baseline of `n` windows. [1/a]"""
    bias, scale, weights = _baseline_errors(n)
    recovery = h / k  # steps until it can be raised again
    return float(np.sum(weights * steps_per_year / (run_length(k, h, bias, scale) + recovery)))


def design(smallest_shift: float, steps_per_year: float, rate: float, n: int) -> tuple[float, float]:
    """Allowance k and threshold h, in units of the scatter, so that one side alarms falsely at most at `rate`.

    k is half the smallest shift worth detecting; where the baseline is too unsure for that at any h, k grows.

    Args:
        smallest_shift: in units of the scatter. [1] > 0
        steps_per_year: window cadence. [1/a]
        rate: [1/a]
        n: windows of the baseline.
    """
    k = smallest_shift / 2
    while alarms_per_year(k, 60.0 / min(k, 1.0), steps_per_year, n) > rate:
        k *= 1.2
    low, high = 1.0, 60.0 / min(k, 1.0)
    if alarms_per_year(k, low, steps_per_year, n) <= rate:
        return k, low
    for _ in range(40):
        middle = (low + high) / 2
        low, high = (middle, high) if alarms_per_year(k, middle, steps_per_year, n) > rate else (low, middle)
    return k, high
