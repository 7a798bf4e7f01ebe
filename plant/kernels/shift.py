"""Dead time: the drive force of an earlier moment, interpolated as the samples are meant (held or linear).

Over one sample the delayed force jumps (held) or bends (linear) where an older sample begins: two pieces, and the
sub-step that contains the switch gets their mean.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@njit(cache=True, nogil=True)
def _line(t: Floats, start: Floats, end: Floats, k: int, low: float, high: float) -> tuple[float, float]:
    """Straight line over [low, high] with mean and first moment of the force there; k: a sample not before `high`."""
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
        if lower == low and upper == high:
            return first, last
        piece, mean = upper - lower, 0.5 * (first + last)
        impulse += piece * mean
        moment += piece * mean * (0.5 * (lower + upper) - middle) + piece * piece * (last - first) / 12.0
        upper = lower
    length = high - low
    mean, tilt = impulse / length, 12.0 * moment / (length * length * length)
    return mean - 0.5 * length * tilt, mean + 0.5 * length * tilt


@njit(cache=True, nogil=True)
def delayed(t: Floats, start: Floats, end: Floats, k: int, delay: float) -> tuple[float, float]:
    """Drive force just after sample k and just before the next, `delay` seconds late, as one line [N].

    Where it is late, this looks at samples up to k alone, so that a closed loop may call it while it fills `start` and
    `end`. Before the first sample the force is that of the first sample, after the last it goes on as it was.

    Args:
        t: time stamps. [s] (n,)
        start: force just after each sample. [N] (n - 1,)
        end: force just before the next. [N] (n - 1,)
        k: sample, 0 .. n - 2.
        delay: negative where the force is early. [s]
    """
    if delay == 0.0:
        return start[k], end[k]
    return _line(t, start, end, _latest(t, k, delay), t[k] - delay, t[k + 1] - delay)


@njit(cache=True, nogil=True)
def _latest(t: Floats, k: int, delay: float) -> int:
    """Last sample whose force is felt before sample k + 1."""
    i = k
    while i + 2 < t.shape[0] and t[i + 1] < t[k + 1] - delay:
        i += 1
    return i


@njit(cache=True, nogil=True)
def delayed_pieces(
    t: Floats, start: Floats, end: Floats, k: int, delay: float
) -> tuple[float, float, float, float, float]:
    """START, END, SWITCH, START_2, END_2 of sample k (rows of `laws.py`), `delay` seconds late; arguments of `delayed`.

    Where stamps are so irregular that several older samples begin within this one, the last is the switch.
    """
    low, high = t[k] - delay, t[k + 1] - delay
    i = _latest(t, k, delay)
    while i >= 0 and t[i] >= high:
        i -= 1
    if delay == 0.0 or i < 0 or t[i] <= low:
        first, last = delayed(t, start, end, k, delay)
        return first, last, 1.0, first, last
    switch = (t[i] - low) / (high - low)
    before, at_switch = _line(t, start, end, i, low, t[i])
    after_switch, after = _line(t, start, end, i, t[i], high)
    return (
        before,
        before + (at_switch - before) / switch,
        switch,
        after - (after - after_switch) / (1.0 - switch),
        after,
    )


@njit(cache=True, nogil=True)
def delay_pieces(t: Floats, start: Floats, end: Floats, delays: Floats, drive: Floats) -> None:
    """Fill `drive` (n - 1, 5, lanes) for each lane's delay (lanes,), see `delayed_pieces`."""
    for k in range(t.shape[0] - 1):
        pieces = delayed_pieces(t, start, end, k, delays[0])
        for j in range(delays.shape[0]):
            if j > 0 and delays[j] != delays[j - 1]:  # candidates mostly differ in other things
                pieces = delayed_pieces(t, start, end, k, delays[j])
            for row in range(5):
                drive[k, row, j] = pieces[row]
