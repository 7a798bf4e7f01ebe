"""Is one model better than another? Likelihood, block-robust evidence, free runs, size: each can say no.

Thresholds were set in a feasibility study on other machines, and are frozen.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from identify.criterion import RUN_LENGTH, noise_level, relative_square, restarted
from identify.judge import median_speed
from identify.latent import latent_force
from identify.mismatch.clock import APART
from identify.mismatch.extended import ExtendedProblem
from identify.mismatch.guise import Guise
from identify.observer import gain_table
from identify.polish import polish_all
from identify.preprocess import Samples
from identify.search import ROUGH, ROUNDS, SearchResult, homotopy
from identify.uncertainty import Uncertainty, uncertainty

Floats = NDArray[np.float64]

SEED = 0  # of the polish's kicks
GROWN = 5.0  # times e: so much may an error grow in a free run that judges
SHORTEST = 0.2  # s, of such a run
WORST = 0.2  # share of the free runs that count no more than the least of them
REACH = 5  # samples to each side from which a restart's velocity is taken to be known
MOVES = 0.02  # of the travel within a second: less is a rest
BLOCKS = 20  # pieces of the recording whose evidence must agree
TAIL = 4.0  # degrees of freedom of prediction errors on unseen data
PASSES = 20  # to their variance
STRONG, DOUBTED = -60.0, 60.0  # evidence that is worth asking what friction was in unseen data, where theirs is less
EXCESSIVE = 3.0  # times the evidence per sample of the fitted data: so much more is friction that was not known yet
EVEN = 2.5  # z of the blocks of the fitted data: what they agree on less is told by unseen data, whatever friction was
SETTLING = 10  # iterations
ONCE = ("step_change", "thermal_drift")  # happen in time: after them, friction is another
FAVOURABLE = 2  # of them that an effect must be able to do without


@dataclass(frozen=True, slots=True, eq=False)
class FreeRuns:
    """Samples `cut` into runs, the `states` those start from (runs, 2), and the `error` of a model there [m] (n,)."""

    cut: Samples
    states: Floats
    error: Floats


@dataclass(frozen=True, eq=False)
class Fit:
    """A fitted model.

    Attributes:
        problem: model and data.
        found: where its search ended.
    """

    problem: ExtendedProblem
    found: SearchResult
    _runs: dict[tuple[int, float], tuple[Samples, FreeRuns]] = field(default_factory=dict, init=False, repr=False)

    @property
    def x(self) -> Floats:
        """Unknowns. (size,)"""
        return self.found.x

    @property
    def names(self) -> tuple[str, ...]:
        """Its effects."""
        return tuple(guise.name for guise in self.problem.guises)

    @cached_property
    def latent_force(self) -> float:
        """Force the observer supplies where the model has none: rho sigma m_e. [N]."""
        return latent_force(self.problem, self.x, self.found.gain)

    @cached_property
    def spread(self) -> Uncertainty:
        """Uncertainty of all unknowns."""
        clock = next((guise for guise in self.problem.guises if guise.name == APART.name), None)
        if clock is not None and not self.x[self.problem.slot(clock)].any():
            return self._spread_about(clock)
        spread = uncertainty(self.problem, self.x, self.found.gain)
        if clock is None:
            return spread
        index = self.problem.slot(clock).start  # a weaker observer shifts it by more than clocks are apart
        return spread.known(index, float(self.problem.prior[1][index]))

    def _spread_about(self, clock: Guise) -> Uncertainty:
        """The same where the clocks agree: data that do not tell them apart add nothing to how well they are known."""
        problem, index = self.problem, self.problem.slot(clock).start
        known = trimmed(self, tuple(guise for guise in problem.guises if guise is not clock)).spread
        others = np.delete(np.arange(problem.size), index)
        error, slope = problem.jacobian(self.x, self.found.gain)
        doubt = problem.prior[1]
        free = others[~known.at_bound]
        variance = float(error @ error) / problem.samples.used + 1e-300
        normal = slope[:, free].T @ slope[:, free] / variance + np.diag(1.0 / doubt[free] ** 2)
        moved = np.zeros(problem.size)  # by clocks that are apart by a standard deviation
        moved[free] = -np.linalg.solve(normal, slope[:, free].T @ slope[:, index]) / variance * doubt[index]
        moved[index] = doubt[index]
        covariance = np.outer(moved, moved)
        covariance[np.ix_(others, others)] += known.covariance
        return Uncertainty(covariance, np.insert(known.at_bound, index, values=False), known.inflation)

    def on(self, samples: Samples, first_state: Floats | None = None) -> Fit:
        """The same model and unknowns on other samples, from their measured starts or from a state each. (runs, 2)"""
        problem = self.problem.on(samples, first_state)
        x = np.concatenate([self.x[: problem.p], np.zeros(2 * samples.runs)])
        return Fit(problem, replace(self.found, x=x))

    def terms(self) -> Floats:
        """Log-likelihood of each sample; do not write into it. (n,)"""
        return self._terms

    @cached_property
    def _terms(self) -> Floats:
        error = self.problem.errors(self.x[None], self.found.gain)[:, 0]
        variance = float(np.mean(error**2)) + 1e-300
        return np.asarray(-0.5 * (error**2 / variance + np.log(variance)), dtype=np.float64)

    @cached_property
    def dry_level(self) -> float:
        """Dry friction at the usual speed; F_c alone says little where the Stribeck part stands in for it. [N]."""
        problem = self.problem
        usual, _ = median_speed(problem.samples)
        coulomb, more, inverse = problem.law(self.x[None])[:3, 0]
        return max(float(coulomb + more * np.exp(-usual * inverse)), 0.1 * problem.scales.force)

    def short_run(self) -> float:
        """Eq. (4) over one-second free runs. [1]."""
        samples = self.problem.samples
        return relative_square(self.free_runs(samples, RUN_LENGTH).error, samples.position)

    def free_runs(self, samples: Samples, run_length: float) -> FreeRuns:
        """Free runs of `run_length` [s] over `samples`; kept, for a model is compared with many."""
        key = id(samples), run_length
        if key not in self._runs:
            cut, states = restarted(samples, run_length)
            self._runs[key] = samples, FreeRuns(cut, states, free_errors(self, cut, states))  # ids of kept samples stay
        return self._runs[key][1]


def fit(problem: ExtendedProblem, points: Floats, rounds: int = ROUNDS) -> Fit:
    """Polish points (k, size) under the gain homotopy of so many `rounds` at most; the likeliest end."""
    gains, settings = gain_table(problem.samples.sample_time)
    return Fit(problem, homotopy(problem, points, gains, settings, np.random.default_rng(SEED), rounds))


def trimmed(fitted: Fit, kept: tuple[Guise, ...]) -> Fit:
    """`fitted` with only the effects `kept`, not refitted."""
    problem = fitted.problem.including(kept)
    parts = [fitted.x[: problem.base], *(fitted.x[fitted.problem.slot(guise)] for guise in problem.guises)]
    x = np.concatenate([*parts, fitted.x[fitted.problem.p :]])
    return Fit(problem, replace(fitted.found, x=x))


@dataclass(frozen=True, slots=True)
class Comparison:
    """What speaks for the richer of two models.

    Attributes:
        bic: change of the Bayes information criterion; negative favours the richer one. [1]
        z: mean over standard error of the evidence per block. [1]
        steady: change of the information criterion without the most favourable blocks. [1]
        free_run: ratio of eq. (4) over one-second free runs, richer over poorer. [1]
        unseen: the same on data that neither has seen. [1]
        foreseen: evidence of those data, sample by sample: twice the log of how much likelier the richer model makes
            them. [1]
        foreseen_z: mean over standard error of that per block. [1]
        support: the same per unseen sample over the evidence per fitted one. [1]
        again: evidence of unseen data without the most favourable blocks. [1]
        lacking: ratio of the latent forces, richer over poorer. [1]
        second: as `unseen`, over runs of a second, even where shorter ones tell more. [1]
        parting: the least evidence of unseen data from any moment on to their end, with friction as it was fitted. [1]
        parts: that moment. [s]
    """

    bic: float
    z: float
    steady: float
    free_run: float
    unseen: float
    foreseen: float = 0.0
    foreseen_z: float = 0.0
    support: float = 1.0
    again: float = 0.0
    lacking: float = 1.0
    second: float = 0.0
    parting: float = 0.0
    parts: float = 0.0


def compare(poorer: Fit, richer: Fit, unseen: Samples) -> Comparison:
    """Weigh `richer` against `poorer` on the same samples, and on `unseen` ones."""
    gained = richer.terms() - poorer.terms()
    extra = richer.problem.p - poorer.problem.p
    price = extra * float(np.log(richer.problem.samples.used))
    sums = block_sums(gained)
    steady = price - 2.0 * without_best(sums)
    both = [
        (free_run_ratio(poorer, richer, None, length), free_run_ratio(poorer, richer, unseen, length))
        for length in run_lengths(poorer)
    ]
    runs = min(both, key=math.prod)
    gains = np.stack([poorer.found.gain, richer.found.gain], axis=1)
    foreseen = _likelihood(richer, unseen, gains) - _likelihood(poorer, unseen, gains)
    bic = price - 2.0 * float(sums.sum())
    more = 2.0 * float(foreseen.sum())
    endings = 2.0 * np.cumsum(foreseen[::-1])[::-1]
    least = int(np.argmin(endings))
    parting = float(endings[least]), float(unseen.t[least])
    z = block_z(gained)
    denied = max(bic, steady) < STRONG and more < DOUBTED
    lasts = not any(guise.name in ONCE or guise.depends == "time" for guise in richer.problem.guises)
    alone = lasts and more > DOUBTED and (z < EVEN or _support(more, unseen, gained, bic) > EXCESSIVE)
    if denied or alone:
        one, other = settled(poorer, unseen, richer), settled(richer, unseen, poorer)
        foreseen = _likelihood(other, unseen, gains) - _likelihood(one, unseen, gains)
        runs = runs[0], fairest_ratio(one, other, unseen)
        more = 2.0 * float(foreseen.sum())
    support = _support(more, unseen, gained, bic)
    again = 2.0 * without_best(block_sums(foreseen))
    lacking = richer.latent_force / max(poorer.latent_force, 1e-300)
    return Comparison(bic, z, steady, *runs, more, block_z(foreseen), support, again, lacking, both[0][1], *parting)


def _support(more: float, unseen: Samples, gained: Floats, bic: float) -> float:
    """Evidence of unseen data per sample over that of the fitted ones. [1]"""
    return more / len(unseen) * len(gained) / max(-bic, 1.0)


def settled(fitted: Fit, samples: Samples, rival: Fit) -> Fit:
    """`fitted` on other samples, with friction as it was then: effects stay as they are, but friction changes.

    What an effect is may be told from what friction was meanwhile; that of another day, at other speeds, is another
    friction, and no reason against the effect, nor for it. Its friction begins at its own and at that of its `rival`.
    """
    there = fitted.on(samples)
    problem = there.problem
    effects = slice(problem.base, problem.p)
    points = np.stack([there.x, there.x])
    points[1, : problem.base] = rival.x[: problem.base]
    ends = polish_all(problem, points, fitted.found.gain, SETTLING, ROUGH, pinned=effects)
    return Fit(problem, replace(there.found, x=ends.x[ends.best], criterion=float(ends.loss[ends.best])))


def without_best(sums: Floats) -> float:
    """All of `sums` (BLOCKS,) but the most favourable."""
    return float(np.sort(sums)[: BLOCKS - FAVOURABLE].sum())


def _likelihood(fitted: Fit, samples: Samples, gains: Floats) -> Floats:
    """Log-likelihood of other samples, each predicted from those before it, at the likelier of gains (5, k). (n,)

    Errors are taken to follow Student's t: an event that no model knows of is no reason to prefer one.
    """
    there = fitted.on(samples)
    with np.errstate(all="ignore"):
        square = there.problem.errors(np.repeat(there.x[None], gains.shape[1], axis=0), gains) ** 2
        variance = np.median(square, axis=0) + 1e-300
        for _ in range(PASSES):  # expectation-maximisation (Lange, Little & Taylor 1989)
            variance = np.mean((TAIL + 1.0) * square / (TAIL + square / variance), axis=0) + 1e-300
        terms = -0.5 * ((TAIL + 1.0) * np.log1p(square / (TAIL * variance)) + np.log(variance))
    return np.asarray(terms[:, int(np.argmax(np.nan_to_num(terms.sum(axis=0), nan=-np.inf)))], dtype=np.float64)


def fairest_ratio(poorer: Fit, richer: Fit, samples: Samples) -> float:
    """Squared errors of free runs on `samples`, richer over poorer, at the more telling of their lengths. [1]."""
    return min(free_run_ratio(poorer, richer, samples, length) for length in run_lengths(poorer))


def free_run_ratio(poorer: Fit, richer: Fit, samples: Samples | None = None, run_length: float = RUN_LENGTH) -> float:
    """Squared errors of free runs of `run_length` [s], richer over poorer; on `samples`, or on those of the fit. [1].

    A few runs that begin in a rest and break away too early or too late would decide a plain sum; each run counts at
    most as much as one of the worst fifth of those in which the axis moves. What the noise of the restarts' position
    and velocity may do to a run counts for nothing.
    """
    if samples is None:
        samples = poorer.problem.samples
    runs = poorer.free_runs(samples, run_length)
    cut = runs.cut
    errors = [runs.error, free_errors(richer, cut, runs.states)]
    size = float(np.mean(errors[0] ** 2))
    doubt = min(noise_level(samples.position) ** 2 / max(size, 1e-300), 1.0)
    squares = [_forgiven(error, cut, doubt) for error in errors]
    moving = _moving(cut, float(np.ptp(samples.position)))
    worse = np.maximum(*squares)[moving]
    most = float(np.quantile(worse, 1.0 - WORST)) if len(worse) else np.inf
    before, after = (float(np.minimum(each, most).sum()) for each in squares)
    return after / max(before, 1e-300)


def brief_ratio(poorer: Fit, richer: Fit, samples: Samples) -> float:
    """Squared errors of the shortest free runs that judge, on `samples`, richer over poorer, each run as it is. [1].

    What acts for moments, a limit that is seldom reached, is in few runs, and drowns in how late long ones break away.
    """
    runs = poorer.free_runs(samples, SHORTEST)
    after = free_errors(richer, runs.cut, runs.states)
    return float(after @ after) / max(float(runs.error @ runs.error), 1e-300)


def run_lengths(one: Fit) -> tuple[float, ...]:
    """Lengths of free runs that judge a model: a second, and a shorter one where errors grow by themselves. [s]

    Below the Stribeck velocity friction falls with speed, and a small error grows: exponentially on a light machine.
    """
    law = one.problem.law(one.x[None])[:, 0]
    growth = float((law[1] * law[2] - law[3]) / law[4])  # [1/s] of a speed near zero
    shorter = max(GROWN / max(growth, 1e-9), SHORTEST)
    return (RUN_LENGTH, shorter) if shorter < RUN_LENGTH else (RUN_LENGTH,)


def free_errors(one: Fit, cut: Samples, states: Floats) -> Floats:
    """Errors of free runs from given states. [m] (n,)"""
    there = one.on(cut, states)
    return there.problem.free_runs(there.x, one.found.gain)


def _forgiven(error: Floats, cut: Samples, doubt: float) -> Floats:
    """Squares of each run's errors past an offset and a slope, as far as noise may have put them there. [m²] (runs,)

    Args:
        error: of all samples. [m] (n,)
        cut: samples in one-second runs.
        doubt: variance of the position's noise over that of the errors. [1]
    """
    since = cut.t - cut.t[cut.first][cut.run]
    count, t, tt = (np.add.reduceat(part, cut.first) for part in (np.ones_like(since), since, since**2))
    square, level, slope = (np.add.reduceat(part, cut.first) for part in (error**2, error, since * error))
    step = cut.sample_time
    prior = np.array([2 * REACH + 1, step**2 * REACH * (REACH + 1) * (2 * REACH + 1) / 3.0]) / max(doubt, 1e-12)
    a, d = count + prior[0], tt + prior[1]
    taken = (d * level**2 - 2.0 * t * level * slope + a * slope**2) / (a * d - t**2)
    return np.asarray(np.maximum(square - taken, 0.0), dtype=np.float64)


def _moving(cut: Samples, travel: float) -> NDArray[np.bool_]:
    """Whether the axis moves in each one-second run. (runs,)"""
    reach = np.maximum.reduceat(cut.position, cut.first) - np.minimum.reduceat(cut.position, cut.first)
    return np.asarray(reach > MOVES * travel)


def block_sums(gained: Floats) -> Floats:
    """Sums of `gained` (n,) over blocks of equal length. (BLOCKS,)"""
    edges = np.linspace(0, len(gained), BLOCKS + 1).astype(np.int64)[:-1]
    return np.asarray(np.add.reduceat(gained, edges), dtype=np.float64)


def block_z(gained: Floats) -> float:
    """Mean over standard error of `gained` (n,) over blocks: evidence that comes from one place counts little."""
    sums = block_sums(gained)
    spread = float(sums.std(ddof=1) / np.sqrt(BLOCKS))
    return float(sums.mean()) / max(spread, 1e-12)
