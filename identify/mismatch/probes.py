"""Forces that no name stands for: functions of one coordinate, pulses, tones, seen through the predictor.

A residual force has to differentiate the position twice; at a millimetre of noise little is left of it. Here a small
force goes *into* the model instead, and its effect on the prediction errors is compared with the errors there are.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.mismatch.compare import Fit
from identify.mismatch.score import swallowed
from identify.observer import gain_table
from identify.preprocess import Samples
from plant.kernels.laws import LANES

Floats = NDArray[np.float64]

PUSH = 0.02  # of the dry friction: a force small enough to act in proportion
WEAKER = 10.0, 100.0, np.inf  # times: observers that let more show
WIDTHS = np.array([0.003, 0.01, 0.03, 0.1, 0.3, 1.0])  # of the dry friction: forces that a shape may take
PASSES = 3  # between a shape's weights and the variance that is left of the errors
ABSORBED = 1e-4  # share of a response that must be left past the baseline


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """A fit's prediction errors at one observer gain, and what its own unknowns can do to them.

    Attributes:
        fit: model, and where its search ended.
        x: its unknowns on these samples. (size,)
        gain: of the observer. (5,)
        error: prediction errors past what the unknowns can do. [m] (n,)
        basis: orthonormal directions of the unknowns. (n, k)
        variance: of the errors. [m²]
    """

    fit: Fit
    x: Floats
    gain: Floats
    error: Floats
    basis: Floats
    variance: float

    @classmethod
    def of(cls, fit: Fit, gain: Floats) -> View:
        """See `fit` at observer gains (5,)."""
        error, slope = fit.problem.jacobian(fit.x, gain)
        basis = swallowed(fit.problem, error, slope)
        rest = error - basis @ (basis.T @ error)
        return cls(fit, fit.x, gain, rest, basis, float(rest @ rest) / len(rest))

    def foreseen(self) -> Samples:
        """The samples with the positions that were predicted: they do not know the noise they are compared with."""
        samples = self.fit.problem.samples
        error = self.fit.problem.errors(self.x[None], self.gain)[:, 0]
        return replace(samples, position=samples.position - error)

    def responses(self, forces: Floats) -> Floats:
        """Change of the prediction errors per newton of each force series (n, q), past the unknowns. [m/N] (n, q)."""
        with np.errstate(all="ignore"):
            found = self._changes("push", forces, PUSH * self.fit.dry_level)
        found = np.where(np.isfinite(found).all(axis=0), found, 0.0)
        whole = np.einsum("nq,nq->q", found, found)
        found -= self.basis @ (self.basis.T @ found)
        left = np.einsum("nq,nq->q", found, found)
        return np.where(left > ABSORBED * np.maximum(whole, 1e-300), found, 0.0)

    def shifted(self, shifts: Floats) -> Floats:
        """Change of the prediction errors per metre that the sensor errs by, past the unknowns. [1] (n, q)"""
        found = self._changes("shift", shifts, float(np.sqrt(self.variance)))
        return np.asarray(found - self.basis @ (self.basis.T @ found), dtype=np.float64)

    def _changes(self, disturbance: str, series: Floats, size: float) -> Floats:
        """Change of the prediction errors per unit of a `disturbance`, `size` times each series (n, q). (n, q)"""
        problem, found = self.fit.problem, np.empty_like(series)
        start = problem.errors(self.x[None], self.gain)[:, :1].copy()
        for k in range(0, series.shape[1], LANES):
            part = size * series[:, k : k + LANES]
            lanes = np.repeat(self.x[None], part.shape[1], axis=0)
            both = (part, None) if disturbance == "push" else (None, part)
            found[:, k : k + LANES] = (problem.disturbed(lanes, self.gain, *both) - start) / size
        return found


@dataclass(frozen=True, slots=True, eq=False)
class Outlook:
    """Fitted and unseen data seen through one observer, beside the likeliest one.

    A strong observer is likeliest where much is left out, and it swallows what is left out; a weaker one shows it.

    Attributes:
        here: the fitted data.
        there: the unseen data.
        behind: twice the log of how much likelier the fitted data are under the likeliest observer. [1]
        rival: the unseen data under that one.
    """

    here: View
    there: View
    behind: float
    rival: View

    def gained(self, change: Floats) -> Floats:
        """Twice the log-likelihood per unseen sample gained by a change (n,) of the errors, on the rival. (n,)"""
        error = self.there.error + change
        variance = float(error @ error) / len(error)
        likelier = float(np.log(self.rival.variance / variance))
        return likelier + self.rival.error**2 / self.rival.variance - error**2 / variance


def outlooks(fit: Fit, moved: Fit) -> list[Outlook]:
    """A fit, and the same model on unseen data, through the likeliest observer and through weaker ones.

    Through one too weak to hold it, a model that pushes itself away shows nothing.
    """
    gains, settings = gain_table(fit.problem.samples.sample_time)
    tau, rho = fit.found.setting
    chosen = [fit.found.gain]
    for times in WEAKER:
        weaker = np.flatnonzero((settings[0] == tau) & (settings[1] <= 1.01 * rho / times))
        gain = gains[:, weaker[-1]] if len(weaker) else gains[:, 0]
        if not any((gain == other).all() for other in chosen):
            chosen.append(gain)
    first, rival = View.of(fit, chosen[0]), View.of(moved, chosen[0])
    found = [Outlook(first, rival, 0.0, rival)]
    for gain in chosen[1:]:
        with np.errstate(all="ignore"):
            here, there = View.of(fit, gain), View.of(moved, gain)
        if np.isfinite([here.variance, there.variance]).all():
            behind = len(here.error) * float(np.log(here.variance / first.variance))
            found.append(Outlook(here, there, behind, rival))
    return found


@dataclass(frozen=True, slots=True, eq=False)
class Shape:
    """The force along a coordinate that the prediction errors ask for.

    Attributes:
        weights: newtons per probe. [N] (q,)
        evidence: twice the log marginal likelihood ratio against no force at all. [1]
    """

    weights: Floats
    evidence: float


def shape_of(view: View, responses: Floats) -> Shape:
    """Newtons of each probe under a common prior, with the width of the prior that is likeliest.

    The variance of the errors is estimated with the shape in, so that views at different gains can be compared.

    Args:
        view: where the errors come from.
        responses: of the probes. [m/N] (n, q)
    """
    normal, along = responses.T @ responses, -(responses.T @ view.error)
    best = Shape(np.zeros(len(along)), 0.0)
    for width in view.fit.dry_level * WIDTHS:
        variance = view.variance
        for _ in range(PASSES):
            posterior = normal / variance + np.eye(len(along)) / width**2
            weights = np.linalg.solve(posterior, along / variance)
            rest = view.variance - float(weights @ (2.0 * along - normal @ weights)) / len(view.error)
            variance = max(rest, 1e-9 * view.variance)
        likelier = len(view.error) * float(np.log(view.variance / variance))
        price = float(weights @ weights) / width**2 + float(np.linalg.slogdet(posterior * width**2)[1])
        if likelier - price > best.evidence:
            best = Shape(weights, likelier - price)
    return best
