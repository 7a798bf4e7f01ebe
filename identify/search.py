"""The searches: the paper's (Fig. 5), and a genetic start that hands over to the polish."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from identify.genetic import GeneticAlgorithm, GeneticSettings
from identify.observer import CORRELATION_TIMES, gain_table
from identify.polish import SMALL_GAIN, Ends, linearise, polish_all, scatter
from identify.problem import FrictionProblem
from identify.profile import SLOW, STRIBECK, same_friction

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

START = GeneticSettings(population=32, bits=10, mutation=0.03, target=-np.inf, generations=6)
FINALISTS = 3  # individuals the polish starts from
LIKELIER = 0.5  # of log-likelihood units: a smaller gain does not count as better
SCOUTS = 4  # random candidates that show which gain tracks
SCOUTED = 2  # every second gain is enough for that
AFAR = 0.5  # of log-likelihood units: a witness that gains less in an iteration has arrived
ROUGH = 0.1  # of log-likelihood units: what an iteration must gain where the gain will change anyway
KICK = 3.0  # standard deviations
WEAKER = (0, 1, 3)  # half decades below the present gain, less one
NEARBY = 10.0**1.01  # ratio of rho between gains that are looked at again after a small move
WORTH = 3  # points polished at their likeliest gains; the less likely ones are left (no miss in 144 cold searches)
WEAK = 10.0  # 1/s^2, rho: below it the optimum of a still weaker observer is too narrow to be seen from here
FINISHES = 4  # last polishes at most; one or two are usual
HOPEFUL = 3.0  # of the loss: how far above the best a point may be that still changes its gain
ROUNDS = 8  # of the homotopy at most; two are usual
SAME = 0.02  # of scaled unknowns: polished points closer than this are one
ELSEWHERE = tuple(np.log([0.1, 0.25, 0.6]))  # v_s over the fastest speed, where a search that lost it looks again
CLASSICAL = (0.5, 0.65, float(np.log(0.25)), 0.3)  # F_c, F_s, log v_s, F_v scaled: the branch of a textbook friction


class Criterion(Protocol):
    """What a genetic search minimises: candidates (m, p) to criteria (m,), inf where a simulation diverged."""

    def __call__(self, candidates: Floats, /) -> Floats:
        """Evaluate all candidates."""


@dataclass(frozen=True, slots=True, eq=False)
class SearchResult:
    """Where a search ended.

    Attributes:
        x: unknowns of the problem. (size,)
        criterion: their loss, or eq. (4) for the paper's search.
        gain: observer gains at the end, all zero for a free run. (5,)
        setting: tau [s] and rho [1/s²] of the observer. (2,)
        evaluations: candidate runs spent.
        free_run: whether eq. (4) was asked for, so that the gain is to stay zero.
    """

    x: Floats
    criterion: float
    gain: Floats
    setting: Floats
    evaluations: int
    free_run: bool = False


def genetic_search(
    criterion: Criterion,
    bounds: tuple[Floats, Floats],
    settings: GeneticSettings,
    rng: Generator,
    seeds: Floats | None = None,
) -> tuple[GeneticAlgorithm, list[tuple[float, Floats]]]:
    """Run Fig. 5 until the criterion reaches `Max` or the budget ends; also give the best of every generation."""
    ga = GeneticAlgorithm(*bounds, settings, rng, seeds)
    winners: list[tuple[float, Floats]] = []
    while ga.best_criterion > settings.target and ga.generation < settings.generations:
        candidates = ga.ask()
        values = criterion(candidates)
        order = int(np.argmin(values))
        winners.append((float(values[order]), candidates[order]))
        ga.tell(values)
    return ga, winners


def observer_search(problem: FrictionProblem, rng: Generator, start: Floats | None = None) -> SearchResult:
    """Genetic start, then polish under a gain homotopy; the likeliest end wins.

    Where v_s is far below the visited speeds, F_s and v_s move nothing any more, and no descent comes back from there
    (one window of a thousand on machines with F_s far from F_c): such an end is only believed when other v_s lead no
    better one.

    Args:
        problem: what is searched.
        rng: source of randomness; the same state gives the same result.
        start: a known answer (size,) to try first, for instance the axis' last one; it competes, it does not bind.
    """
    path = _Homotopy(problem, *gain_table(problem.samples.sample_time), rng)
    found = _search(problem, path, rng, start)
    if found.x[STRIBECK] >= SLOW:
        return found
    again = path.follow(np.stack([same_friction(found.x, value) for value in ELSEWHERE]))
    return again if again.criterion < found.criterion else dataclasses.replace(found, evaluations=path.evaluations)


def _search(problem: FrictionProblem, path: _Homotopy, rng: Generator, start: Floats | None) -> SearchResult:
    """Once: genetic start, or the known one where a witness confirms it."""
    gains, settings = path.gains, path.settings
    coarse = problem.refined(problem.samples.sample_time)  # one-step errors of a strong observer forgive long steps
    p = problem.p
    low, high = problem.bounds
    scouts = with_start(problem, rng.uniform(low[:p], high[:p], size=(SCOUTS, p)))
    by_gain = losses_by_gain(coarse, scouts, gains[:, ::SCOUTED])
    gain = gains[:, SCOUTED * by_gain.min(axis=0).argmin()]
    path.evaluations += by_gain.size
    seeds = np.array([_classical(problem)])
    if start is not None:
        witnesses = np.concatenate([seeds, scouts[[by_gain.min(axis=1).argmin()]]])
        known = path.confirmed(coarse, start, witnesses, gain)
        if known is not None:
            x, index = known
            if settings[1, index] <= WEAK:
                x, index = path.released(x, index)
            return path.follow(x[None]) if 0.0 < settings[1, index] <= WEAK else path.finished(x, index)
        seeds = np.concatenate([seeds, start[None]])

    def criterion(candidates: Floats) -> Floats:
        return coarse.losses(with_start(problem, candidates), gain)

    ga, winners = genetic_search(criterion, (low[:p], high[:p]), START, rng, seeds[:, :p])
    points = np.concatenate([seeds, with_start(problem, finalists(winners))])
    ends = polish_all(coarse, points, gain, 12, ROUGH)
    path.evaluations += ga.generation * START.population + ends.evaluations
    return path.follow(_distinct(ends, p))


def homotopy(
    problem: FrictionProblem, x: Floats, gains: Floats, settings: Floats, rng: Generator, rounds: int = ROUNDS
) -> SearchResult:
    """Polish points x (k, size) under a gain homotopy over gains (5, g), settings (2, g); the likeliest end."""
    return _Homotopy(problem, gains, settings, rng).follow(x, rounds)


class _Homotopy:
    """Points polished at changing gains, and what that cost.

    A strong observer forgives a wrong start, a weak one tells parameters apart; going from one to the other is what
    makes blind starts converge.
    """

    def __init__(self, problem: FrictionProblem, gains: Floats, settings: Floats, rng: Generator) -> None:
        self.problem, self.gains, self.settings, self.rng = problem, gains, settings, rng
        self.evaluations = 0

    def polish(self, x: Floats, index: Ints, iterations: int, enough: float) -> Ends:
        """Points x (k, size) polished at the gains of `index` (k,)."""
        ends = polish_all(self.problem, x, self.gains[:, index], iterations, enough)
        self.evaluations += ends.evaluations
        return ends

    def settle(self, x: Floats) -> tuple[Floats, float, int]:
        """The best of x (k, size) after a polish at their likeliest gains: unknowns, loss, index of its gain."""
        self.evaluations += len(x) * self.gains.shape[1]
        by_gain = losses_by_gain(self.problem, x, self.gains)
        worth = by_gain.min(axis=1).argsort()[:WORTH]
        index: Ints = by_gain[worth].argmin(axis=1)
        ends = self.polish(x[worth], index, 12, ROUGH)
        return ends.x[ends.best], float(ends.loss[ends.best]), int(index[ends.best])

    def weaker(self, index: int) -> Ints:
        """Indices of the gains half a decade, one and two decades weaker at the same tau, and of the free run."""
        tau, rho = self.settings[:, index]
        same = np.flatnonzero((self.settings[0] == tau) & (self.settings[1] < rho * 0.99))[::-1]
        return np.unique(np.append(same[[k for k in WEAKER if k < len(same)]], 0))

    def kicked(self, x: Floats, index: int) -> Floats:
        """A point a few standard deviations from x (size,), and x with every run starting at rest. (2, size)"""
        root = scatter(linearise(self.problem, x[None], self.gains[:, [index]]).normal[0])
        points = np.stack([x + KICK * root @ self.rng.normal(size=len(x)), x])
        points[1, self.problem.p + 1 :: 2] = -self.problem.first_state[:, 1] / self.problem.start_unit[1]
        return np.clip(points, *self.problem.bounds)

    def follow(self, x: Floats, rounds: int = ROUNDS) -> SearchResult:
        """Polish points x (k, size) at their likeliest gains, then with a weaker observer while that is likelier.

        Without `rounds` of the latter, only what lies downhill of the points is found. All weaker gains are tried at
        once, they share the lanes; so do kicks that get a point over the kinks where a sample begins or ceases to
        stick, the first sample above all.
        """
        best, loss, index = self.settle(x)
        for _ in range(rounds):
            weak = self.weaker(index)
            points = np.concatenate([np.repeat(best[None], len(weak), axis=0), self.kicked(best, index)])
            trials = self.polish(points, np.append(weak, [index, index]), 5, ROUGH)
            end, end_loss, end_index = self.settle(trials.x)
            gained = loss - end_loss
            if gained > 0:
                best, loss, index = end, end_loss, end_index
            if gained < LIKELIER:
                break
        return self.finished(best, index)

    def finished(self, x: Floats, index: int) -> SearchResult:
        """The last polish of x (size,), at the gain of `index` or the likelier one that shows up on the way.

        In lanes that would idle, the same point is polished under a weaker observer of another correlation time: where
        the way to a likelier optimum leads over a ridge, it leads around.
        """
        points, at = np.stack([x, x]), np.array([index, self.aside(index)])
        for _ in range(FINISHES):
            ends = self.polish(points, at, 20, SMALL_GAIN)
            near = nearby(self.settings, int(at[0]))
            by_gain = losses_by_gain(self.problem, ends.x, self.gains[:, near])
            self.evaluations += by_gain.size
            likeliest, least = near[by_gain.argmin(axis=1)], by_gain.min(axis=1)
            moving = likeliest != at
            moving &= least < least.min() + HOPEFUL
            if not moving.any():
                break
            points, at = ends.x[least.argsort()], likeliest[least.argsort()]
        end, index = ends.best, int(at[ends.best])
        return SearchResult(
            ends.x[end],
            float(ends.loss[end]),
            self.gains[:, index].copy(),
            self.settings[:, index].copy(),
            self.evaluations,
        )

    def released(self, x: Floats, index: int) -> tuple[Floats, int]:
        """A point (size,) near the free run, polished there and at its own gain; the likelier of both, and its gain."""
        at = np.array([index, 0])
        ends = self.polish(np.stack([x, x]), at, 12, ROUGH)
        return ends.x[ends.best], int(at[ends.best])

    def aside(self, index: int) -> int:
        """Index of the gain half a decade weaker at another correlation time; the free run where there is none."""
        tau, rho = self.settings[:, index]
        other = CORRELATION_TIMES[0] if tau == CORRELATION_TIMES[1] else CORRELATION_TIMES[1]
        found = np.flatnonzero((self.settings[0] == other) & (self.settings[1] < rho / 2.0))
        return int(found[-1]) if len(found) else 0

    def confirmed(
        self, coarse: FrictionProblem, start: Floats, witnesses: Floats, gain: Floats
    ) -> tuple[Floats, int] | None:
        """Where `start` (size,) leads and its gain's index, if a witness gets there too; or None.

        Args:
            coarse: the problem in long steps.
            start: a known answer, polished at its own likeliest gain.
            witnesses: points (w, size) that know nothing of it; the best of them counts.
            gain: strong, for the witnesses to begin at. (5,)
        """
        afar = polish_all(coarse, witnesses, gain, 12, AFAR, race=True)
        self.evaluations += afar.evaluations
        pair, lead, index = np.stack([start, afar.x[afar.best]]), 0, -1
        for _ in range(ROUNDS):
            before, index = index, int(losses_by_gain(coarse, pair[[lead]], self.gains).argmin())
            if index == before:
                break
            ends = polish_all(coarse, pair, self.gains[:, index], 12, ROUGH)
            pair, lead = ends.x, ends.best
            self.evaluations += self.gains.shape[1] + ends.evaluations
        apart = float(np.abs(pair[0, : coarse.p] - pair[1, : coarse.p]).max())
        return (pair[lead], index) if apart < SAME and float(np.ptp(ends.loss)) < LIKELIER else None


def nearby(settings: Floats, index: int) -> Ints:
    """Indices of the observers up to a decade weaker or stronger than that of `index`, and of the free run."""
    rho = max(settings[1, index], settings[1, 1:].min() / NEARBY)
    far = np.where(settings[0] == settings[0, index], NEARBY, np.sqrt(NEARBY))
    ratio = settings[1] / rho
    return np.flatnonzero(((ratio < far) & (ratio > 1.0 / far)) | (settings[1] == 0.0))


def losses_by_gain(problem: FrictionProblem, x: Floats, gains: Floats) -> Floats:
    """Losses of the candidates x (k, size) at all gains (5, g). (k, g)"""
    k, g = len(x), gains.shape[1]
    return problem.losses(np.repeat(x, g, axis=0), np.tile(gains, k)).reshape(k, g)


def _distinct(ends: Ends, p: int) -> Floats:
    """Points without those that came to the same place, best first. (k, size)"""
    chosen: list[Floats] = []
    for k in np.argsort(ends.loss):
        if all(np.abs(ends.x[k, :p] - other[:p]).max() > SAME for other in chosen):
            chosen.append(ends.x[k])
    return np.array(chosen)


def with_start(problem: FrictionProblem, candidates: Floats) -> Floats:
    """Candidates (m, p) with the measured state at each run's start: (m, size)."""
    return np.concatenate([candidates, np.zeros((len(candidates), problem.size - problem.p))], axis=1)


def _classical(problem: FrictionProblem) -> Floats:
    """The textbook friction at this recording's scales. (size,)"""
    x = np.zeros(problem.size)
    x[:4] = CLASSICAL
    return x


def finalists(winners: list[tuple[float, Floats]]) -> Floats:
    """The best individuals of the last generations that differ from each other. (<= FINALISTS, p)"""
    chosen: list[Floats] = []
    for _, x in sorted(winners, key=lambda winner: winner[0]):
        if all(np.abs(x - other).max() > 0.1 for other in chosen):
            chosen.append(x)
        if len(chosen) == FINALISTS:
            break
    return np.array(chosen)
