"""How much force the disturbance observer had to supply: what a fitted model leaves unexplained."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from identify.observer import strength
from identify.problem import FrictionProblem

Floats = NDArray[np.float64]

LEAST_NOISE = 0.05  # of the innovation's variance: some of it is always the sensor's


def supplied_force(problem: FrictionProblem, x: Floats, gain: Floats, error: Floats) -> float:
    """Standard deviation of the observer's force, rho sigma m_e, for prediction errors (n,) [m]. [N or N·m]."""
    rho = strength(gain, problem.samples.sample_time)
    return rho * float(np.sqrt(np.mean(error**2))) * float(problem.law(x[None])[4, 0])


def latent_force(problem: FrictionProblem, x: Floats, gain: Floats) -> float:
    """Force that acted and that the model does not have, 0 where a free run is the likeliest [N or N·m].

    Args:
        problem: what was fitted.
        x: where its search ended. (size,)
        gain: of the observer there. (4,)
    """
    error = problem.errors(x[None], gain)[:, 0][problem.samples.valid]
    noise = float(np.sqrt(max(1.0 - gain[0], LEAST_NOISE)))  # of the innovation, what is sensor noise
    return noise * supplied_force(problem, x, gain, error)
