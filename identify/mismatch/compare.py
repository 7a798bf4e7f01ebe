"""Is one model better than another? Likelihood, block-robust evidence, free runs, size: each can say no.

Thresholds were set in a feasibility study on other machines, and are frozen.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.criterion import short_run_criterion, short_run_squares
from identify.mismatch.extended import ExtendedProblem
from identify.observer import gain_table
from identify.preprocess import Samples
from identify.search import SearchResult, homotopy

Floats = NDArray[np.float64]

SEED = 0  # of the polish's kicks
WORST = 0.2  # share of the free runs that count no more than the least of them
BLOCKS = 20  # pieces of the recording whose evidence must agree


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """A fitted model.

    Attributes:
        problem: model and data.
        found: where its search ended.
    """

    problem: ExtendedProblem
    found: SearchResult

    @property
    def x(self) -> Floats:
        """Unknowns. (size,)"""
        return self.found.x

    @property
    def names(self) -> tuple[str, ...]:
        """Its effects."""
        return tuple(guise.name for guise in self.problem.guises)

    @property
    def latent_force(self) -> float:
        """Force the observer supplies where the model has none: rho sigma m_e. [N]."""
        error = self.problem.errors(self.x[None], self.found.gain)[:, 0]
        sigma = float(np.sqrt(np.mean(error**2)))
        innovation = float(np.sqrt(max(1.0 - self.found.gain[0], 0.05)))  # of the innovation, what is sensor noise
        return float(self.found.setting[1] * sigma * innovation * self.problem.law(self.x[None])[4, 0])

    def terms(self) -> Floats:
        """Log-likelihood of each sample. (n,)"""
        error = self.problem.errors(self.x[None], self.found.gain)[:, 0]
        variance = float(np.mean(error**2)) + 1e-300
        return np.asarray(-0.5 * (error**2 / variance + np.log(variance)), dtype=np.float64)

    def short_run(self) -> float:
        """Eq. (4) over one-second free runs. [1]."""
        return float(short_run_criterion(self.problem, self.x))


def fit(problem: ExtendedProblem, points: Floats) -> Fit:
    """Polish points (k, size) under the gain homotopy; the likeliest end."""
    gains, settings = gain_table(problem.samples.sample_time)
    return Fit(problem, homotopy(problem, points, gains, settings, np.random.default_rng(SEED)))


@dataclass(frozen=True, slots=True)
class Comparison:
    """What speaks for the richer of two models.

    Attributes:
        bic: change of the Bayes information criterion; negative favours the richer one. [1]
        z: mean over standard error of the evidence per block. [1]
        free_run: ratio of eq. (4) over one-second free runs, richer over poorer. [1]
    """

    bic: float
    z: float
    free_run: float


def compare(poorer: Fit, richer: Fit) -> Comparison:
    """Weigh `richer` against `poorer` on the same samples."""
    gained = richer.terms() - poorer.terms()
    extra = richer.problem.p - poorer.problem.p
    bic = -2.0 * float(gained.sum()) + extra * float(np.log(richer.problem.samples.used))
    return Comparison(bic, block_z(gained), free_run_ratio(poorer, richer))


def free_run_ratio(poorer: Fit, richer: Fit, samples: Samples | None = None) -> float:
    """Squared errors of one-second free runs, richer over poorer; on `samples`, or on those of the fit. [1].

    A few runs that begin in a rest and break away too early or too late would decide a plain sum; each run counts at
    most as much as one of the worst fifth.
    """
    errors = [
        short_run_squares(one.problem if samples is None else one.problem.on(samples), one.x[: one.problem.p])
        for one in (poorer, richer)
    ]
    most = float(np.quantile(np.concatenate(errors), 1.0 - WORST))
    before, after = (float(np.minimum(each, most).sum()) for each in errors)
    return after / max(before, 1e-300)


def block_z(gained: Floats) -> float:
    """Mean over standard error of `gained` (n,) over blocks: evidence that comes from one place counts little."""
    edges = np.linspace(0, len(gained), BLOCKS + 1).astype(np.int64)[:-1]
    sums = np.add.reduceat(gained, edges)
    spread = float(sums.std(ddof=1) / np.sqrt(BLOCKS))
    return float(sums.mean()) / max(spread, 1e-12)
