"""Take out of a piece of recording what its sensors got wrong, and remember what that was."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.faults import (
    excursions_and_jumps,
    force_spikes,
    frozen,
    groups,
    largest_step,
    repeats_elsewhere,
    spikes_and_steps,
    unfelt,
    unwrapped,
)
from plant.axis import Axis
from plant.effects.effect import Surroundings

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

LONGEST_BLIND = 0.25  # s the model runs on without a position; longer frozen stretches are cut out
RARE = 0.02  # share of repeated readings up to which a constant force is news
MOSTLY = 0.3  # share of frozen samples above which a piecewise constant force is how this machine is driven


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """Raw samples without a gap: t [s], force [N], position [m], and whether the position counts; (n,) each."""

    t: Floats
    force: Floats
    position: Floats
    valid: Bools

    def cut(self, edges: list[int]) -> list[Piece]:
        """The pieces between `edges`, which include 0 and the end."""
        return [
            Piece(self.t[a:b], self.force[a:b], self.position[a:b], self.valid[a:b])
            for a, b in itertools.pairwise(edges)
        ]


class Mender:
    """Finds and repairs faults in one piece after the other, and remembers how many."""

    def __init__(self, axis: Axis) -> None:
        """Take resolutions and the possible acceleration from `axis`."""
        self._axis = axis
        self._counts: dict[str, int] = {}

    def mend(self, t: Floats, force: Floats, position: Floats) -> list[Piece]:
        """Runs without faults the model could not be marched over."""
        resolution = self._axis.sensor.position_resolution
        if self._axis.is_rotary:
            position, wraps, turn = unwrapped(position)
            self._count(f"wraps of the angle by {turn:.6g} rad undone", wraps)
        low, high = np.quantile(force, (0.01, 0.99))
        acceleration = 2.0 * float(high - low) / _lightest(self._axis)
        step = float(np.median(np.diff(t)))
        furthest = largest_step(t, position, resolution)
        quiet = 2.0 * resolution + 0.25 * float(furthest.max())
        stuck = frozen(position, max(quiet, 0.5 * acceleration * step**2))
        away, jumps = excursions_and_jumps(position, furthest)
        jumps = jumps[~stuck[np.maximum(jumps - 1, 0)]]
        away &= ~stuck
        position = _bridged(t, position, ~(away | stuck))
        position = _without_jumps(position, jumps)
        spikes, steps = spikes_and_steps(t, position, acceleration, resolution)
        spikes &= ~stuck
        jumps = np.union1d(jumps, steps)
        position = _bridged(t, position, ~(away | stuck | spikes))
        self._count("position outliers not used", int(np.count_nonzero(away | spikes)))
        self._count("positions of a frozen sensor not used", int(np.count_nonzero(stuck)))
        self._count("jumps of the position zero, new run begun", len(jumps))
        odd = unfelt(t, force, position, force_spikes(force), self._axis.mechanics.moving_mass)
        self._count("force spikes replaced by their neighbours", int(np.count_nonzero(odd)))
        force = _bridged(t, force, ~odd)
        dead = _dead_force(t, force, self._axis.drive.force_resolution)
        self._count("samples of a frozen force left out", int(np.count_nonzero(dead)))
        valid = ~(away | stuck | spikes)
        out = dead | _long_blind(t, valid)
        edges = sorted({0, len(t), *jumps.tolist(), *(np.flatnonzero(np.diff(out.astype(np.int8))) + 1).tolist()})
        return [
            piece for piece, a in zip(Piece(t, force, position, valid).cut(edges), edges, strict=False) if not out[a]
        ]

    def report(self) -> list[str]:
        """What was found, in words."""
        return [f"{what}: {count}" for what, count in self._counts.items()]

    def _count(self, what: str, count: int) -> None:
        if count:
            self._counts[what] = self._counts.get(what, 0) + count


def _lightest(axis: Axis) -> float:
    """What the drive may move alone before the sensor: a motor that runs free in a gap is a part of the mass. [kg]"""
    around = Surroundings.of(axis)
    share = around.motor_share if around.sensor_at_motor else None
    return axis.mechanics.moving_mass * (1.0 if share is None else share)


def _bridged(t: Floats, x: Floats, good: Bools) -> Floats:
    """The series with straight lines over what is not good."""
    if good.all() or not good.any():
        return x
    return np.where(good, x, np.interp(t, t[good], x[good]))


def _without_jumps(y: Floats, jumps: Ints) -> Floats:
    """The position with its zero moved back at each of the `jumps`; runs have starts of their own anyway. (n,)"""
    shift = np.zeros(len(y))
    shift[jumps] = y[jumps] - y[jumps - 1]
    return np.asarray(y - np.cumsum(shift), dtype=np.float64)


def _long_blind(t: Floats, valid: Bools) -> Bools:
    """Stretches without a valid position that last longer than `LONGEST_BLIND`, and those at the ends. (n,)"""
    out = np.zeros(len(t), dtype=np.bool_)
    for begin, end in groups(~valid):  # invalid in begin..end-1
        if begin == 0 or end == len(t) or t[end] - t[begin - 1] > LONGEST_BLIND:
            out[begin:end] = True
    return out


def _dead_force(t: Floats, force: Floats, resolution: float) -> Bools:
    """Stretches over which the force's reading froze; a drive that holds its levels on purpose is none. (n,)"""
    dead = frozen(force, largest_step(t, force, resolution))
    if dead.mean() > MOSTLY or repeats_elsewhere(force, dead) > RARE:
        return np.zeros(len(force), dtype=np.bool_)
    return dead
