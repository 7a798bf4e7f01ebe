"""Forces that no name stands for: functions of one coordinate, pulses, tones, seen through the predictor.

A residual force has to differentiate the position twice; at a millimetre of noise little is left of it. Here a small
force goes *into* the model instead, and its effect on the prediction errors is compared with the errors there are.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.mismatch.compare import Fit
from identify.preprocess import Samples
from plant.kernels.laws import LANES

Floats = NDArray[np.float64]

PUSH = 0.02  # of the dry friction: a force small enough to act in proportion
ABSORBED = 1e-4  # share of a response that must be left past the baseline


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """A fit's prediction errors at one observer gain, and what its own unknowns can do to them.

    Attributes:
        fit: model, and where its search ended.
        x: its unknowns on these samples. (size,)
        gain: of the observer. (4,)
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
        """See `fit` at observer gains (4,)."""
        error, slope = fit.problem.jacobian(fit.x, gain)
        scale = np.linalg.norm(slope, axis=0)
        basis, _ = np.linalg.qr(slope[:, scale > 0] / scale[scale > 0])
        rest = error - basis @ (basis.T @ error)
        return cls(fit, fit.x, gain, rest, basis, float(rest @ rest) / len(rest))

    def foreseen(self) -> Samples:
        """The samples with the positions that were predicted: they do not know the noise they are compared with."""
        samples = self.fit.problem.samples
        error = self.fit.problem.errors(self.x[None], self.gain)[:, 0]
        return replace(samples, position=samples.position - error)

    def responses(self, forces: Floats) -> Floats:
        """Change of the prediction errors per newton of each force series (n, q), past the unknowns. [m/N] (n, q)."""
        problem, size = self.fit.problem, PUSH * self.fit.dry_level
        start = problem.errors(self.x[None], self.gain)[:, :1].copy()
        found = np.empty_like(forces)
        for k in range(0, forces.shape[1], LANES):
            push = size * forces[:, k : k + LANES]
            lanes = np.repeat(self.x[None], push.shape[1], axis=0)
            with np.errstate(all="ignore"):
                found[:, k : k + LANES] = (problem.pushed(lanes, self.gain, push) - start) / size
        found = np.where(np.isfinite(found).all(axis=0), found, 0.0)
        whole = np.einsum("nq,nq->q", found, found)
        found -= self.basis @ (self.basis.T @ found)
        left = np.einsum("nq,nq->q", found, found)
        return np.where(left > ABSORBED * np.maximum(whole, 1e-300), found, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class Shape:
    """The force along a coordinate that the prediction errors ask for.

    Attributes:
        weights: newtons per probe. [N] (q,)
        evidence: twice the log marginal likelihood ratio against no force at all. [1]
        explained: change of the prediction errors that it takes away. [m] (n,)
    """

    weights: Floats
    evidence: float
    explained: Floats


def shape_of(view: View, responses: Floats) -> Shape:
    """Newtons of each probe under a common prior whose width is the likeliest.

    Args:
        view: where the errors come from.
        responses: of the probes. [m/N] (n, q)
    """
    normal = responses.T @ responses / view.variance
    along = -(responses.T @ view.error) / view.variance
    best: tuple[float, Floats] = (0.0, np.zeros(len(along)))
    for width in view.fit.dry_level * np.array([0.003, 0.01, 0.03, 0.1, 0.3]):
        posterior = normal + np.eye(len(along)) / width**2
        weights = np.linalg.solve(posterior, along)
        evidence = float(along @ weights) - float(np.linalg.slogdet(posterior * width**2)[1])
        if evidence > best[0]:
            best = evidence, weights
    return Shape(best[1], best[0], -(responses @ best[1]))
