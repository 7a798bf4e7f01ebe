"""How much force the disturbance observer had to supply: what a fitted model leaves unexplained."""

from __future__ import annotations

from typing import Any

import numpy as np

from identify.search import SearchResult

LEAST_NOISE = 0.05  # of the innovation's variance: some of it is always the sensor's


def latent_force(problem: Any, found: SearchResult) -> float:
    """Force that acted and that the model does not have: rho sigma m_e, 0 where a free run is the likeliest [N or N·m].

    Args:
        problem: a `FrictionProblem` or one that extends it.
        found: where its search ended.
    """
    error = problem.errors(found.x[None], found.gain)[:, 0][problem.samples.valid]
    sigma = float(np.sqrt(np.mean(error**2)))
    innovation = float(np.sqrt(max(1.0 - found.gain[0], LEAST_NOISE)))  # of the innovation, what is sensor noise
    return float(found.setting[1] * sigma * innovation * problem.law(found.x[None])[4, 0])
