"""What only a fitted model can tell from motion: small outliers of the position."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from identify.preprocess import Samples
from identify.problem import FrictionProblem

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

SIGMAS = 7.0  # robust standard deviations of the prediction error
GONE = 0.7  # of the squared error that must vanish with the sample
MOST = 10  # samples tried; more is not an outlier but a model that does not fit


def late_outliers(problem: FrictionProblem, x: Floats, gain: Floats) -> Bools:
    """Positions that the model around them contradicts. (n,)

    Leaving out an outlier takes its error away. Leaving out a sample at which the machine really was disturbed only
    moves the error to the next one; such samples stay.
    """
    samples = problem.samples
    error, _ = problem.jacobian(x, gain)
    sigma = float(np.median(np.abs(error[samples.valid]))) / 0.6745
    suspects = np.flatnonzero(np.abs(error) > SIGMAS * sigma)
    found = np.zeros(len(samples), dtype=np.bool_)
    if not 0 < len(suspects) <= 5 * MOST or sigma == 0.0:
        return found
    total = float(error @ error)
    for k in suspects[np.argsort(-np.abs(error[suspects]))][:MOST].tolist():
        trial = found.copy()
        trial[k] = True
        other = problem.masked(without(samples, trial)).errors(x[None], gain)[:, 0]
        left = float(other @ other)
        if total - left >= GONE * float(error[k]) ** 2:
            found, total = trial, left
    return found


def without(samples: Samples, bad: Bools) -> Samples:
    """The samples with positions at `bad` (n,) bridged and not compared with the model."""
    valid = samples.valid & ~bad
    position = samples.position.copy()
    for run in range(samples.runs):
        inside = samples.run == run
        good = inside & valid
        if good.any():
            position[inside & ~valid] = np.interp(samples.t[inside & ~valid], samples.t[good], samples.position[good])
    return dataclasses.replace(samples, valid=valid, position=position)
