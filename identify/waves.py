"""Scatter of a least-squares fit whose errors are correlated: what slow waves in the errors move the answer by.

The covariance of the answer is that of the score (derivative times error, summed), and the score's variance is its
spectrum at zero frequency. Cosines of 1/2, 1, 3/2, ... periods over the recording look at the lowest frequencies there
are, and their average is an estimate of it with about as many degrees of freedom as there are cosines ("equal-weighted
cosines", Lazarus, Lewis, Stock & Watson 2018). Pieces cut out of the recording would do (Bell & McCaffrey 2002), but
what errs on both sides of a cut counts twice: intervals are a tenth longer.

The fit hides part of its errors: each cosine is corrected for what the fit takes away from white errors, and Student's
t has the degrees of freedom that these leave each unknown (Satterthwaite: Bell & McCaffrey 2002, Imbens & Kolesar 2016,
Pustejovsky & Tipton 2018): a parameter that a single stroke tells gets the wide interval it deserves.
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct
from scipy.stats import t as student

Floats = NDArray[np.float64]

WAVES = 12  # cosines: 0.3 Hz in 20 s; errors may be correlated over a second without harm
LEVEL = 0.95
NORMAL = 1.959964
LEAST_SEEN = 1e-2  # of a wave's information: keeps what the fit hides altogether from dividing by zero


def cosine_sums(x: Floats, count: int) -> Floats:
    """Sums of x (n, ...) times cosines of 0, 1/2, 1, ... periods, `count` of them. (count, ...)

    By a cosine transform: a matrix product of this size has other last bits where the library uses more threads.
    """
    return np.asarray(0.5 * dct(x, axis=0)[:count], dtype=np.float64)


def wave_scatter(error: Floats, slope: Floats, variance: float, prior: Floats) -> Floats:
    """Covariance (q, q) of a least-squares fit, widened so that `NORMAL` standard deviations are a 95 % interval.

    Args:
        error: residuals. [m] (n,)
        slope: their derivatives. [m] (n, q)
        variance: of the residuals. [m²]
        prior: precision that the data did not bring. (q, q)
    """
    size, turn = np.linalg.eigh(slope.T @ slope / variance + prior)
    root = turn / np.sqrt(np.maximum(size, size[-1] * 1e-15))
    root_white = root / np.sqrt(variance)
    score = np.sqrt(2.0 / variance) * cosine_sums(slope * error[:, None], WAVES + 1)[1:] @ root_white
    seen = _seen(root_white.T @ cosine_products(slope, 2 * WAVES + 1) @ root_white)
    own = np.arange(WAVES)
    share, axes = np.linalg.eigh(seen[own, own])
    correction = (axes / np.sqrt(np.maximum(share, LEAST_SEEN))[:, None, :]) @ axes.transpose(0, 2, 1)
    pull = root @ correction
    moved = np.einsum("wqa,wa->wq", pull, score)
    # Under white errors the products of what two waves move an unknown by; their spread is its degrees of freedom.
    together = np.einsum("iqa,ijab,jqb->qij", pull, seen, pull, optimize=True)
    spread = np.einsum("qij,qij->q", together, together)
    freedom = np.maximum(np.trace(together, axis1=1, axis2=2) ** 2 / np.maximum(spread, 1e-300), 1.0)
    widen = student.ppf(0.5 + LEVEL / 2, freedom) / NORMAL
    return np.asarray(moved.T @ moved / WAVES * np.outer(widen, widen), dtype=np.float64)


def _seen(gram: Floats) -> Floats:
    """Expected products of the scores of two waves, after a fit to white errors. (WAVES, WAVES, q, q)

    The product of two waves is the mean of two waves: the sums of the products of the derivatives tell all.

    Args:
        gram: those sums of whitened derivatives, for each wave. (2 WAVES + 1, q, q)
    """
    number = np.arange(1, WAVES + 1)
    taken = np.sqrt(2.0) * gram[number]  # what the fit hides of each wave
    both = gram[number[:, None] + number] + gram[np.abs(number[:, None] - number)]
    return np.asarray(both - 2.0 * taken[:, None] @ taken + taken[:, None] @ (gram[0] @ taken), dtype=np.float64)


def cosine_products(slope: Floats, count: int) -> Floats:
    """Sums of the products of the columns of slope (n, q) times `count` cosines as in `cosine_sums`. (count, q, q)

    Where a run starts is an unknown that acts in that run alone: each stretch looks at the columns that act there.
    """
    size = len(slope)
    used = slope != 0.0
    first = np.where(used.any(axis=0), used.argmax(axis=0), size)
    last = size - used[::-1].argmax(axis=0)
    angle = np.pi * (np.arange(size) + 0.5) / size
    found = np.zeros((count, slope.shape[1], slope.shape[1]))
    for start, end in itertools.pairwise(np.unique(np.concatenate([[0, size], first, last])).tolist()):
        active = np.flatnonzero((first < end) & (last > start))
        waves = np.cos(np.arange(count)[:, None] * angle[start:end])
        part = slope[start:end, active]
        pairs = (part[:, :, None] * part[:, None, :]).reshape(end - start, -1)
        sums = np.einsum("wn,nk->wk", waves, pairs)
        found[:, active[:, None], active] += sums.reshape(count, len(active), len(active))
    return found
