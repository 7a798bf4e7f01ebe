"""From a recording to runs of samples the model can be marched over; each step reports what it removed."""

from __future__ import annotations

import dataclasses
import itertools
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_banded

from identify.kernels.smoothing import slopes
from identify.mending import Mender, Piece
from plant.axis import Axis, TorqueHold
from plant.recording import Recording

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

FASTEST = 0.004  # s; faster data are averaged: one-step errors of very clean fast data say nothing about friction
AVERAGED = 0.005  # s, what they are averaged to when the axis file does not say
REGULAR = 0.1  # share of the period a regular clock's steps may scatter
LOST_SAMPLE = 1.5  # periods: a longer step of a regular clock is a gap
LOST_IRREGULAR = 3.5  # periods, for an irregular clock
FEWEST = 3  # means in a row of which the one in the middle turns
SHORTEST_RUN = 20  # samples; shorter pieces between gaps are dropped
NOMINAL = 0.05  # share by which the nominal sample time may miss the stamps' median


@dataclass(frozen=True, eq=False)
class Samples:
    """Samples in one or more runs; the model restarts where a new run begins, so it never crosses a gap.

    Attributes:
        t: time since the first sample. [s] (n,)
        force: drive force at the belt. [N] (n,)
        position: [m] (n,)
        steps: time to the next sample; 0 at the end of a run. [s] (n,)
        run: index of the run, ascending from 0. (n,)
        valid: False where the position is an outlier or frozen: marched over, not compared. (n,)
        sample_time: nominal period after averaging. [s]
        linear: True when the force runs straight between samples, False when it is held.
        mean: True where a held force is the mean over its sample: it runs through the sample as its neighbours say.
        removed: what each step took away or changed, in words.
    """

    t: Floats
    force: Floats
    position: Floats
    steps: Floats
    run: Ints
    valid: Bools
    sample_time: float
    linear: bool
    mean: bool = False
    removed: tuple[str, ...] = ()

    def __len__(self) -> int:
        """Count the samples."""
        return len(self.t)

    @cached_property
    def ends(self) -> tuple[Floats, Floats]:
        """Drive force just after each sample and just before the next. [N] (n,) each"""
        force = self.force
        if self.linear:
            return force, np.append(force[1:], force[-1])
        if not self.mean:
            return force, force
        rise = np.zeros_like(force)
        rise[1:-1] = np.where(self.run[2:] == self.run[:-2], 0.25 * (force[2:] - force[:-2]), 0.0)
        return force - rise, force + rise

    @cached_property
    def used(self) -> int:
        """Number of positions compared with the model."""
        return int(np.count_nonzero(self.valid))

    @cached_property
    def runs(self) -> int:
        """Number of runs."""
        return int(self.run[-1]) + 1

    @cached_property
    def first(self) -> Ints:
        """Index of each run's first sample. (runs,)"""
        return np.flatnonzero(np.diff(self.run, prepend=-1)).astype(np.int64)

    @cached_property
    def edges(self) -> Ints:
        """First sample of each run, and the end. (runs + 1,)"""
        return np.append(self.first, len(self.t))

    def part(self, start: int, stop: int) -> Samples:
        """Samples `start` to `stop` (exclusive), runs counted anew."""
        cut = slice(start, stop)
        run = self.run[cut] - self.run[start]
        steps = self.steps[cut].copy()
        steps[-1] = 0.0
        return dataclasses.replace(
            self,
            t=self.t[cut],
            force=self.force[cut],
            position=self.position[cut],
            steps=steps,
            run=run,
            valid=self.valid[cut],
        )


def split_at_gaps(t: Floats) -> list[slice]:
    """Slices of `t` without a gap in them; pieces shorter than `SHORTEST_RUN` samples are left out."""
    step = np.diff(t)
    period = float(np.median(step))
    regular = float(np.mean(np.abs(step - period) > REGULAR * period)) < 0.02
    longest = (LOST_SAMPLE if regular else LOST_IRREGULAR) * period
    edges = [0, *(np.flatnonzero(step > longest) + 1).tolist(), len(t)]
    pieces = [slice(a, b) for a, b in itertools.pairwise(edges)]
    return [piece for piece in pieces if piece.stop - piece.start >= SHORTEST_RUN]


def average_down(piece: Piece, ratio: int, held: bool) -> Piece:
    """Means over blocks of `ratio` samples, and the force, straight between them, that takes a mass along these means.

    The second difference of a mass' positions is the force weighed with a hat two periods wide: a held one's mean of
    two samples, a straight one's (1, 4, 1)/6 of three. So that of the means is the mean of what each of their samples
    is pushed by over two blocks, however restless the force is within them; a plain mean of the force folds what is
    faster than the means down into what is slow (a loop's noise was a hundredth of the dry friction).

    A mean over `h` lies h^2/24 times the acceleration beside the middle: friction, which turns with the motion, would
    do so by h^2/12 F_c/m at each reversal, like a gap (45 urad of a joint at 1 kHz and 10 ms). What the second
    difference of the means tells of it is taken out of positions and forces alike, to the fourth order.
    """
    n = (len(piece.t) // ratio) * ratio
    beside = (1.0 - ratio**-2.0) / 24.0

    def blocks(x: Floats) -> Floats:
        return np.asarray(x[:n].reshape(-1, ratio).mean(axis=1), dtype=np.float64)

    def middles(x: Floats) -> Floats:
        means = blocks(x)
        if len(means) >= FEWEST:
            means[1:-1] -= beside * np.diff(means, 2)
        return means

    before = np.concatenate([piece.force[:1], piece.force[:-1]])
    after = np.concatenate([piece.force[1:], piece.force[-1:]])
    pushed = 0.5 * (before + piece.force) if held else (before + 4.0 * piece.force + after) / 6.0
    hat = (ratio - np.abs(np.arange(1 - ratio, ratio))) / ratio**2
    valid = blocks(piece.valid.astype(np.float64)) > 0.5
    force = middles(pushed)
    if len(force) >= FEWEST:
        padded = np.pad(pushed, ratio - 1, "edge")
        force = _straight(middles(np.convolve(padded, hat, "valid")), force)
    return Piece(blocks(piece.t), force, middles(piece.position), valid)


def _straight(pushed: Floats, ends: Floats) -> Floats:
    """The force (n,), straight between samples, whose (1, 4, 1)/6 is `pushed` (n,); at the ends that of `ends` (n,)."""
    bands = np.repeat(np.array([[1.0], [4.0], [1.0]]) / 6.0, len(pushed), axis=1)
    bands[:, [0, -1]] = [[0.0, 1.0 / 6.0], [1.0, 1.0], [1.0 / 6.0, 0.0]]
    bands[0, 1] = bands[2, -2] = 0.0
    wanted = pushed.copy()
    wanted[[0, -1]] = ends[[0, -1]]
    return np.asarray(solve_banded((1, 1), bands, wanted), dtype=np.float64)


def prepare(recording: Recording, axis: Axis) -> Samples:
    """Split `recording` at its gaps, take out what sensors got wrong, average fast data down.

    Args:
        recording: finite samples with rising stamps (see judge).
        axis: resolutions, possible acceleration, wanted sample time.
    """
    removed: list[str] = []
    period = float(np.median(np.diff(recording.t)))
    if abs(recording.period - period) > NOMINAL * period:
        removed.append(f"nominal sample time {recording.period:g} s not used: the stamps are {period:.4g} s apart")
    wanted = axis.analysis_sample_time or (AVERAGED if period < FASTEST else period)
    ratio = max(1, round(wanted / period))
    held = recording.hold is not TorqueHold.LINEAR
    if recording.hold is TorqueHold.UNKNOWN:
        removed.append("what a force sample means is not known: taken as held until the next")
    mender = Mender(axis)
    gaps = split_at_gaps(recording.t)
    used = sum(piece.stop - piece.start for piece in gaps)
    if len(gaps) > 1 or used < len(recording):
        removed.append(f"{len(gaps)} runs between gaps; {len(recording) - used} samples in shorter pieces left out")
    pieces = [
        part for cut in gaps for part in mender.mend(recording.t[cut], recording.force[cut], recording.position[cut])
    ]
    removed += mender.report()
    if ratio > 1:
        removed.append(f"{1 / period:.4g} Hz averaged down to {1 / (period * ratio):.4g} Hz")
        pieces = [average_down(piece, ratio, held) for piece in pieces]
    pieces = [piece for piece in pieces if len(piece.t) >= SHORTEST_RUN and piece.valid.any()]
    if not pieces:
        return _empty(period * ratio)
    joined = _joined(pieces, recording.t[0], ratio > 1 or not held)
    mean = recording.hold is TorqueHold.MEAN and not joined.linear
    return dataclasses.replace(joined, mean=mean, removed=tuple(removed))


def _joined(pieces: list[Piece], zero: float, linear: bool) -> Samples:
    """All pieces one after the other, as runs."""
    t = np.concatenate([piece.t for piece in pieces]) - zero
    run = np.repeat(np.arange(len(pieces)), [len(piece.t) for piece in pieces])
    steps = np.append(np.diff(t), 0.0)
    steps[np.flatnonzero(np.diff(run))] = 0.0
    return Samples(
        t=t,
        force=np.concatenate([piece.force for piece in pieces]),
        position=np.concatenate([piece.position for piece in pieces]),
        steps=steps,
        run=run.astype(np.int64),
        valid=np.concatenate([piece.valid for piece in pieces]),
        sample_time=float(np.median(steps[steps > 0])),
        linear=linear,
    )


def _empty(sample_time: float) -> Samples:
    """No run is long enough."""
    nothing = np.empty(0)
    valid = np.empty(0, dtype=np.bool_)
    return Samples(nothing, nothing, nothing, nothing, np.empty(0, dtype=np.int64), valid, sample_time, False)


def smooth_velocity(samples: Samples, span: float = 0.05) -> Floats:
    """Velocity from straight lines through 2 * `span` seconds of position, within each run. [m/s] (n,)"""
    velocity = np.empty(len(samples))
    reach = max(2, round(span / samples.sample_time))
    slopes(samples.t, samples.position, samples.edges, reach, velocity)
    return velocity
