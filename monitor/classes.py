"""Wear or lubrication? A change of friction is told apart by its shape over speed. Pure.

Worn or dirty guides rub harder at every speed; a lubricant acts through its film: with speed where the film carries, at
low speed where it fails. Less friction than before is a matter of lubrication (or of running in), never of wear.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from monitor.baseline import Baseline
from plant.recording import Floats

MISFIT = 0.01  # of friction: no change follows its textbook shape more closely
WEAR = ("dry friction", "Coulomb level")
PRIOR = 0.25  # four shapes, alike before anything was measured


@dataclass(frozen=True, slots=True)
class Classification:
    """How well each shape explains a change.

    Attributes:
        wear: probability-like score of wear against lubrication. [1]
        shape: the best of `shapes`.
        shapes: score of each. [1]
    """

    wear: float
    shape: str
    shapes: dict[str, float]


def shapes_of(baseline: Baseline) -> dict[str, Floats]:
    """Unit changes of friction at the reference speeds."""
    v, v_s = np.array(baseline.speeds), baseline.stribeck_velocity
    return {
        "dry friction": np.ones_like(v),
        "Coulomb level": -np.expm1(-v / v_s),
        "viscous friction": v / v[-1],
        "low-speed friction": np.exp(-v / v_s),
    }


def classify(baseline: Baseline, change: Floats, covariance: Floats) -> Classification:
    """Compare the shapes by generalised least squares, one amplitude each.

    Args:
        baseline: with the reference speeds.
        change: of friction there. [N or N·m] (REFERENCES,)
        covariance: of `change`. (REFERENCES, REFERENCES)
    """
    tolerance = np.diag((MISFIT * np.array(baseline.friction)) ** 2)
    inverse = np.linalg.pinv(covariance + tolerance)
    weights, amplitudes = {}, {}
    for name, shape in shapes_of(baseline).items():
        amplitudes[name] = float(shape @ inverse @ change / (shape @ inverse @ shape))
        rest = change - amplitudes[name] * shape
        weights[name] = float(rest @ inverse @ rest)  # misfit, chi-square like
    least = min(weights.values())
    weights = {name: PRIOR * float(np.exp(-min(misfit - least, 200.0) / 2)) for name, misfit in weights.items()}
    total = sum(weights.values())
    scores = {name: weight / total for name, weight in weights.items()}
    wear = sum(scores[name] for name in WEAR if amplitudes[name] > 0)
    return Classification(wear, max(scores, key=lambda name: scores[name]), scores)
