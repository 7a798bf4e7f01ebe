"""Which effects are worth a full fit: the predictor's response to each, past what the baseline can swallow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.mismatch.compare import Fit
from identify.mismatch.extended import ExtendedProblem
from identify.mismatch.guise import Guise

Floats = NDArray[np.float64]

ABSORBED = 1e-6  # share of a response that must remain past the baseline to be judged at all


@dataclass(frozen=True, slots=True, eq=False)
class Lead:
    """One effect at its most telling starting point.

    Attributes:
        guise: the effect.
        start: scaled unknowns, amplitude already stretched to fit. (q,)
        gain: expected fall of twice the negative log-likelihood. [1]
        response: change of the predictions past the baseline, unit length. (n,)
    """

    guise: Guise
    start: Floats
    gain: float
    response: Floats


def leads(fit: Fit, guises: list[Guise], gain: Floats) -> list[Lead]:
    """The best starting point of every guise at observer gains (5,), most telling first."""
    return leads_at(fit, guises, gain[:, None])[0]


def leads_at(fit: Fit, guises: list[Guise], gains: Floats) -> list[list[Lead]]:
    """The same at each of several gains (5, g): the starts of all share the lanes of one run of the predictor."""
    views = [_View(fit, gain) for gain in gains.T]
    found: list[list[Lead]] = [[] for _ in views]
    for guise in guises:
        starts = guise.scaled_starts()
        count = len(starts)
        problem, x = extend(fit, guise, np.tile(starts, (len(views), 1)))
        with np.errstate(all="ignore"):
            errors = problem.errors(x, np.repeat(gains, count, axis=1))
        for number, view in enumerate(views):
            lead = _lead(guise, starts, view, errors[:, number * count : (number + 1) * count])
            if lead is not None:
                found[number].append(lead)
    return [sorted(those, key=lambda lead: -lead.gain) for those in found]


class _View:
    """A fit through one observer: its errors (n,), what it reaches of them, and what is left."""

    def __init__(self, fit: Fit, gain: Floats) -> None:
        self.error, slope = fit.problem.jacobian(fit.x, gain)
        self.basis = swallowed(fit.problem, self.error, slope)
        self.rest = self.past(self.error)
        self.variance = float(self.rest @ self.rest) / len(self.rest)

    def past(self, change: Floats) -> Floats:
        """What the fit does not reach of a change of its predictions (n,) or (n, s)."""
        return np.asarray(change - self.basis @ (self.basis.T @ change), dtype=np.float64)


def swallowed(problem: ExtendedProblem, error: Floats, slope: Floats) -> Floats:
    """Orthonormal directions of the predictions that the model's unknowns reach. (n, k).

    What is known of an unknown from elsewhere (`ExtendedProblem.known`) counts as much as it is known: an unknown that
    the samples tell less of than that reaches nothing.
    """
    if problem.known is not None:
        telling = np.linalg.norm(slope[:, : problem.base], axis=0) * problem.known[1]
        unused = np.flatnonzero(telling <= np.sqrt(float(error @ error) / len(error)))
        slope = np.delete(slope, unused, axis=1)
    return spanned(slope)


def spanned(slope: Floats) -> Floats:
    """Orthonormal directions of the columns of slope (n, p) that are not zero. (n, k)"""
    scale = np.linalg.norm(slope, axis=0)
    basis, _ = np.linalg.qr(slope[:, scale > 0] / scale[scale > 0])
    return basis


def extend(fit: Fit, guise: Guise, starts: Floats) -> tuple[ExtendedProblem, Floats]:
    """The model of `fit` with one more effect, and its unknowns at the starting points (s, q): (s, size)."""
    problem = fit.problem.including((*fit.problem.guises, guise))
    x = np.zeros((len(starts), problem.size))
    x[:, : problem.base] = fit.x[: problem.base]
    for other in fit.problem.guises:
        x[:, problem.slot(other)] = fit.x[fit.problem.slot(other)]
    x[:, problem.slot(guise)] = starts
    x[:, problem.p :] = fit.x[fit.problem.p :]
    return problem, x


def _lead(guise: Guise, starts: Floats, view: _View, errors: Floats) -> Lead | None:
    """The starting point (of s) of `guise` whose response explains most of what is left, from their errors (n, s)."""
    change = errors - view.error[:, None]
    change = np.where(np.isfinite(change).all(axis=0), change, 0.0)
    size = np.einsum("ns,ns->s", change, change)
    change = view.past(change)
    left = np.einsum("ns,ns->s", change, change)
    usable = left > ABSORBED * np.maximum(size, 1e-300)
    if not usable.any():
        return None
    along, variance = -(view.rest @ change), view.variance
    if guise.wave is not None:
        return _wave_lead(guise, starts, change, along, left, variance)
    amplitude = guise.amplitude()
    stretch = along / np.maximum(left, 1e-300)
    low, high = guise.bounds()
    if amplitude is None:  # the effect is there in full or not at all: its start is what it is
        stretch = np.where(2.0 * along > left, 1.0, np.clip(stretch, 0.0, 1.0))
    else:
        unit = starts[:, amplitude]
        limits = np.stack([low[amplitude] / unit, high[amplitude] / unit])
        stretch = np.clip(stretch, limits.min(axis=0), limits.max(axis=0))
    with np.errstate(all="ignore"):
        gains = np.where(usable, (2.0 * along * stretch - stretch**2 * left) / variance, -np.inf)
    best = int(np.argmax(gains))
    start = starts[best].copy()
    if amplitude is not None:
        start[amplitude] *= stretch[best]
    return Lead(guise, start, float(gains[best]), change[:, best] / np.sqrt(left[best]))


def _wave_lead(
    guise: Guise, starts: Floats, change: Floats, along: Floats, left: Floats, variance: float
) -> Lead | None:
    """The wave length whose two quadratures together explain most."""
    best: Lead | None = None
    for k in range(0, len(starts), 2):
        pair = change[:, k : k + 2]
        normal = pair.T @ pair + 1e-12 * np.diag(left[k : k + 2] + 1e-300)
        mix = np.linalg.solve(normal, along[k : k + 2])
        gain = float(mix @ along[k : k + 2]) / variance
        if best is None or gain > best.gain:
            start = starts[k].copy()
            start[-2], start[-1] = mix[0] * starts[k][-2], mix[1] * starts[k + 1][-1]
            response = pair @ mix
            best = Lead(guise, start, gain, response / max(float(np.linalg.norm(response)), 1e-300))
    return best
