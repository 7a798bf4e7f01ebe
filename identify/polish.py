"""Local polish: Levenberg-Marquardt on the prediction errors, within bounds, many points at once.

One run of the predictor carries every point's trial step *and* its derivatives in its lanes: sixteen lanes cost what
one does, so an iteration is one run where a textbook needs two, and two points cost what one does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.kernels.gram import gram
from identify.problem import DIFFERENCE, FrictionProblem

Floats = NDArray[np.float64]

DAMPING = 1e-3  # of the normal matrix' diagonal, to begin with
RELAX, STIFFEN = 0.1, 10.0  # of the damping after a step that gained what the model promised, and after one that lost
UNSEEN = 0.25  # of what an iteration must gain: a step that promises less is not even tried
SMALL_GAIN = 1e-2  # of the loss (a log-likelihood, so an absolute number): less is not worth an iteration


@dataclass(frozen=True, slots=True, eq=False)
class Polished:
    """Where the polish of one point ended: x (size,), its loss, and how many candidate runs it cost."""

    x: Floats
    loss: float
    evaluations: int


@dataclass(frozen=True, slots=True, eq=False)
class Linearised:
    """Loss of k points, and its quadratic model: x (k, size), loss (k,), normal (k, size, size), downhill (k, size)."""

    x: Floats
    loss: Floats
    normal: Floats
    downhill: Floats

    def take(self, index: NDArray[np.int64] | NDArray[np.bool_]) -> Linearised:
        """The points of `index`."""
        return Linearised(self.x[index], self.loss[index], self.normal[index], self.downhill[index])

    def promise(self, x: Floats) -> Floats:
        """What the model says the loss gains on the way to x (k, size). (k,)"""
        step = x - self.x
        bend = np.einsum("ki,kij,kj->k", step, self.normal, step)
        return np.asarray(2.0 * np.einsum("ki,ki->k", step, self.downhill) - bend, dtype=np.float64)

    def put(self, index: NDArray[np.int64], other: Linearised) -> None:
        """Replace the points of `index`."""
        self.x[index], self.loss[index] = other.x, other.loss
        self.normal[index], self.downhill[index] = other.normal, other.downhill


@dataclass(frozen=True, slots=True, eq=False)
class Ends:
    """Where k points ended: x (k, size), loss (k,), whether each came to rest (k,), and candidate runs spent."""

    x: Floats
    loss: Floats
    rested: NDArray[np.bool_]
    evaluations: int

    @property
    def best(self) -> int:
        """Index of the point with the lowest loss."""
        return int(np.argmin(self.loss))


def polish(
    problem: FrictionProblem, x: Floats, gain: Floats, iterations: int = 30, enough: float = SMALL_GAIN
) -> Polished:
    """Descend from x (size,) until an iteration gains `enough` or less; never ends higher than it began."""
    ends = polish_all(problem, x[None], gain, iterations, enough)
    return Polished(ends.x[0], float(ends.loss[0]), ends.evaluations)


def polish_all(
    problem: FrictionProblem,
    x: Floats,
    gain: Floats,
    iterations: int = 30,
    enough: float = SMALL_GAIN,
    *,
    race: bool = False,
    pinned: int | slice | None = None,
) -> Ends:
    """Descend from each of the points x (k, size) at gains (5,) or (5, k), side by side.

    A point rests when an iteration gains, or a failed one promised, `enough` or less. In a `race` all stop as soon as
    the best one rests. Unknowns `pinned` stay what they are at each point.
    """
    gains = gain if gain.ndim == 2 else np.repeat(gain[:, None], len(x), axis=1)
    now = linearise(problem, np.clip(x, *problem.bounds), gains)
    evaluations = len(x) * (problem.p + 3)
    damping, failed = np.full(len(x), DAMPING), np.zeros(len(x), dtype=bool)
    active = np.isfinite(now.loss)
    for _ in range(iterations):
        at = np.flatnonzero(active)
        if not len(at) or (race and not active[np.argmin(now.loss)]):
            break
        here = now.take(at)
        x = _step(problem, here, damping[at], pinned)
        promised = here.promise(x)
        trying = promised > UNSEEN * enough
        if not trying.all():
            active[at[~trying]] = False
            at, here, x, promised = at[trying], here.take(trying), x[trying], promised[trying]
            if not len(at) or race:
                continue
        ahead = linearise(problem, x, gains[:, at])
        evaluations += len(at) * (problem.p + 3)
        gained = here.loss - ahead.loss
        better = gained > 0
        now.put(at[better], ahead.take(better))
        relax = (gained > 0.5 * promised) & ~failed[at]  # not at once after a failure: it would fail again
        damping[at] *= np.where(better, np.where(relax, RELAX, 1.0), STIFFEN)
        failed[at] = ~better
        active[at] = np.where(better, gained, promised) > enough
    return Ends(now.x, now.loss, ~active, evaluations)


def linearise(problem: FrictionProblem, x: Floats, gains: Floats) -> Linearised:
    """Losses of the points x (k, size) at gains (5, k) and their Gauss-Newton models, from forward differences.

    The starts of all runs are moved together: a run's errors depend on its own start alone.
    """
    k, p = len(x), problem.p
    lanes = p + 3
    sign = np.where(x[:, :p] + DIFFERENCE > problem.bounds[1][:p], -1.0, 1.0)
    candidates = np.repeat(x[:, None], lanes, axis=1)
    index = np.arange(p)
    candidates[:, 1 + index, index] += sign * DIFFERENCE
    candidates[:, p + 1, p::2] += DIFFERENCE
    candidates[:, p + 2, p + 1 :: 2] += DIFFERENCE
    with np.errstate(all="ignore"):
        error = problem.errors(candidates.reshape(k * lanes, -1), np.repeat(gains, lanes, axis=1))
        square, normal, downhill = _normal_equations(problem, error, sign)
        used = problem.samples.used
        variance = square / used + 1e-300
        centre, spread = problem.prior
        pull = 1.0 / spread**2
        loss = used * np.log(variance) + problem.prior_loss(x)
        normal /= variance[:, None, None]
        normal[:, np.arange(len(pull)), np.arange(len(pull))] += pull
        downhill = downhill / variance[:, None] - (x - centre) * pull
        whole = normal.sum(axis=(1, 2)) + downhill.sum(axis=1)  # a single infinity or nan spoils it
    usable = np.isfinite(loss) & np.isfinite(whole)
    return Linearised(x, np.where(usable, loss, np.inf), normal, downhill)


def scatter(normal: Floats) -> Floats:
    """Lower triangular root of the covariance that belongs to a normal matrix. (n, n)

    What the data do not tell at all does not scatter. The root is that of Cholesky, which rounding can refuse.
    """
    value, vector = np.linalg.eigh(normal)
    told = value > len(value) * np.finfo(np.float64).eps * float(np.abs(value).max())
    upper = np.linalg.qr((vector[:, told] / np.sqrt(value[told])).T).R
    root = np.zeros_like(normal)
    root[:, : len(upper)] = (upper * np.where(np.diag(upper) < 0.0, -1.0, 1.0)[:, None]).T
    return root


def _normal_equations(problem: FrictionProblem, error: Floats, sign: Floats) -> tuple[Floats, Floats, Floats]:
    """Sums of squares (k,), J'J (k, size, size) and -J'e (k, size) from the errors of k points and of their lanes."""
    k, p, size, lanes = len(sign), problem.p, problem.size, problem.p + 3
    runs = problem.samples.runs
    products = np.empty((runs, k, lanes, lanes))
    gram(error, problem.samples.edges, lanes, products)
    scale = np.concatenate([np.ones((k, 1)), sign / DIFFERENCE, np.full((k, 2), 1.0 / DIFFERENCE)], axis=1)
    products *= scale[:, :, None] * scale[:, None, :]
    if runs == 1:
        return products[0, :, 0, 0], products[0, :, 1:, 1:], -products[0, :, 0, 1:]
    normal, downhill = np.zeros((k, size, size)), np.zeros((k, size))
    shared = products.sum(axis=0)
    normal[:, :p, :p], downhill[:, :p] = shared[:, 1 : p + 1, 1 : p + 1], -shared[:, 0, 1 : p + 1]
    for run, part in enumerate(products):
        own = slice(p + 2 * run, p + 2 * run + 2)
        normal[:, :p, own], normal[:, own, :p] = part[:, 1 : p + 1, p + 1 :], part[:, p + 1 :, 1 : p + 1]
        normal[:, own, own], downhill[:, own] = part[:, p + 1 :, p + 1 :], -part[:, 0, p + 1 :]
    return shared[:, 0, 0], normal, downhill


def _step(problem: FrictionProblem, now: Linearised, damping: Floats, pinned: int | slice | None) -> Floats:
    """Where a damped Gauss-Newton step ends, within bounds. (k, size)

    Unknowns that a bound holds back stay where they are. What would pass one stops there, first come, first held, and
    the others go on to where it is best then: every part of the way goes downhill. (A step that is cut off afterwards
    may promise less than nothing, and a polish that has hardly begun rests.)
    """
    low, high = problem.bounds
    free = ~(((now.x <= low) & (now.downhill < 0)) | ((now.x >= high) & (now.downhill > 0)))
    if pinned is not None:
        free[:, pinned] = False
    normal, index = now.normal.copy(), np.arange(problem.size)
    normal[:, index, index] *= 1.0 + damping[:, None]
    x, rows = now.x, np.arange(len(now.x))
    for _ in range(problem.size):
        way = _solved(normal, now.downhill, free, x - now.x) + now.x - x
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            reach = np.where(way != 0.0, (np.where(way < 0.0, low, high) - x) / way, np.inf)
        first = reach.argmin(axis=1)
        x = np.clip(x + np.minimum(reach[rows, first], 1.0)[:, None] * way, low, high)
        passed = reach[rows, first] < 1.0
        if not passed.any():
            break
        free[rows[passed], first[passed]] = False
    return x


def _solved(normal: Floats, downhill: Floats, free: NDArray[np.bool_], steps: Floats) -> Floats:
    """The `steps` (k, size): those that are `free` (k, size) as the normal equations have them, the others as given."""
    held, index = np.where(free, 0.0, steps), np.arange(normal.shape[1])
    system = np.where(free[:, :, None] & free[:, None, :], normal, 0.0)
    system[:, index, index] = np.where(free, normal[:, index, index], 1.0)
    wanted = downhill - np.einsum("kij,kj->ki", normal, held)
    return np.asarray(np.linalg.solve(system, np.where(free, wanted, held)[..., None])[..., 0], dtype=np.float64)
