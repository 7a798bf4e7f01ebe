"""What the resolution of the force may do to the answer.

A drive reports its force in steps, of a per mille of the rated force for instance. What a reading leaves out is the
same whenever a motion that repeats comes by, so it does not average out and no scatter within the window shows it. Here
every reading leaves out something of its own, uniform within a step, wherever it occurs.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from identify.problem import FrictionProblem

Floats = NDArray[np.float64]

LOOKS = 2  # patterns that show whether the resolution matters
PATTERNS = 8  # patterns where it does: the scatter is then known to a quarter
MATTERS = 0.1  # standard errors


def rounding_scatter(problem: FrictionProblem, x: Floats, gain: Floats, towards: Floats, variance: Floats) -> Floats:
    """Covariance (q, q) of some unknowns through the resolution of the force; all zero where it does not matter.

    Args:
        problem: what was fitted.
        x: its optimum. (size,)
        gain: of the observer there. (5,)
        towards: what a change of the prediction errors moves those unknowns by. [1/m] (q, n)
        variance: of those unknowns for all other reasons. (q,)
    """
    step = problem.axis.drive.force_resolution
    scatter = np.zeros((len(towards), len(towards)))
    if step <= 0.0:
        return scatter
    force = problem.samples.force
    readings, code = np.unique(np.round(force / step), return_inverse=True)
    error, _ = problem.jacobian(x, gain)
    for number in range(PATTERNS):
        left_out = np.random.default_rng(number).uniform(-0.5 * step, 0.5 * step, len(readings))
        other = problem.masked(dataclasses.replace(problem.samples, force=force + left_out[code]))
        moved = towards @ (other.errors(x[None], gain)[:, 0] - error)
        scatter += np.outer(moved, moved)
        if number == LOOKS - 1 and (np.diag(scatter) < LOOKS * MATTERS**2 * variance).all():
            return np.zeros_like(scatter)
    return scatter / PATTERNS
