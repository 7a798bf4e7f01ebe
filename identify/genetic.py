"""The genetic algorithm of §3.2-3.8 and Fig. 5, in ask/tell form: it never sees the problem.

What the paper leaves open, and what stands here:

* Pairs for the crossover are drawn at random, every individual once (§3.6 takes "two parents"); a pair crosses with the
  probability `crossover_rate`, each parameter at its own point L in 1..bits-1, and gives both complementary children.
* "The corresponding individual is put in the population" (§3.8): the best individual known so far takes the place of
  the first child, in every generation, not only when it is below `Max`.
* `mu` counts how often `optim` was improved and raises the mutation probability: Pm (1 + mu/50), at most 0.1. Faster
  schedules lose what the crossover builds; the paper gives none.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from identify.coding import decode, encode
from identify.errors import ParameterError

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

MU_PER_DOUBLING = 50.0
HIGHEST_MUTATION = 0.1


@dataclass(frozen=True, slots=True)
class GeneticSettings:
    """Design of §4.4.

    Attributes:
        population: individuals. 20 to 100 in §3.3; even
        bits: genes per parameter, eq. (3). 2 to 32
        crossover_rate: probability that a pair crosses. 0 to 1
        mutation: Pm, probability that a bit flips. 0 to 1
        target: `Max`, the criterion at which the search stops. [1]
        generations: budget.
    """

    population: int = 50
    bits: int = 8
    crossover_rate: float = 0.5
    mutation: float = 0.03
    target: float = 0.0
    generations: int = 200

    def __post_init__(self) -> None:
        """Check every value."""
        if self.population < 4 or self.population % 2:
            raise ParameterError("population", self.population, "an even number >= 4")
        if not 2 <= self.bits <= 32:
            raise ParameterError("bits", self.bits, "2 to 32")
        for field in ("crossover_rate", "mutation"):
            if not 0 <= getattr(self, field) <= 1:
                raise ParameterError(field, getattr(self, field), "0 to 1")
        if self.generations < 1:
            raise ParameterError("generations", self.generations, ">= 1")


class GeneticAlgorithm:
    """One population of coded individuals between `low` and `high` (p,).

    Attributes:
        best: best values known. (p,)
        best_criterion: theirs (`optim` of Fig. 5).
        generation: generations told so far.
        mu: times that `optim` was improved.
    """

    def __init__(
        self, low: Floats, high: Floats, settings: GeneticSettings, rng: Generator, seeds: Floats | None = None
    ) -> None:
        """Draw the first parents at random; rows of `seeds` (s, p), if any, take the first places."""
        self.low, self.high, self.settings, self._rng = low, high, settings, rng
        self._codes = rng.integers(0, 2**settings.bits, size=(settings.population, len(low)))
        if seeds is not None:
            self._codes[: len(seeds)] = encode(seeds, low, high, settings.bits)
        self._best_code = self._codes[0].copy()
        self.best_criterion = np.inf
        self.generation = 0
        self.mu = 0

    @property
    def best(self) -> Floats:
        """Best values known. (p,)"""
        return decode(self._best_code, self.low, self.high, self.settings.bits)

    @property
    def mutation(self) -> float:
        """Pm as raised by mu."""
        return min(
            self.settings.mutation * (1.0 + self.mu / MU_PER_DOUBLING), max(HIGHEST_MUTATION, self.settings.mutation)
        )

    def ask(self) -> Floats:
        """The population's values. (population, p)"""
        return decode(self._codes, self.low, self.high, self.settings.bits)

    def tell(self, criterion: Floats) -> None:
        """Take the criterion of each individual (population,), inf where its simulation failed, and breed the next."""
        order = int(np.argmin(criterion))
        if criterion[order] < self.best_criterion:
            self.best_criterion, self._best_code = float(criterion[order]), self._codes[order].copy()
            self.mu += 1
        parents = self._codes.copy()
        parents[int(np.argmax(criterion))] = parents[order]
        children = self._mutate(self._cross(parents))
        children[0] = self._best_code
        self._codes = children
        self.generation += 1

    def _cross(self, parents: Ints) -> Ints:
        """Exchange the lower bits of paired individuals, each parameter at its own point (Fig. 4)."""
        m, p = parents.shape
        shuffled = parents[self._rng.permutation(m)]
        first, second = shuffled[0::2], shuffled[1::2]
        point = self._rng.integers(1, self.settings.bits, size=(m // 2, p))
        tail = (np.int64(1) << (self.settings.bits - point)) - 1
        tail[self._rng.random(m // 2) >= self.settings.crossover_rate] = 0
        swapped = (first ^ second) & tail
        return np.concatenate([first ^ swapped, second ^ swapped])

    def _mutate(self, codes: Ints) -> Ints:
        """Flip each bit with probability Pm (§3.7)."""
        bits = self.settings.bits
        flips = self._rng.random((*codes.shape, bits)) < self.mutation
        return np.asarray(codes ^ (flips << np.arange(bits)).sum(axis=-1), dtype=np.int64)
