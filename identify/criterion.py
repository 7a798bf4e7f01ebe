"""The criterion of eq. (4): over one free run as in the paper, or over short free runs restarted at smoothed states.

The position of a friction axis is a free integrator: over a long run the smallest unmodelled force drifts it away, in
closed loop by metres. Runs of one second tell models apart and do not drown in the drift.
"""

from __future__ import annotations

import dataclasses
from math import comb

import numpy as np
from numpy.typing import NDArray

from identify.kernels.smoothing import parabolas
from identify.observer import FREE_RUN
from identify.preprocess import Samples
from identify.problem import FrictionProblem

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

RUN_LENGTH = 1.0  # s: tells models apart and does not drown in drift (docs/identification.md)
REACHES = np.array([2, 3, 5, 8, 12, 18, 27])  # samples to each side of a smoothed state, see `parabolas`
FREE = np.array(FREE_RUN)


def noise_level(series: Floats, order: int = 3) -> float:
    """Standard deviation of white noise on `series` (n,), from its differences of this order. [its unit]"""
    rest = np.diff(series, n=order)
    return float(np.median(np.abs(rest)) / 0.6745 / np.sqrt(float(comb(2 * order, order)))) if len(rest) else 0.0


def smoothed_states(samples: Samples, at: Ints) -> Floats:
    """Position and velocity at samples `at` (k,), by local parabolas as wide as the noise asks for. (k, 2)"""
    states = np.empty((len(at), 2))
    noise = noise_level(samples.position)
    parabolas(samples.t, samples.position, samples.edges, samples.run, at, REACHES, samples.sample_time, noise, states)
    return states


def restarted(samples: Samples, run_length: float = RUN_LENGTH) -> tuple[Samples, Floats]:
    """The same samples cut into runs of `run_length` seconds, and the smoothed state each starts from: (runs, 2)."""
    since = samples.t - samples.t[samples.first][samples.run]
    piece = np.floor(since / run_length + 1e-9).astype(np.int64)
    fresh = np.flatnonzero((np.diff(samples.run, prepend=-1) != 0) | (np.diff(piece, prepend=-1) != 0))
    run = np.zeros(len(samples), dtype=np.int64)
    run[fresh[1:]] = 1
    return dataclasses.replace(samples, run=np.cumsum(run)), smoothed_states(samples, fresh.astype(np.int64))


def short_run_criterion(problem: FrictionProblem, x: Floats, run_length: float = RUN_LENGTH) -> float:
    """Eq. (4) of unknowns x over restarted free runs: squared errors over squares of the centred position. [1]"""
    samples, states = restarted(problem.samples, run_length)
    cut = problem.on(samples, states)
    y = np.concatenate([x[: problem.p], np.zeros(2 * samples.runs)])
    return relative_square(cut.errors(y[None], FREE)[:, 0], problem.samples.position)


def one_run_criterion(problem: FrictionProblem, x: Floats) -> float:
    """Eq. (4) of unknowns x (size,), starts included, over one free run; position centred. [1]"""
    return relative_square(problem.errors(x[None], FREE)[:, 0], problem.samples.position)


def relative_square(error: Floats, position: Floats) -> float:
    """Squared errors (n,) over squares of the centred position (n,). [1]"""
    return float(error @ error) / float(np.sum((position - position.mean()) ** 2))


def free_run_criterion(problem: FrictionProblem, candidates: Floats) -> Floats:
    """Eq. (4) of candidates (m, p) over one free run from the measured start; inf where it diverged. (m,)"""
    x = np.concatenate([candidates, np.zeros((len(candidates), problem.size - candidates.shape[1]))], axis=1)
    error = problem.errors(x, FREE)
    position = problem.samples.position
    with np.errstate(over="ignore", invalid="ignore"):
        value = np.einsum("nm,nm->m", error, error) / float(position @ position)
    return np.where(np.isfinite(value), value, np.inf)
