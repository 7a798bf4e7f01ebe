"""A machine solved by SciPy, and how far a model with its true numbers runs from it."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from identify.criterion import FREE
from identify.mismatch.extended import ExtendedProblem
from identify.mismatch.guise import Guise
from plant.axis import TorqueHold
from plant.recording import Recording

Floats = NDArray[np.float64]


def solved(
    slope: Callable[..., Sequence[float]], force: Floats, rate: int, states: int, seen: int, tolerance: float = 1e-9
) -> Recording:
    """What a sensor at the state number `seen` records, from rest at zero, under a `force` [N] held for each sample.

    Args:
        slope: derivative of the states at time, states and force.
        force: of the drive. [N] (n,)
        rate: of the samples. [1/s]
        states: how many there are.
        seen: which of them is recorded. [m]
        tolerance: relative, of the solver.
    """
    state, position = np.zeros(states), []
    for push in force:
        position.append(state[seen])
        state = solve_ivp(slope, (0.0, 1.0 / rate), state, args=(push,), rtol=tolerance, atol=1e-3 * tolerance).y[:, -1]
    t = np.arange(len(force)) / rate
    return Recording(t, force, np.array(position), sample_time=1.0 / rate, hold=TorqueHold.HOLD)


def missed(problem: ExtendedProblem, guise: Guise, viscous: float, coulomb: float = 0.0, **sizes: float) -> Floats:
    """Distance of a free run of the model with the friction [N s/m], [N] and `sizes` of `guise`, else 0. [m] (n,)"""
    friction = {"coulomb_force": coulomb, "static_force": coulomb, "viscous_coefficient": viscous}
    x = np.zeros((1, problem.size))
    x[0, : problem.base] = problem.encode(friction | {"constant_force": 0.0})[: problem.base]
    x[0, problem.slot(guise)] = [u.scaled(sizes.get(u.parameter, 0.0)) for u in guise.unknowns]
    return np.abs(problem.errors(x, FREE)[:, 0])
