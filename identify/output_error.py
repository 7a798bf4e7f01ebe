"""Genetic search and polish for the paper's own criterion, eq. (4) over one free run.

The surface of eq. (4) is a maze: a flat valley between F_s, v_s and F_v, with a kink wherever a sample begins or ceases
to stick. The genetic start therefore looks at the one-step errors of a strong observer, where the way is downhill; its
best individuals are polished while the observer is weakened to nothing, beside the best of the last generation on eq.
(4) itself. The search ends when the remaining error is white (nothing is left to find); else it starts anew and takes
smaller steps on the way down. Where that has not helped three times, differential evolution has the last word.
"""

from __future__ import annotations

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.special import chdtri

from identify.criterion import FREE
from identify.evolution import evolve
from identify.genetic import GeneticSettings
from identify.observer import gain_table
from identify.polish import linearise, polish_all, scatter
from identify.problem import FrictionProblem
from identify.search import SearchResult, finalists, genetic_search, losses_by_gain, with_start

Floats = NDArray[np.float64]

DESIGN = GeneticSettings(population=32, bits=10, mutation=0.03, target=-np.inf, generations=4)
LADDER = (0.15, (0.0, 1.0))  # tau [s] of the observer, and decades below the first gain that the polish passes
SCOUTS = 4  # random candidates that show which gain tracks
FINER = (0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5)  # decades, after a round that did not find the end
ROUNDS = 4  # before the evolution
KICKS = 2  # points around the best one in every further round
ELDERS = 2  # individuals of the evolution that are polished
ENOUGH = 0.1  # of log-likelihood units: an iteration that gains less is the last; 20 units are 1 % of the criterion
ROUGH = 0.5  # the same on the way there
BLOCKS = (20, 100)  # samples: white errors average out over blocks of either length
INVISIBLE = 1e-6  # of the travel
ALARM = 0.05  # share of white errors that fail the test


def output_error_search(problem: FrictionProblem, rng: Generator, start: Floats | None = None) -> SearchResult:
    """Minimise eq. (4) over one free run per run of samples.

    Args:
        problem: what is searched.
        rng: source of randomness; the same state gives the same result.
        start: a known answer (size,) to try first; it competes, it does not bind.
    """
    coarse = problem.refined(problem.samples.sample_time)
    rungs = _ladder(coarse, rng)
    evaluations = SCOUTS * rungs.shape[1]
    best, loss = np.zeros(problem.size) if start is None else start, np.inf
    for round_ in range(ROUNDS + 1):
        if round_ < ROUNDS:
            decades = FINER if round_ else LADDER[1]
            points, spent = _genetic_start(coarse, _steps_down(rungs, decades), rng)
        else:
            people, spent = evolve(problem, FREE, best[: problem.p], rng)
            points = with_start(problem, people[:ELDERS])
        known = [best, *_kicked(problem, best, rng)] if np.isfinite(loss) else [] if start is None else [best]
        ends = polish_all(problem, np.array([*points, *known]), FREE, 25, ENOUGH, race=True)
        evaluations += spent + ends.evaluations
        best, loss = ends.x[ends.best], float(ends.loss[ends.best])
        if ends.rested[ends.best] and nothing_left(problem, best):
            break
    return SearchResult(best, loss, FREE.copy(), np.zeros(2), evaluations, free_run=True)


def _kicked(problem: FrictionProblem, x: Floats, rng: Generator) -> Floats:
    """Points some to very many standard deviations from x (size,), along the valley. (KICKS, size)"""
    root = scatter(linearise(problem, x[None], FREE[:, None]).normal[0])
    lengths = 10.0 ** rng.uniform(0.0, 2.0, size=(KICKS, 1))
    return np.clip(x + lengths * rng.normal(size=(KICKS, len(x))) @ root.T, *problem.bounds)


def nothing_left(problem: FrictionProblem, x: Floats) -> bool:
    """Whether the free-run error of x (size,) averages out over blocks as white errors do, or is too small to see."""
    error = problem.errors(x[None], FREE)[:, 0]
    variance = float(error @ error) / len(error)
    if variance < (INVISIBLE * problem.scales.travel) ** 2:
        return True
    for length in BLOCKS:
        count = len(error) // length
        means = error[: count * length].reshape(count, length).mean(axis=1)
        if count > 1 and length * float(means @ means) > variance * float(chdtri(count, ALARM)):
            return False
    return True


def _ladder(problem: FrictionProblem, rng: Generator) -> Floats:
    """Observer gains from the weakest to the one that tracks random candidates best. (5, g)"""
    gains, settings = gain_table(problem.samples.sample_time)
    rungs = np.flatnonzero(settings[0] == LADDER[0])
    low, high = problem.bounds
    scouts = with_start(problem, rng.uniform(low[: problem.p], high[: problem.p], size=(SCOUTS, problem.p)))
    first = int(losses_by_gain(problem, scouts, gains[:, rungs]).min(axis=0).argmin())
    return gains[:, rungs[: first + 1]]


def _steps_down(rungs: Floats, decades: tuple[float, ...]) -> Floats:
    """Gains so many decades below the strongest of the rungs (5, g), half a decade each. (5, k)"""
    last = rungs.shape[1] - 1
    return rungs[:, sorted({max(last - round(2 * down), 0) for down in decades}, reverse=True)]


def _genetic_start(problem: FrictionProblem, gains: Floats, rng: Generator) -> tuple[Floats, int]:
    """Points (k, size) for the polish of the free run, and candidate runs spent."""
    p = problem.p
    low, high = problem.bounds

    def criterion(candidates: Floats) -> Floats:
        return problem.losses(with_start(problem, candidates), gains[:, 0])

    ga, winners = genetic_search(criterion, (low[:p], high[:p]), DESIGN, rng)
    population = with_start(problem, ga.ask())
    free = problem.losses(population, FREE)
    points = with_start(problem, finalists(winners)[:1])
    evaluations = ga.generation * DESIGN.population + len(population)
    for gain in gains.T:
        polished = polish_all(problem, points, gain, 10, ROUGH)
        points, evaluations = polished.x, evaluations + polished.evaluations
    return np.concatenate([points, population[[np.argmin(free)]]]), evaluations
