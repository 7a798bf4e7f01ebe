"""One model in two states: commissioning and today share every unknown that is not said to have changed.

Unknowns: those of today's model, then a difference (commissioning minus today, scaled) for each one that is released,
then the starts of all runs, commissioning first. Polish, homotopy and uncertainty work on it as on any problem.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from identify.mismatch.data import join
from identify.mismatch.extended import ExtendedProblem
from identify.preprocess import Samples

Floats = NDArray[np.float64]

SPREAD = 3.0  # of a scaled difference: a prior that hardly binds


class CoupledProblem(ExtendedProblem):
    """Prediction errors of both states."""

    def __init__(self, model: ExtendedProblem, before: Samples, today: Samples, released: tuple[int, ...]) -> None:
        """Couple `model` over the samples of both states; `released` unknowns may differ."""
        super().__init__(
            join([before, today]),
            model.axis,
            model.guises,
            middle=model.middle,
            scales=model.scales,
            most_substeps=model.most_substeps,
        )
        self.states = model.on(before), model.on(today)
        self.shared = self.p
        self.released = released
        self.p += len(released)
        for name in ("bounds", "prior"):
            self.__dict__.pop(name, None)
        low, high = (np.concatenate([self.states[1].bounds[side][: self.shared], edge]) for side, edge in self._room())
        starts = np.full(2 * self.samples.runs, 5.0)
        self.bounds = np.concatenate([low, -starts]), np.concatenate([high, starts])
        centre, spread = (part[: self.shared] for part in self.states[1].prior)
        count = len(released)
        ones = np.ones(2 * self.samples.runs)
        self.prior = (
            np.concatenate([centre, np.zeros(count), 0.0 * ones]),
            np.concatenate([spread, np.full(count, SPREAD), ones]),
        )
        self._error: Floats = np.empty((0, 0))

    def _room(self) -> list[tuple[int, Floats]]:
        """How far the differences may go: as far as the bounds are apart."""
        low, high = (side[list(self.released)] for side in self.states[1].bounds)
        return [(0, low - high), (1, high - low)]

    def releasing(self, released: tuple[int, ...]) -> CoupledProblem:
        """The same states with other unknowns released."""
        return CoupledProblem(self.states[1], self.states[0].samples, self.states[1].samples, released)

    def refined(self, longest_substep: float = 0.001) -> CoupledProblem:
        """The same problem marched in finer steps."""
        finer = self.releasing(self.released)
        finer.states = self.states[0].refined(longest_substep), self.states[1].refined(longest_substep)
        finer.substeps = finer.states[0].substeps
        return finer

    def masked(self, samples: Samples) -> CoupledProblem:
        """This very problem, steps and first states included, on other values of the same samples."""
        n = len(self.states[0].samples)
        before, today = samples.part(0, n), samples.part(n, len(samples))
        other = CoupledProblem(self.states[1], before, today, self.released)
        then, now = (
            state.on(part, state.first_state).refined(part.sample_time / state.substeps)
            for state, part in zip(self.states, (before, today), strict=True)
        )
        other.states = then, now
        other.substeps = self.substeps
        return other

    def split(self, x: Floats) -> tuple[Floats, Floats]:
        """Unknowns of both states for candidates x (m, size)."""
        runs = self.states[0].samples.runs
        today = np.concatenate([x[:, : self.shared], x[:, self.p + 2 * runs :]], axis=1)
        then = x[:, : self.shared].copy()
        then[:, list(self.released)] += x[:, self.shared : self.p]
        low, high = (side[: self.shared] for side in self.states[0].bounds)
        then = np.clip(then, low, high)
        return np.concatenate([then, x[:, self.p : self.p + 2 * runs]], axis=1), today

    def errors(self, x: Floats, gain: Floats) -> Floats:
        """Prediction errors of candidates x (m, size), commissioning first. (n, m) [m], a reused buffer."""
        n = len(self.states[0].samples)
        if self._error.shape != (len(self.samples), len(x)):
            self._error = np.empty((len(self.samples), len(x)))
        for part, problem, own in zip((slice(0, n), slice(n, None)), self.states, self.split(x), strict=True):
            self._error[part] = problem.errors(own, gain)
        return self._error

    def carried(self, x: Floats, other: CoupledProblem) -> Floats:
        """Unknowns of `other`, which released others, at x (size,) of this problem."""
        y = np.zeros(other.size)
        y[: self.shared] = x[: self.shared]
        known = dict(zip(self.released, x[self.shared : self.p], strict=True))
        y[self.shared : other.p] = [known.get(index, 0.0) for index in other.released]
        y[other.p :] = x[self.p :]
        return y


def coupled(model: ExtendedProblem, x: Floats, before: Samples, today: Samples) -> tuple[CoupledProblem, Floats]:
    """Both states with nothing released, and its unknowns at x (>= p,) of `model`."""
    problem = CoupledProblem(model.knowing(None), before, today, ())
    return problem, np.concatenate([x[: model.p], np.zeros(2 * problem.samples.runs)])
