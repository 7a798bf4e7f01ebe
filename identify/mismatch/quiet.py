"""The force without the noise that the log added to it, and the axis never felt.

Noise in a measured input is not only noise in the prediction. A model that answers the force less, with more mass, is
disturbed by it less, and is likelier (attenuation; Carroll et al. 2006, *Measurement Error in Nonlinear Models*,
section 3.2): of 89 kg 125 were made. With the expected force instead of the logged one that pull is gone (regression
calibration, ibid. chapter 4), and what is faint shows: a machine that waits, speeds up and runs evenly is quiet most of
the time, and there its force may be smoothed over half a second, while a force that jumps keeps its edge.
"""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct, idct
from scipy.ndimage import gaussian_filter1d

from identify.criterion import noise_level
from identify.preprocess import Samples

Floats = NDArray[np.float64]

PENALTIES = 10.0 ** np.arange(-2.0, 10.5, 1.0)  # weights of the squared second difference
AROUND = 20.0  # samples, standard deviation of the stretch whose risk decides how smooth its middle is
SHORTEST = 100  # samples of a run whose noise can be told from what happened in it
DIFFERENCE = 4  # order of the differences whose median knows noise alone: what jumps, jumps seldom
LEAST = 3.0  # degrees of freedom of a smooth series


def quieted(samples: Samples) -> Samples:
    """The samples with the white noise of their force taken out of each run that is long enough."""
    force = samples.force.copy()
    for a, b in itertools.pairwise(samples.edges.tolist()):
        if b - a >= SHORTEST:
            force[a:b] = smooth(samples.force[a:b])
    return dataclasses.replace(samples, force=force)


def smooth(series: Floats) -> Floats:
    """A series (n,) of even steps without its white noise, as smooth in each place as it is there.

    Whittaker's (1923) smoothers of all strengths, in the basis of cosines (Garcia 2010, *Computational Statistics &
    Data Analysis* 54, 1167), mixed by the exponential weights of their unbiased risks around each sample (Stein 1981;
    Leung & Barron 2006, *IEEE Transactions on Information Theory* 52, 3396).
    """
    n, variance = len(series), noise_level(series, DIFFERENCE) ** 2
    if variance == 0.0:
        return series
    waves = dct(series, norm="ortho")
    rough = (2.0 - 2.0 * np.cos(np.pi * np.arange(n) / n)) ** 2
    ways, risks = [series], [np.full(n, variance)]
    for penalty in PENALTIES:
        kept = 1.0 / (1.0 + penalty * rough)
        if kept.sum() < LEAST:
            break
        way = idct(kept * waves, norm="ortho")
        misfit = gaussian_filter1d((series - way) ** 2, AROUND, mode="reflect")
        ways.append(way)
        risks.append(misfit + (2.0 * float(kept.mean()) - 1.0) * variance)
    risk, around = np.stack(risks), 2.0 * np.sqrt(np.pi) * AROUND  # as many samples as such a window counts for
    weights = np.exp(-around * (risk - risk.min(axis=0)) / (4.0 * variance))
    return np.asarray((weights * np.stack(ways)).sum(axis=0) / weights.sum(axis=0), dtype=np.float64)
