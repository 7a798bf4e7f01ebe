"""How much force the disturbance observer had to supply: what a fitted model leaves unexplained."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from identify.problem import FrictionProblem

Floats = NDArray[np.float64]

LEAST_NOISE = 0.05  # of the innovation's variance: some of it is always the sensor's


def latent_force(problem: FrictionProblem, x: Floats, gain: Floats) -> float:
    """Force that acted and that the model does not have, 0 where a free run is the likeliest [N or N·m].

    The observer's rho is over the sensor's noise alone, and that is the share 1 - L1 of the innovation's variance.

    Args:
        problem: what was fitted.
        x: where its search ended. (size,)
        gain: of the observer there. (5,)
    """
    error = problem.jacobian(x, gain)[0][problem.samples.valid]
    noise = float(np.sqrt(max(1.0 - gain[0], LEAST_NOISE) * np.mean(error**2)))
    return float(gain[4]) * noise * float(problem.law(x[None])[4, 0])
