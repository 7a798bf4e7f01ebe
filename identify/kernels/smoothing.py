"""Local fits to a noisy position: straight lines for the velocity, parabolas as wide as the noise asks for."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from plant.kernels.step import FASTMATH

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

RIDGE = 1e-12  # keeps a parabola through two samples solvable
AGREE = 2.5  # standard deviations: velocities of ever wider parabolas must stay within those of the narrower ones
FEW = 5  # samples that a parabola is always laid through
JUMP = 4.0  # times the misfit that chance allows: then lost samples are no mere gap
CHANCE = 3.0  # standard deviations by which the misfit of a parabola may exceed the noise's


@njit(cache=True, fastmath=FASTMATH, error_model="numpy")
def slopes(t: Floats, position: Floats, edges: Ints, reach: int, velocity: Floats) -> None:
    """Slopes of straight lines through `reach` samples to each side, within each run.

    Args:
        t: time. [s] (n,)
        position: [m] (n,)
        edges: first sample of each run, and the end. (runs + 1,)
        reach: samples to each side.
        velocity: filled; 0 in a run of one sample. [m/s] (n,)
    """
    for r in range(edges.shape[0] - 1):
        first, last = edges[r], edges[r + 1]
        for k in range(first, last):
            low, high = max(k - reach, first), min(k + reach + 1, last)
            count = high - low
            s_t, s_y, s_tt, s_ty = 0.0, 0.0, 0.0, 0.0
            for i in range(low, high):
                u, y = t[i] - t[k], position[i] - position[k]
                s_t += u
                s_y += y
                s_tt += u * u
                s_ty += u * y
            spread = s_tt - s_t * s_t / count
            velocity[k] = (s_ty - s_t * s_y / count) / spread if spread > 0.0 else 0.0


@njit(cache=True, fastmath=FASTMATH, error_model="numpy")
def parabolas(
    t: Floats,
    position: Floats,
    edges: Ints,
    run: Ints,
    at: Ints,
    reaches: Ints,
    period: float,
    noise: float,
    states: Floats,
) -> None:
    """Position and velocity at some samples by parabolas, widened while they fit and agree with the narrower ones.

    The intervals of the velocity must keep something in common (intersection of confidence intervals, Goldenshluger &
    Nemirovski 1997): the widest parabola whose bend is still below its noise, also where samples lie on one side only.
    A parabola reaches across lost samples, unless that fits nothing (a jump of the zero).

    Args:
        t: time; starts anew with each recording. [s] (n,)
        position: [m] (n,)
        edges: first sample of each run, and the end. (runs + 1,)
        run: index of each sample's run. (n,)
        at: the samples asked for. (k,)
        reaches: samples to each side to try, ascending; the first is taken in any case. (w,)
        period: scales the time. [s]
        noise: standard deviation of the position's. [m]
        states: filled with position [m] and velocity [m/s]. (k, 2)
    """
    for i in range(at.shape[0]):
        k = at[i]
        if not _widened(t, position, 0, t.shape[0], k, reaches, period, noise, states[i]):
            _widened(t, position, edges[run[k]], edges[run[k] + 1], k, reaches, period, noise, states[i])


@njit(cache=True, fastmath=FASTMATH, error_model="numpy")
def _widened(
    t: Floats,
    position: Floats,
    first: int,
    last: int,
    k: int,
    reaches: Ints,
    period: float,
    noise: float,
    state: Floats,
) -> bool:
    """State at sample k from samples `first` to `last`; False where they jump."""
    lowest, highest = -np.inf, np.inf
    for w in range(reaches.shape[0]):
        span = reaches[w] * period
        low, high = k, k + 1
        while low > first and low > k - reaches[w] and abs(t[low - 1] - t[k]) < span + 0.5 * period:
            low -= 1
        while high < last and high <= k + reaches[w] and abs(t[high] - t[k]) < span + 0.5 * period:
            high += 1
        s0, s1, s2, s3, s4, b0, b1, b2 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for j in range(low, high):
            u, y = (t[j] - t[k]) / span, position[j] - position[k]
            u2 = u * u
            s0, s1, s2, s3, s4 = s0 + 1.0, s1 + u, s2 + u2, s3 + u2 * u, s4 + u2 * u2
            b0, b1, b2 = b0 + y, b1 + y * u, b2 + y * u2
        d0 = s0 + RIDGE  # L D L' of the normal equations
        l1, l2 = s1 / d0, s2 / d0
        d1 = s2 + RIDGE - l1 * s1
        l3 = (s3 - l1 * s2) / d1
        d2 = s4 + RIDGE - l2 * s2 - l3 * l3 * d1
        z1 = b1 - l1 * b0
        c2 = (b2 - l2 * b0 - l3 * z1) / d2
        c1 = z1 / d1 - l3 * c2
        c0 = b0 / d0 - l1 * c1 - l2 * c2
        square = 0.0
        for j in range(low, high):
            u = (t[j] - t[k]) / span
            wrong = position[j] - position[k] - (c0 + u * (c1 + u * c2))
            square += wrong * wrong
        free = max(high - low - 3, 1)
        doubt = AGREE * noise * np.sqrt(1.0 / d1 + l3 * l3 / d2) / span
        lowest, highest = max(lowest, c1 / span - doubt), min(highest, c1 / span + doubt)
        most = noise * noise * (free + CHANCE * np.sqrt(2.0 * free))
        if high - low <= FEW or (square <= most and lowest <= highest):
            state[0], state[1] = c0 + position[k], c1 / span
            if w == 0 and square > JUMP * most:
                return False
        else:
            break
    return True
