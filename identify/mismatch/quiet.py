"""The force without the noise that the log added to it, and the axis never felt.

Noise in a measured input is not only noise in the prediction. A model that answers the force less, with more mass, is
disturbed by it less, and is likelier (attenuation; Carroll et al. 2006, *Measurement Error in Nonlinear Models*,
section 3.2): of 89 kg 125 were made. With the expected force instead of the logged one that pull is gone (regression
calibration, ibid. chapter 4). Smoothing keeps every impulse; it only spreads it over the samples beside it.
"""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct, idct
from scipy.optimize import minimize_scalar

from identify.preprocess import Samples

Floats = NDArray[np.float64]

PENALTIES = np.arange(-3.0, 8.1, 0.5)  # log10 of the weight of the squared second difference
SHORTEST = 100  # samples of a run whose noise can be told from what happened in it


def quieted(samples: Samples) -> Samples:
    """The samples with the white noise of their force taken out of each run that is long enough."""
    force = samples.force.copy()
    for a, b in itertools.pairwise(samples.edges.tolist()):
        if b - a >= SHORTEST:
            force[a:b] = smooth(samples.force[a:b])
    return dataclasses.replace(samples, force=force)


def smooth(series: Floats) -> Floats:
    """A series (n,) of even steps without its white noise.

    Whittaker's (1923) smoother in the basis of cosines (Garcia 2010, *Computational Statistics & Data Analysis* 54,
    1167); how smooth is told by generalised cross-validation (Craven & Wahba 1979).
    """
    n = len(series)
    waves = dct(series, norm="ortho")
    rough = (2.0 - 2.0 * np.cos(np.pi * np.arange(n) / n)) ** 2

    def kept(penalty: float) -> Floats:
        return np.asarray(1.0 / (1.0 + 10.0**penalty * rough), dtype=np.float64)

    def score(penalty: float) -> float:
        lost = 1.0 - kept(penalty)
        return float(np.sum((lost * waves) ** 2)) / max(float(lost.mean()) ** 2, 1e-300)

    best = float(min(PENALTIES, key=score))
    step = float(PENALTIES[1] - PENALTIES[0])
    found = minimize_scalar(score, bounds=(best - step, best + step), method="bounded")
    return np.asarray(idct(kept(float(found.x)) * waves, norm="ortho"), dtype=np.float64)
