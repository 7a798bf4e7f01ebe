"""Faults of sensors and clocks in raw samples: wraps, jumps, spikes, frozen readings. Finding them, nothing else.

What is possible at all is bounded by physics: between two samples the position cannot move further than the speed
allows, and it cannot bend more than the drive can accelerate the mass.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

SIGMAS = 8.0  # robust standard deviations
TOO_FAST = 4.0  # times the fastest lasting change: no machine doubles its speed twice within one sample
LONGEST_EXCURSION = 8  # samples a reading may be away and come back
REPEATS = 10  # equal readings in a row that can be a frozen sensor
TWINS = 0.85  # of the larger bend: two neighbours this alike are the two sides of a step
SPIKE = np.array([1.0, -4.0, 6.0, -4.0, 1.0]) / 6.0  # bends around a spike of 1
MEETING = np.array([0.0, -0.5, 1.0, -0.5, 0.0])  # around a sudden other speed
FORCE_SPIKE = 0.2  # of the force's range
FEELING = 0.02  # s beside a spike of the force, and four samples at least: what the position shows of it
DENIED = 0.25  # of what the position leaves with a spike: leaving less without it, the machine did not feel it
LATEST = 4  # samples that a drive may be late
MANY = 0.02  # share of samples above which "spikes" are how this signal looks


def spread(x: Floats) -> float:
    """Robust standard deviation about zero: of the median and of the 90 % quantile the larger."""
    if not len(x):
        return 0.0
    middle, high = np.quantile(np.abs(x), (0.5, 0.9))
    return float(max(middle / 0.6745, high / 1.645))


def running_median(x: Floats) -> Floats:
    """Median of each five neighbours, by a sorting network. (n - 4,)"""
    a, b, c, d, e = x[:-4], x[1:-3], x[2:-2], x[3:-1], x[4:]
    low = np.maximum(np.minimum(a, b), np.minimum(c, d))
    high = np.minimum(np.maximum(a, b), np.maximum(c, d))
    return np.asarray(np.maximum(np.minimum(low, high), np.minimum(np.maximum(low, high), e)), dtype=np.float64)


def bend(t: Floats, y: Floats) -> Floats:
    """Each sample minus the cubic through its two neighbours on either side, whatever the clock does. (n,)"""
    out = np.zeros(len(y))
    if len(y) < 5:
        return out
    here = t[2:-2]
    stamps = [t[:-4] - here, t[1:-3] - here, t[3:-1] - here, t[4:] - here]
    values = [y[:-4], y[1:-3], y[3:-1], y[4:]]
    guess = np.zeros(len(here))
    for i in range(4):
        weight = np.ones(len(here))
        for j in range(4):
            if j != i:
                weight *= stamps[j] / (stamps[j] - stamps[i])
        guess += weight * values[i]
    out[2:-2] = y[2:-2] - guess
    return out


def largest_step(t: Floats, x: Floats, resolution: float) -> Floats:
    """The furthest a reading can have moved from each sample to the next: (n-1,).

    The fastest rate of change that lasted for three samples at least, noise, and the resolution.
    """
    step = np.diff(t)
    rate = np.abs(np.diff(x)) / step
    if len(rate) < 5:
        return np.full(len(rate), np.inf)
    lasting = float(running_median(rate).max())
    noise = SIGMAS * spread(bend(t, x))
    return np.asarray(TOO_FAST * lasting * step + noise + 4.0 * resolution, dtype=np.float64)


def unwrapped(y: Floats) -> tuple[Floats, int, float]:
    """An angle that wraps made continuous, with the number of wraps and the turn they had. [rad]

    A wrap is a step of more than half the range, both ends of which lie at opposite ends of it.
    """
    step = np.diff(y)
    reach = float(np.ptp(y))
    wraps = np.flatnonzero(np.abs(step) > 0.8 * reach)
    if len(wraps) == 0 or reach == 0.0:
        return y, 0, 0.0
    ordinary = np.abs(np.delete(step, wraps))
    if len(ordinary) == 0 or float(np.quantile(ordinary, 0.99)) > 0.1 * reach:
        return y, 0, 0.0
    before = step[np.clip(wraps - 1, 0, None)]
    turn = float(np.median(np.abs(step[wraps] - before)))
    shift = np.zeros(len(y))
    shift[wraps + 1] = -np.sign(step[wraps]) * turn
    return np.asarray(y + np.cumsum(shift), dtype=np.float64), len(wraps), turn


def excursions_and_jumps(y: Floats, furthest: Floats) -> tuple[Bools, Ints]:
    """Samples impossibly far away that come back (n,), and the indices at which the position jumped for good.

    Args:
        y: position. [m] (n,)
        furthest: `largest_step` of it. [m] (n - 1,)
    """
    away = np.zeros(len(y), dtype=np.bool_)
    hop = np.diff(y)
    hops = np.flatnonzero(np.abs(hop) > furthest).tolist()
    jumps: list[int] = []
    while hops:
        k = hops.pop(0)
        if hops and hops[0] - k <= LONGEST_EXCURSION and abs(y[hops[0] + 1] - y[k]) < 0.5 * abs(hop[k]):
            away[k + 1 : hops.pop(0) + 1] = True
        else:
            jumps.append(k + 1)
    return away, np.array(jumps, dtype=np.int64)


def spikes_and_steps(
    t: Floats, y: Floats, acceleration: float, resolution: float, passes: int = 6
) -> tuple[Bools, Ints]:
    """Single samples (n,), and indices of lasting steps, that bend the motion more than `acceleration` [m/s²] can.

    Against the cubic through its neighbours a spike shows as -2/3, 1, -2/3, a step between two samples as -1/2, 1/2.
    What shows as -1/2, 1, -1/2 is a sudden other speed: the two sides of a gap that meet. That happens.
    """
    y, found, steps = y.copy(), np.zeros(len(y), dtype=np.bool_), set[int]()
    period = float(np.median(np.diff(t)))
    for _ in range(passes):
        off = bend(t, y)
        size = np.abs(off)
        limit = max(SIGMAS * max(spread(off), resolution), 0.25 * acceleration * period**2)
        around = np.stack([np.roll(size, shift) for shift in (-2, -1, 1, 2)]).max(axis=0)
        bad = (size > limit) & (size >= around)
        if not bad.any() or (found | bad).mean() > MANY:
            break
        for k in np.flatnonzero(bad).tolist():
            after = k + 1 if size[k + 1] >= size[k - 1] else k
            if off[after] * off[after - 1] < 0 and min(size[after], size[after - 1]) > TWINS * size[k]:
                steps.add(after)
                y[after:] -= off[after] - off[after - 1]
            elif not _meets(off[max(0, k - 2) : k + 3]):
                found[k] = True
                y[k] -= off[k]
    return found, np.array(sorted(steps), dtype=np.int64)


def _meets(off: Floats) -> bool:
    """Whether five bends (5,) around a sample are those of a sudden other speed rather than of a spike."""
    if len(off) < len(SPIKE):
        return False
    spike, meeting = (float(shape @ off) ** 2 / float(shape @ shape) for shape in (SPIKE, MEETING))
    return meeting > spike


def force_spikes(force: Floats) -> Bools:
    """One or two samples far off both sides of their neighbourhood; none where the signal is like that. (n,)"""
    if len(force) < 7:
        return np.zeros(len(force), dtype=np.bool_)
    padded = np.pad(force, 2, mode="edge")
    off = force - running_median(padded)
    low, high = np.quantile(force, (0.005, 0.995))
    limit = max(SIGMAS * spread(off), FORCE_SPIKE * (high - low))
    bad = np.abs(off) > limit
    leap = np.abs(np.diff(force, prepend=force[:1], append=force[-1:])) > limit  # leap[k]: between samples k-1 and k
    for begin, end in groups(bad):
        bad[begin:end] &= leap[begin] and leap[end]  # the top of a short pulse is no leap away from its flanks
    return bad if 0 < bad.mean() <= MANY else np.zeros(len(force), dtype=np.bool_)


def groups(flags: Bools) -> list[tuple[int, int]]:
    """Beginning and end (past the last) of each run of True in flags (n,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(np.int8), [0]])))
    return list(zip(edges[0::2].tolist(), edges[1::2].tolist(), strict=True))


def unfelt(t: Floats, force: Floats, position: Floats, odd: Bools, mass: float) -> Bools:
    """Those of the `odd` samples of a force (n,) that the position denies: wrong readings, no short strong pulses. (n,)

    Beside each, drives of the `mass` [kg] against an equal force are compared: by the force as it was read, or some
    samples later, and with a straight line over the odd ones. Where they start, how fast and against what is free.
    """
    out = np.zeros(len(force), dtype=np.bool_)
    if not odd.any() or odd.all():
        return out
    plain = np.where(odd, np.interp(t, t[~odd], force[~odd]), force)
    reach = max(4, round(FEELING / float(np.median(np.diff(t)))))
    for begin, end in groups(odd):
        near = slice(max(0, begin - reach), min(len(force), end + reach + LATEST))
        since = t[near] - t[near.start]
        free = np.stack([np.ones_like(since), since, since**2], axis=1)
        at = np.arange(near.start, near.stop)
        forces = np.stack([plain[near], *(force[np.maximum(at - late, 0)] for late in range(LATEST))])
        left = position[near] - np.stack([_driven(since, one / mass) for one in forces])
        rest = np.sum((left.T - free @ np.linalg.lstsq(free, left.T, rcond=None)[0]) ** 2, axis=0)
        out[begin:end] = rest[0] < DENIED * rest[1:].min()
    return out


def _driven(t: Floats, acceleration: Floats) -> Floats:
    """Position at t (n,) from rest, of an acceleration that is held from each sample to the next. (n,)"""
    step = np.diff(t)
    speed = np.concatenate([[0.0], np.cumsum(acceleration[:-1] * step)])
    return np.concatenate([[0.0], np.cumsum(speed[:-1] * step + 0.5 * acceleration[:-1] * step**2)])


def frozen(x: Floats, leap: Floats | float) -> Bools:
    """Stretches of equal readings that begin or end with a step of more than `leap` ((n-1,) or one number). (n,)

    A machine comes to rest and leaves it gently; a frozen reading has to catch up.
    """
    step = np.diff(x)
    sudden = np.concatenate([[False], np.abs(step) > leap, [False]])  # sudden[k]: between samples k-1 and k
    out = np.zeros(len(x), dtype=np.bool_)
    for begin, end in groups(step == 0.0):  # x[begin..end] are equal
        if end - begin + 1 >= REPEATS and (sudden[begin] or sudden[end + 1]):
            out[begin + 1 : end + 1] = True
    return out


def repeats_elsewhere(x: Floats, stretches: Bools) -> float:
    """Share of readings equal to the one before, outside of `stretches` (n,). [1]"""
    outside = ~stretches[1:]
    return float(np.mean(np.diff(x)[outside] == 0.0)) if outside.any() else 1.0
