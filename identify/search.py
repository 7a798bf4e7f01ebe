"""The searches: the paper's (Fig. 5), and a genetic start that hands over to the polish."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from identify.genetic import GeneticAlgorithm, GeneticSettings
from identify.observer import gain_table
from identify.polish import polish
from identify.problem import FrictionProblem

Floats = NDArray[np.float64]

START = GeneticSettings(population=48, bits=10, mutation=0.03, generations=12)
FINALISTS = 3  # individuals the polish starts from
LIKELIER = 0.5  # of log-likelihood units: a smaller gain does not count as better
CLASSICAL = (0.5, 0.65, float(np.log(0.25)), 0.3)  # F_c, F_s, log v_s, F_v scaled: the branch of a textbook friction
RIDGE_SPEED, RIDGE_COULOMB, RIDGE_STATIC = 0.8, 0.1, 0.6  # scaled v_s above, F_c below, F_s/F_c below: look again


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
        gain: observer gains at the end, all zero for a free run. (4,)
        setting: tau [s] and rho [1/s²] of the observer. (2,)
        evaluations: candidate runs spent.
    """

    x: Floats
    criterion: float
    gain: Floats
    setting: Floats
    evaluations: int


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

    Args:
        problem: what is searched.
        rng: source of randomness; the same state gives the same result.
        start: a known answer (size,) to try first, for instance the axis' last one; it competes, it does not bind.
    """
    gains, settings = gain_table(problem.samples.sample_time)
    p = problem.p
    low, high = problem.bounds
    gain = gains[:, _likeliest(problem, _random_start(problem, rng), gains)]

    def criterion(candidates: Floats) -> Floats:
        return problem.losses(_with_start(problem, candidates), gain)

    seeds = np.array([_classical(problem)[:p]])
    if start is not None:
        seeds = np.concatenate([start[None, :p], seeds])
    ga, winners = genetic_search(criterion, (low[:p], high[:p]), START, rng, seeds)
    evaluations = ga.generation * START.population + gains.shape[1]
    first = [] if start is None else [start]
    ends = [
        homotopy(problem, x, gains, settings)
        for x in [*first, *_with_start(problem, _finalists(winners)), _classical(problem)]
    ]
    best = min(ends, key=lambda end: end.criterion)
    return SearchResult(
        best.x, best.criterion, best.gain, best.setting, evaluations + sum(end.evaluations for end in ends)
    )


def homotopy(problem: FrictionProblem, x: Floats, gains: Floats, settings: Floats) -> SearchResult:
    """Polish at the likeliest gain of x, then weaken the observer by decades as long as that finds a likelier fit.

    A strong observer forgives a wrong start, a weak one tells parameters apart; going from one to the other is what
    makes blind starts converge.
    """
    index = _likeliest(problem, x[None], gains)
    best = polish(problem, x, gains[:, index], 12)
    best_index, weak, failures, evaluations = index, index, 0, best.evaluations
    current = best
    while failures < 2 and weak > 0:
        weak = _weaker(weak, settings)
        step = polish(problem, current.x, gains[:, weak], 5)
        index = _likeliest(problem, step.x[None], gains)
        current = polish(problem, step.x, gains[:, index], 5)
        evaluations += step.evaluations + current.evaluations + gains.shape[1]
        if current.loss < best.loss - LIKELIER:
            best, best_index, weak, failures = current, index, index, 0
        else:
            failures += 1
    for _ in range(3):
        end = polish(problem, best.x, gains[:, best_index], 40)
        evaluations += end.evaluations
        index = _likeliest(problem, end.x[None], gains)
        best = end
        if index == best_index:
            break
        best_index = index
    return SearchResult(best.x, best.loss, gains[:, best_index].copy(), settings[:, best_index].copy(), evaluations)


def _likeliest(problem: FrictionProblem, x: Floats, gains: Floats) -> int:
    """Index of the gain that makes any of the candidates x (m, size) likeliest."""
    if len(x) == 1:
        return int(np.argmin(problem.losses(np.repeat(x, gains.shape[1], axis=0), gains)))
    return int(np.argmin([problem.losses(x, gains[:, g]).min() for g in range(gains.shape[1])]))


def _weaker(index: int, settings: Floats) -> int:
    """Index of the gain one decade weaker at the same tau; the free run (0) below the weakest."""
    tau, rho = settings[:, index]
    weaker = np.flatnonzero((settings[0] == tau) & (settings[1] <= rho / 10 * 1.01))
    return int(weaker[-1]) if len(weaker) else 0


def _with_start(problem: FrictionProblem, candidates: Floats) -> Floats:
    """Candidates (m, p) with the measured state at each run's start: (m, size)."""
    return np.concatenate([candidates, np.zeros((len(candidates), problem.size - problem.p))], axis=1)


def _random_start(problem: FrictionProblem, rng: Generator) -> Floats:
    """A few random candidates (8, size), to see which gain tracks."""
    low, high = problem.bounds
    return _with_start(problem, rng.uniform(low[: problem.p], high[: problem.p], size=(8, problem.p)))


def _classical(problem: FrictionProblem) -> Floats:
    """The textbook friction at this recording's scales. (size,)"""
    x = np.zeros(problem.size)
    x[:4] = CLASSICAL
    return x


def _finalists(winners: list[tuple[float, Floats]]) -> Floats:
    """The best individuals of the last generations that differ from each other. (<= FINALISTS, p)"""
    chosen: list[Floats] = []
    for _, x in sorted(winners, key=lambda winner: winner[0]):
        if all(np.abs(x - other).max() > 0.1 for other in chosen):
            chosen.append(x)
        if len(chosen) == FINALISTS:
            break
    return np.array(chosen)
