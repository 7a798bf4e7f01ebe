"""Differential evolution (Storn & Price 1997): slow, and hardly ever lost; for when quicker ways found no end."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from identify.problem import FrictionProblem
from identify.search import with_start

Floats = NDArray[np.float64]

POPULATION = 64  # four vectors of sixteen
BUDGET = 4000  # candidate runs; SciPy's needs 3500 on the problems of the bench
CROSSED = 0.7  # share of parameters taken from the mutant
STEPS = (0.5, 1.0)  # a difference is scaled by a factor drawn from these each generation
CONVERGED = 1.0  # of the loss, between the best and the worst individual


def evolve(problem: FrictionProblem, gain: Floats, known: Floats, rng: Generator) -> tuple[Floats, int]:
    """Let a population that holds `known` (p,) evolve at observer gains (5,).

    Returns:
        The parameters of all individuals, best first (POPULATION, p), and candidate runs spent.
    """
    p = problem.p
    low, high = problem.bounds[0][:p], problem.bounds[1][:p]
    people = rng.uniform(low, high, size=(POPULATION, p))
    people[0] = known
    loss = problem.losses(with_start(problem, people), gain)
    spent = POPULATION
    while spent < BUDGET and float(np.ptp(loss)) > CONVERGED:
        pairs = np.argsort(rng.random((POPULATION, POPULATION)), axis=1)
        difference = people[pairs[:, 0]] - people[pairs[:, 1]]
        mutants = people[np.argmin(loss)] + rng.uniform(*STEPS) * difference
        crossed = rng.random((POPULATION, p)) < CROSSED
        crossed[np.arange(POPULATION), rng.integers(0, p, POPULATION)] = True
        trials = np.where(crossed, mutants, people)
        outside = (trials < low) | (trials > high)
        trials = np.where(outside, rng.uniform(low, high, size=trials.shape), trials)
        value = problem.losses(with_start(problem, trials), gain)
        better = value < loss
        people[better], loss[better] = trials[better], value[better]
        spent += POPULATION
    return people[np.argsort(loss)], spent
