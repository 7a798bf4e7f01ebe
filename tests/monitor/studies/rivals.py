"""Other detectors on the same numbers, and the bars that give them the same rate of false alarms.

They see deviations in units of scatter, the true effect of temperature taken out: more than any of them has in the
field. The rate is that of the *first* false alarm: alarms over the time until them, on healthy axes.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

Array = np.ndarray
Statistic = Callable[[Array], Array]  # deviations (axes, windows) -> what is compared with the bar, same shape
KNOWN = 100  # healthy windows that are known before the first of the deviations
LOOK_BACK = 60  # windows PELT is given


def cusum(z: Array, size: float | Array) -> Array:
    """Log-likelihood CUSUM of a change whose size, in scatters, is known (optimal: Moustakides 1986)."""
    size = np.broadcast_to(np.asarray(size, dtype=float), z.shape[:1])
    out, total = np.empty_like(z), np.zeros(len(z))
    for k in range(z.shape[1]):
        total = np.maximum(total, 0.0) + size * (z[:, k] - size / 2)
        out[:, k] = total
    return out


def glr(x: Array, longest: int = 32) -> Array:
    """Likelihood ratio of a change of unknown size, time and direction in x (axes, windows, k) of unit covariance."""
    out = np.zeros(x.shape[:2])
    sums = np.cumsum(np.pad(x, ((0, 0), (1, 0), (0, 0))), axis=1)
    for m in range(1, min(longest, x.shape[1]) + 1):
        mean = (sums[:, m:] - sums[:, :-m]) / m
        out[:, m - 1 :] = np.maximum(out[:, m - 1 :], m * (mean**2).sum(axis=2))
    return out


def first(statistic: Array, bar: float) -> Array:
    """Windows to the first alarm of every axis; their number + 1 where there is none."""
    above = statistic > bar
    return np.where(above.any(axis=1), above.argmax(axis=1) + 1, statistic.shape[1] + 1)


def rate(found: Array, windows: int, per_year: float) -> float:
    """First alarms over the time until them. [1/a]"""
    alarms = (found <= windows).sum()
    return float(alarms / (np.minimum(found, windows).sum() / per_year))


def bar_of(statistic: Array, wanted: float, per_year: float) -> float:
    """Bar at which healthy axes raise `wanted` first alarms a year."""
    low, high = 0.0, float(statistic.max()) + 1e-9
    for _ in range(40):
        middle = (low + high) / 2
        often = rate(first(statistic, middle), statistic.shape[1], per_year) > wanted
        low, high = (middle, high) if often else (low, middle)
    return high


def page_hinkley(z: Array, known: Array, bar: float) -> int:
    """river's Page-Hinkley, both sides, half a scatter tolerated."""
    from river.drift import PageHinkley

    return _river(PageHinkley(min_instances=1, delta=0.5, threshold=bar, alpha=1.0, mode="both"), z, known)


def adwin(z: Array, known: Array, bar: float) -> int:
    """river's ADWIN, tested at every window."""
    from river.drift import ADWIN

    return _river(ADWIN(delta=float(np.exp(-bar)), clock=1, min_window_length=2, grace_period=2), z, known)


def _river(detector, z: Array, known: Array) -> int:
    for one in known:
        detector.update(float(one))
    for n, one in enumerate(z, 1):
        detector.update(float(one))
        if detector.drift_detected:
            return n
    return len(z) + 1


def penalty(z: Array, known: Array) -> Array:
    """Least penalty at which PELT (l2) sees no change in the last `LOOK_BACK` windows, at every window.

    For one change, or a stretch between two: more changes at one penalty each are never cheaper before those are.
    Checked against ruptures itself in `agrees`.
    """
    both = np.concatenate([known[-LOOK_BACK:], z])
    n = np.arange(1, LOOK_BACK)
    out = np.empty(len(z))
    i, j = np.triu_indices(LOOK_BACK + 1, 1)
    inner = (i > 0) & (j < LOOK_BACK)
    i, j = i[inner], j[inner]
    for k in range(len(z)):
        sums = np.concatenate([[0.0], np.cumsum(both[k + 1 : k + 1 + LOOK_BACK])])
        total = sums[-1]
        base = total**2 / LOOK_BACK
        one = sums[n] ** 2 / n + (total - sums[n]) ** 2 / (LOOK_BACK - n) - base
        two = sums[i] ** 2 / i + (sums[j] - sums[i]) ** 2 / (j - i) + (total - sums[j]) ** 2 / (LOOK_BACK - j) - base
        out[k] = max(one.max(), two.max() / 2)
    return out


def pelt(z: Array, known: Array, bar: float) -> int:
    """ruptures' PELT, run again at every window."""
    import ruptures

    both = np.concatenate([known[-LOOK_BACK:], z])
    for n in range(1, len(z) + 1):
        part = both[n : n + LOOK_BACK]
        if len(ruptures.Pelt(model="l2", min_size=1, jump=1).fit_predict(part, pen=bar)) > 1:
            return n
    return len(z) + 1


def bar_by_trial(
    detector: Callable[[Array, Array, float], int], z: Array, known: Array, wanted: float, per_year: float, tries: int
) -> float:
    """The same for a detector that has to be run: halving `tries` times."""
    low, high = 0.0, 40.0
    for _ in range(tries):
        middle = (low + high) / 2
        found = np.array([detector(one, before, middle) for one, before in zip(z, known, strict=True)])
        often = rate(found, z.shape[1], per_year) > wanted
        low, high = (middle, high) if often else (low, middle)
    return high
