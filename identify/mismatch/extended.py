"""The baseline model with effects as a problem: same unknowns first, then the effects', then the runs' starts.

Everything written for the baseline (polish, homotopy, uncertainty, short-run criterion) works on it unchanged.
"""

from __future__ import annotations

import itertools
import math
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identify.criterion import FREE
from identify.kernels.machine_predictor import predict_machine
from identify.kernels.transmission_gain import transmission_gains
from identify.mismatch.guise import Guise
from identify.preprocess import Samples
from identify.problem import FINEST_SUBSTEP, LONGEST_SUBSTEP, FrictionProblem, Scales
from identify.threads import side_by_side
from plant.axis import Axis
from plant.effects.effect import Surroundings
from plant.kernels.laws import LANES
from plant.kernels.machine import TWO_MASSES
from plant.machine import Blocks, Plan, drive_forces, for_lanes

Floats = NDArray[np.float64]

NOTHING: Floats = np.empty((0, 0))
CACHE_LINE = 8  # numbers
FEWEST, MOST = 2, 6  # sub-steps per sample, at most, where an effect asks for more than the baseline
FINE_ENOUGH = 0.0015  # s: a soft transmission of 4 Hz at 250 Hz is found as well with half the sub-steps


class ExtendedProblem(FrictionProblem):
    """Prediction errors of the baseline model plus the effects of `guises`."""

    def __init__(
        self,
        samples: Samples,
        axis: Axis,
        guises: tuple[Guise, ...] = (),
        *,
        middle: float | None = None,
        scales: Scales | None = None,
        first_state: Floats | None = None,
        most_substeps: int | None = None,
        longest_substep: float = LONGEST_SUBSTEP,
        known: tuple[Floats, Floats] | None = None,
    ) -> None:
        """Order the effects as their laws run.

        Args:
            samples: as for the baseline.
            axis: as for the baseline.
            guises: the effects.
            middle: of the travel of all recordings; None takes that of `samples`. [m]
            scales: as for the baseline.
            first_state: as for the baseline.
            most_substeps: per sample; one-step errors forgive steps that a free run would not. None: none shorter than
                FINE_ENOUGH, and no more than MOST.
            longest_substep: of the baseline. [s]
            known: centre and standard deviation of the baseline's unknowns from elsewhere. (base,) each
        """
        super().__init__(samples, axis, scales=scales, first_state=first_state, longest_substep=longest_substep)
        self.longest_substep = longest_substep
        self.base = self.p
        self._usual = self.substeps
        if most_substeps is None:
            most_substeps = max(FEWEST, min(MOST, math.ceil(samples.sample_time / FINE_ENOUGH)))
        self.most_substeps = most_substeps
        self.known = known
        self.guises = tuple(sorted(guises, key=lambda guise: (guise.effect.order, guise.name)))
        self.p = self.base + sum(guise.size for guise in self.guises)
        if middle is None:
            middle = 0.5 * float(samples.position.min() + samples.position.max())
        self.middle = middle
        self.plan = Plan(Surroundings.of(axis, middle), tuple(guise.effect for guise in self.guises))
        self._drive = self._drive_force()
        plain = FrictionProblem(samples, axis, scales=self.scales, first_state=first_state)
        self._plain = plain.bounds, plain.prior
        self._held: Floats = np.empty(0)

    def on(self, samples: Samples, first_state: Floats | None = None) -> ExtendedProblem:
        """The same model on other samples."""
        return self._other(samples=samples, first_state=first_state)

    def refined(self, longest_substep: float = FINEST_SUBSTEP) -> ExtendedProblem:
        """The same problem marched in other steps; those that effects ask for change in proportion."""
        finer = self._other()
        finer.substeps = max(1, int(np.ceil(self.samples.sample_time / longest_substep - 1e-9)))
        return finer

    def marched(self, most_substeps: int) -> ExtendedProblem:
        """The same problem with up to `most_substeps` a sample, where an effect asks for them."""
        return self._other(most_substeps=most_substeps)

    def stepping(self, longest_substep: float) -> ExtendedProblem:
        """The same problem, and whatever is made of it, with the baseline marched in steps of so long at most. [s]"""
        return self._other(longest_substep=longest_substep)

    def including(self, guises: tuple[Guise, ...]) -> ExtendedProblem:
        """The same data with other effects."""
        return self._other(guises=guises)

    def knowing(self, known: tuple[Floats, Floats] | None) -> ExtendedProblem:
        """The same with the baseline's unknowns known so well from elsewhere, or not."""
        return self._other(known=known)

    def _other(self, **changed: Any) -> ExtendedProblem:
        """The same problem but for what is `changed`."""
        same = {
            "samples": self.samples,
            "axis": self.axis,
            "guises": self.guises,
            "middle": self.middle,
            "scales": self.scales,
            "first_state": self.first_state,
            "most_substeps": self.most_substeps,
            "longest_substep": self.longest_substep,
            "known": self.known,
        }
        return type(self)(**{**same, **changed})

    def guise(self, name: str) -> Guise:
        """The effect called `name`."""
        return next(guise for guise in self.guises if guise.name == name)

    def slot(self, guise: Guise) -> slice:
        """Where the unknowns of `guise` stand in x."""
        at = self.base
        for other in self.guises:
            if other is guise:
                return slice(at, at + guise.size)
            at += other.size
        raise KeyError(guise.name)

    @cached_property
    def bounds(self) -> tuple[Floats, Floats]:
        """Lowest and highest scaled unknowns. (size,) each"""
        low, high = self._wide(self._plain[0][0]), self._wide(self._plain[0][1])
        for guise in self.guises:
            low[self.slot(guise)], high[self.slot(guise)] = guise.bounds()
        return low, high

    @cached_property
    def prior(self) -> tuple[Floats, Floats]:
        """Centre and standard deviation of the weak priors. (size,) each"""
        centre, spread = self._wide(self._plain[1][0]), self._wide(self._plain[1][1])
        for guise in self.guises:
            centre[self.slot(guise)] = 0.0
            spread[self.slot(guise)] = [unknown.spread for unknown in guise.unknowns]
        if self.known is not None:
            centre[: self.base], spread[: self.base] = self.known
        return centre, spread

    def _wide(self, x: Floats) -> Floats:
        """Room for the effects' unknowns between those of the baseline and the starts."""
        return np.concatenate([x[: self.base], np.zeros(self.p - self.base), x[self.base :]])

    def blocks(self, x: Floats) -> Blocks:
        """The machines of candidates x (m, >= p)."""
        s = self.scales
        law = self.law(x)
        friction = np.stack([law[0], law[0] + law[1], 1.0 / law[2], law[3]])
        rows = [guise.values(x[:, self.slot(guise)]) for guise in self.guises]
        values = np.concatenate(rows) if rows else np.empty((0, len(x)))
        constant = law[5] - self.axis.mechanics.weight
        with np.errstate(divide="ignore", over="ignore"):
            return self.plan.blocks(friction, values, mass=law[4], constant_force=constant, speed=s.speed)

    def errors(self, x: Floats, gain: Floats) -> Floats:
        """Prediction errors of candidates x (m, size) with gains (5,) or (5, m). (n, m) [m], a reused buffer."""
        return self.disturbed(x, gain)

    def free_runs(self, x: Floats, gain: Floats) -> Floats:
        """Errors of free runs of x (size,) from their given starts. [m] (n,)

        Where one run leads to the next, effects begin with what an observer of this `gain` (5,) makes of the data
        before it: how long the axis has rested, which flank a gap touches, how far a transmission is bent.
        """
        memory = self._memory(x, gain)
        return self.disturbed(x[None], FREE, memory=memory)[:, 0].copy()

    def _memory(self, x: Floats, gain: Floats) -> Floats | None:
        """What an observer knows at the start of each run; None where nothing is remembered. (runs, rows * LANES)"""
        blocks = self.blocks(x[None])
        if self.samples.runs == 1 or not (blocks.remembers or any(guise.effect.initial for guise in self.guises)):
            return None
        memory = np.zeros((self.samples.runs, blocks.b.shape[1]))
        self.disturbed(x[None], gain, memory=memory, goes_on=True)
        return memory

    def disturbed(
        self,
        x: Floats,
        gain: Floats,
        push: Floats | None = None,
        shift: Floats | None = None,
        memory: Floats | None = None,
        goes_on: bool = False,
    ) -> Floats:
        """Errors with a force `push` on top of the drive's, held over each sample, and a sensor that errs by `shift`.

        Args:
            x: candidates. (m, size)
            gain: of the observer. (5,) or (5, m)
            push: on top of the drive's force. [N] (n, m)
            shift: on top of the measured position; what is known of the starts stays. [m] (n, m)
            memory: of one candidate, what its runs begin with, or room for it where it `goes_on`. (runs, rows * LANES)
            goes_on: whether a run that another leads to is none, but fills `memory`.

        Returns:
            prediction errors. [m] (n, m), a reused buffer
        """
        m = len(x)
        blocks = self.blocks(x)
        count = len(blocks.b)
        padded = count * LANES
        fill = np.minimum(np.arange(padded), m - 1)
        start = np.ascontiguousarray(self.start(x)[:, fill])
        gains = gain[:, fill] if gain.ndim == 2 else np.repeat(gain[:, None], padded, axis=1)
        s = self.samples
        if self._held.size < len(s) * padded:
            self._held = np.empty(len(s) * padded)
        error = self._held[: len(s) * padded].reshape(len(s), padded)
        substeps = self.steps_of(blocks)

        def march(i: int) -> None:
            lanes = slice(i * LANES, (i + 1) * LANES)
            corrects = np.ascontiguousarray(gains[:, lanes])
            if blocks.structure & TWO_MASSES:
                machines = min(m - i * LANES, LANES)
                corrects = transmission_gains(blocks.b[i], corrects, blocks.observed, s.sample_time, machines)
            drive = self.drive(blocks.delay[fill[lanes]])
            if push is not None:
                drive = _on_top(drive, push[:, fill[lanes]])
            position = s.position[:, None]
            if shift is not None:
                position = np.ascontiguousarray(position + shift[:, fill[lanes]])
            predict_machine(
                blocks.b[i],
                blocks.laws,
                for_lanes(blocks.structure, m - i * LANES),
                drive,
                position,
                s.t,
                s.steps,
                s.run,
                s.valid,
                substeps,
                blocks.observed,
                np.ascontiguousarray(start[:, lanes]),
                corrects,
                NOTHING if memory is None else memory,
                goes_on,
                _aligned(blocks.b.shape[1] + LANES),
                error,
                i * LANES,
            )

        for _ in side_by_side(march, range(count)):
            pass
        return error[:, :m]

    def steps_of(self, blocks: Blocks) -> int:
        """Sub-steps per sample: what effects ask for, within reason; eq. (1) is marched as the baseline marches it."""
        asked = min(blocks.substeps_for_effects(self.samples.sample_time), self.most_substeps)
        return max(self.substeps, math.ceil(asked * self.substeps / self._usual))

    def _drive_force(self) -> Floats:
        """Drive force just after each sample and just before the next. [N] (n, 2, 1)"""
        return np.ascontiguousarray(np.stack(self.samples.ends, axis=1)[:, :, None])

    def drive(self, delay: Floats) -> Floats:
        """Drive force for the dead time of each lane [s], exactly. [N] (n, 2, 1) or (n, 5, lanes) where it is late."""
        if not delay.any():
            return self._drive
        s = self.samples
        late = np.empty((len(s), 5, len(delay)))
        anew = np.flatnonzero(np.diff(s.t) <= 0.0) + 1  # another recording; a new run remembers what was under way
        for a, b in itertools.pairwise([0, *anew.tolist(), len(s)]):
            start, end = self._drive[a : b - 1, 0, 0], self._drive[a : b - 1, 1, 0]
            if b - a > 1:
                late[a : b - 1] = drive_forces(s.t[a:b], start, end, delay)
            late[b - 1] = late[b - 2] if b - a > 1 else self._drive[b - 1, [0, 1, 1, 0, 1]]
        return late


def _aligned(size: int) -> Floats:
    """Room for `size` numbers that begins where a cache line does: rows that straddle two cost a tenth more."""
    room = np.empty(size + CACHE_LINE)
    begin = -(room.ctypes.data // room.itemsize) % CACHE_LINE
    return room[begin : begin + size]


def _on_top(drive: Floats, push: Floats) -> Floats:
    """Drive force with `push` (n, lanes) [N] added, held over each sample."""
    more = np.repeat(drive, push.shape[1], axis=2) if drive.shape[2] == 1 else drive.copy()
    more[:, [0, 1, 3, 4][: 4 if drive.shape[1] == 5 else 2]] += push[:, None]
    return more
