"""Small changes of a machine's running motion, the least intrusive first: what the next recording could be.

In a closed loop the change is made to the positions the machine is sent to, in an open loop to its torque.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from identify.mismatch.separation import TICK, Motion
from identify.preprocess import Samples
from plant.axis import Axis

Floats = NDArray[np.float64]

LONGEST = 20.0  # s of the running motion that is changed
SMOOTH = 0.03  # s, standard deviation: takes the sensor's noise out of positions that become a reference
RESTS = (0.3, 2.0)  # s, in turn at the ends of strokes: two decades of contact age in a few strokes
TURNING = 0.03  # of the fastest speed: slower is the end of a stroke
FEWEST_APART = 0.3  # s between two ends of strokes
RIPPLE = 0.02  # of the travel: amplitude of a second frequency
SHORT = 0.01  # of the travel: short strokes
PAYLOAD = 0.2  # of the moving mass


@dataclass(frozen=True, slots=True, eq=False)
class Running:
    """The motion that a machine runs now, one stretch of it at equal steps.

    Attributes:
        axis: the machine.
        closed: True where a loop follows positions.
        step: [s]
        position: smoothed, at each step. [m] (n,)
        force: drive force at each step. [N] (n,)
        lowest, highest: ends of the recorded travel. [m]
        frequency: of its strokes. [Hz]
    """

    axis: Axis
    closed: bool
    step: float
    position: Floats
    force: Floats
    lowest: float
    highest: float
    frequency: float

    @classmethod
    def of(cls, samples: Samples, axis: Axis, closed: bool) -> Running:
        """The longest run of `samples`, at most `LONGEST` of it."""
        run = int(np.argmax(np.bincount(samples.run)))
        own = samples.run == run
        t = samples.t[own] - samples.t[own][0]
        step = samples.sample_time / max(1, round(samples.sample_time / TICK)) if closed else samples.sample_time
        ticks = np.arange(0.0, min(t[-1], LONGEST), step)
        position = gaussian_filter1d(np.interp(ticks, t, samples.position[own]), SMOOTH / step, mode="nearest")
        force = np.interp(ticks, t, samples.force[own])
        ends = _ends(position, step)
        if closed and len(ends) and ends[0] < len(ticks) // 2:  # begin at rest, as a machine does
            position, force, ticks = position[ends[0] :], force[ends[0] :], ticks[ends[0] :]
        frequency = max(len(ends) - 1, 1) / (2.0 * max(ticks[-1] - ticks[0], step))
        low, high = float(samples.position.min()), float(samples.position.max())
        return cls(axis, closed, step, position, force, low, high, frequency)

    @property
    def travel(self) -> float:
        """Recorded travel. [m]."""
        return self.highest - self.lowest

    @property
    def speed(self) -> float:
        """Fastest speed. [m/s]."""
        return float(np.quantile(np.abs(np.gradient(self.position, self.step)), 0.98))


def _ends(position: Floats, step: float) -> NDArray[np.int64]:
    """Where strokes end: the speed changes its sign or comes to rest, once per end."""
    velocity = np.gradient(position, step)
    fastest = float(np.quantile(np.abs(velocity), 0.98))
    moving = np.where(np.abs(velocity) > TURNING * fastest, np.sign(velocity), 0.0)
    ends: list[int] = []
    last = 0.0
    for index in np.flatnonzero(np.diff(moving) != 0) + 1:
        now = moving[index]
        ended = now == 0.0 or (last != 0.0 and now == -last)
        if ended and (not ends or (index - ends[-1]) * step > FEWEST_APART):
            ends.append(int(index))
        last = now or last
    return np.array(ends, dtype=np.int64)


def changes_of(running: Running) -> Iterator[Motion]:
    """Changed motions, the least intrusive first; nothing is known yet of limits, or of what they tell."""
    yield from _closed(running) if running.closed else _open(running)
    if running.axis.mechanics.inertia_known:
        yield _payload(running)


def again(running: Running) -> Motion:
    """The running motion unchanged."""
    return _motion(running, "the same motion again", running.position if running.closed else running.force)


def _motion(running: Running, words: str, wanted: Floats, payload: float = 0.0) -> Motion:
    seconds = running.step * len(wanted)
    return Motion(f"{words}, for {seconds:.0f} s", running.closed, running.step, wanted, payload)


def _stretched(series: Floats, factor: float) -> Floats:
    """The series `factor` times slower, as long as it was; a faster one goes back the way it came."""
    n = round(len(series) * factor)
    slow = np.interp(np.arange(n) / factor, np.arange(len(series)), series)
    there_and_back = np.concatenate([slow, slow[::-1]])
    return np.tile(there_and_back, int(np.ceil(len(series) / len(there_and_back))))[: len(series)]


def _rests(series: Floats, running: Running, level: float | None) -> Floats:
    """The series with rests at the ends of strokes; `level` is the force of a rest, None keeps the position."""
    parts, before = [], 0
    for number, end in enumerate(_ends(running.position, running.step)):
        rest = round(RESTS[number % len(RESTS)] / running.step)
        parts += [series[before:end], np.full(rest, series[end] if level is None else level)]
        before = int(end)
    return np.concatenate([*parts, series[before:]])[: round(LONGEST / running.step)]


def _closed(running: Running) -> Iterator[Motion]:
    """Changes of the positions that a loop is given."""
    unit, y, step = running.axis.position_unit, running.position, running.step
    t: Floats = step * np.arange(len(y), dtype=np.float64)
    rests = " and ".join(f"{rest:g} s" for rest in RESTS)
    yield _motion(running, f"the same strokes with rests of {rests} in turn at their ends", _rests(y, running, None))
    for factor in (2.0, 0.6):
        speed = running.speed / factor
        yield _motion(running, f"the same strokes at up to {speed:.2g} {unit}/s", _stretched(y, factor))
    low, high = running.lowest, running.highest
    slow = max(0.1 * running.speed, 2.0 * running.travel / 40.0)
    passes = low + running.travel * (0.5 - 0.5 * _triangle(t, slow / (2.0 * running.travel)))
    yield _motion(running, f"slow passes over {low:.3g} to {high:.3g} {unit} at {slow:.2g} {unit}/s, each way", passes)
    for hertz in (2.0, 5.0):
        ripple = RIPPLE * running.travel * 2.0 / hertz
        ease = np.clip(t / 0.5, 0.0, 1.0)
        words = f"the same strokes with {hertz:g} Hz of ±{ripple:.2g} {unit} on top"
        yield _motion(running, words, y + ease * ripple * np.sin(2 * np.pi * hertz * t))
    short = SHORT * running.travel
    little = 0.5 * (low + high) + short * np.sin(2 * np.pi * 1.0 * t) * np.clip(t, 0.0, 1.0)
    yield _motion(running, f"short strokes of ±{short:.2g} {unit} at 1 Hz in the middle of the travel", little)


def _open(running: Running) -> Iterator[Motion]:
    """Changes of the torque that an open loop is given."""
    mean, gain = float(running.force.mean()), running.axis.mechanics.gain
    swing = running.force - mean
    largest = float(np.abs(swing).max()) / abs(gain)
    t: Floats = running.step * np.arange(len(swing), dtype=np.float64)
    held = running.axis.mechanics.weight or mean
    rests = " and ".join(f"{rest:g} s" for rest in RESTS)
    pauses = f"the same torque with rests of {rests} in turn at the ends of the strokes"
    yield _motion(running, pauses, _rests(running.force, running, held))
    for factor in (0.85, 1.15):
        yield _motion(running, f"the same torque, swinging ±{factor * largest:.3g} N*m", mean + factor * swing)
    for times in (3.0, 7.0):
        hertz = times * running.frequency
        more = 0.25 * float(np.abs(swing).max()) * np.sin(2 * np.pi * hertz * t)
        words = f"the same torque with {hertz:.2g} Hz of ±{0.25 * largest:.2g} N*m on top"
        yield _motion(running, words, mean + swing + more)
    for factor in (1.6, 0.6):
        words = f"the same torque {'slower' if factor > 1 else 'faster'}, at {running.frequency / factor:.2g} Hz"
        yield _motion(running, words, mean + _stretched(swing, factor))
    ramps = held + float(np.abs(swing).max()) * _triangle(t + 2.5, 0.1)
    yield _motion(running, f"torque ramps of ±{largest:.3g} N*m about standstill, 10 s each", ramps)


def _payload(running: Running) -> Motion:
    """The running motion with a known payload."""
    mechanics = running.axis.mechanics
    payload = PAYLOAD * (mechanics.moving_mass if running.axis.is_rotary else mechanics.M or mechanics.moving_mass)
    more = payload * mechanics.g if mechanics.weight > 0 else 0.0
    wanted = running.position if running.closed else running.force + more
    words = f"the same motion with a known payload of {payload:.2g} {running.axis.inertia_unit}"
    return _motion(running, words, wanted, payload)


def _triangle(t: Floats, frequency: float) -> Floats:
    """Between -1 and 1, from 1 downwards first. (n,)"""
    phase = np.mod(t * frequency, 1.0)
    return np.asarray(4.0 * np.abs(phase - 0.5) - 1.0, dtype=np.float64)
