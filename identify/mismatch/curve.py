"""Friction's own curve: how it falls with speed, whose shape eq. (1) fixes and no machine asked for.

exp(-|v|/v_s) is one of many laws in use; Gaussian and other exponents are as common (Armstrong-Helouvry et al. 1994).
What another exponent leaves beside eq. (1) looks like a little mass, a little presliding, a force along the speed. No
physics that is missing, and never named: a nuisance that is taken into account where it is the likeliest.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from identify.mismatch.guise import Guise, Unknown
from identify.mismatch.nameless import Structure
from plant.effects.effect import Effect, Parameter

if TYPE_CHECKING:
    from identify.mismatch.compare import Fit
    from plant.machine import Machine

Floats = NDArray[np.float64]

CURVE = "stribeck_exponent"
RISING = "rising_friction"
RISES, CERTAIN = 0.15, 10.0  # of F_c that F_s lies below it, and its z: no healthy machine of three authors has any
BENDS = (-0.7, 1.1)  # logarithm of the exponent: from 0.5 to 3


def _exponent(values: Floats, machine: Machine) -> Floats:
    machine.exponent = np.exp(values[0])
    return values[:0]


def _rate(values: Floats, machine: Machine, speed: float) -> Floats:  # noqa: ARG001
    _, _, stribeck, _ = machine.friction
    slope: Floats = np.exp(np.abs(values[0])) * abs(machine.friction[1] - machine.friction[0]) / stribeck
    return slope / machine.mass


EXPONENT = Effect(
    name=CURVE,
    parameters=(Parameter("bend", "1", BENDS, absent=0.0, about="logarithm of the exponent of |v|/v_s"),),
    prepare=_exponent,
    rate=_rate,
    source="Armstrong-Helouvry, Dupont & Canudas de Wit 1994, Automatica 30",
)


def curve() -> Guise:
    """Another exponent than 1 in eq. (1)."""
    return Guise(EXPONENT, (Unknown("bend", 0.3, *BENDS),), np.array([[0.1]]), depends="velocity")


def rising(fitted: Fit, reached: tuple[float, float]) -> Structure | None:
    """Dry friction that rises with speed and levels off, between the speeds that were `reached`.

    Eq. (1) imitates it with a static friction below the sliding one: nothing is left, and yet no such machine is known.
    """
    static = fitted.x[1] - fitted.x[0]
    known = fitted.spread.covariance[:2, :2]
    sure = float(-static / np.sqrt(max(known[0, 0] + known[1, 1] - 2.0 * known[0, 1], 1e-300)))
    if fitted.spread.at_bound[:2].any() or -static < RISES * fitted.x[0] or sure < CERTAIN:
        return None
    force = float(-static * fitted.problem.scales.force)
    return Structure("velocity", reached, sure**2, sure, force, RISING)
