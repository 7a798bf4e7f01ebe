"""Dead time: the drive force of an earlier moment, interpolated as the samples are meant (held or linear).

Over one sample the delayed force may jump (held) or bend (linear). It is handed on as the straight line with the same
mean and the same first moment, so that speed and position at the next sample are those of the true shape.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@njit(cache=True, nogil=True)
def delayed(t: Floats, start: Floats, end: Floats, k: int, delay: float) -> tuple[float, float]:
    """Drive force just after sample k and just before the next, `delay` seconds late [N].

    Looks at samples up to k alone, so that a closed loop may call it while it fills `start` and `end`. Before the first
    sample the force is that of the first sample.

    Args:
        t: time stamps. [s] (n,)
        start: force just after each sample. [N] (n - 1,)
        end: force just before the next. [N] (n - 1,)
        k: sample, 0 .. n - 2.
        delay: >= 0. [s]
    """
    if delay <= 0.0:
        return start[k], end[k]
    length = t[k + 1] - t[k]
    low, high = t[k] - delay, t[k + 1] - delay
    middle = 0.5 * (low + high)
    impulse, moment = 0.0, 0.0
    upper = high
    i = k
    while upper > low:
        if i >= 0 and t[i] >= upper:
            i -= 1
            continue
        lower = low if i < 0 else max(low, t[i])
        if i < 0:
            first, last = start[0], start[0]
        else:
            slope = (end[i] - start[i]) / (t[i + 1] - t[i])
            first, last = start[i] + slope * (lower - t[i]), start[i] + slope * (upper - t[i])
        piece, mean = upper - lower, 0.5 * (first + last)
        impulse += piece * mean
        moment += piece * mean * (0.5 * (lower + upper) - middle) + piece * piece * (last - first) / 12.0
        upper = lower
    mean, tilt = impulse / length, 12.0 * moment / (length * length * length)
    return mean - 0.5 * length * tilt, mean + 0.5 * length * tilt


@njit(cache=True, nogil=True)
def delay_all(t: Floats, start: Floats, end: Floats, delay: float, new_start: Floats, new_end: Floats) -> None:
    """Fill `new_start` and `new_end` (n - 1,) with the force `delay` seconds late."""
    for k in range(t.shape[0] - 1):
        new_start[k], new_end[k] = delayed(t, start, end, k, delay)
