"""One sub-step of eq. (5) with set-valued friction: the piece of physics that simulator and fitter share.

Midpoint rule with the projection ("soft threshold") in both stages: second order, and a mass at rest stays exactly at
rest while the driving force stays within the static force (Moreau 1988; Acary & Brogliato 2008, ch. 1).
"""

from __future__ import annotations

from numba import njit

from plant.kernels.exponential import exp_neg

FASTMATH = {"contract", "nsz", "arcp"}  # no reassociation, no assumption of finiteness: results are reproducible


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def soft(q: float, level: float) -> float:
    """Force that is left of `q` after dry friction of `level`: 0 while |q| <= level. [N]."""
    return q - min(max(q, -level), level)


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def dry_level(speed: float, coulomb: float, bump: float, inverse_stribeck: float) -> float:
    """Level of dry friction at `speed` >= 0, eq. (2): alpha1 + alpha2 exp(-|v|/alpha3), never below 0. [N]."""
    return max(coulomb + bump * exp_neg(speed * inverse_stribeck), 0.0)


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def advance_velocity(
    v: float,
    force: float,
    mass_per_step: float,
    coulomb: float,
    bump: float,
    inverse_stribeck: float,
    viscous: float,
) -> float:
    """Velocity after one sub-step of length h under `force` (drive minus weight and constant force, mid-step) [m/s].

    `mass_per_step` is m_e/h [kg/s]; the other arguments are eq. (2): alpha1, alpha2, 1/alpha3, alpha4.
    """
    half = 0.5 * viscous
    q = (mass_per_step - half) * v + force
    inverse = 1.0 / (mass_per_step + half)
    ahead = soft(q, dry_level(abs(v), coulomb, bump, inverse_stribeck)) * inverse
    middle = 0.5 * abs(v + ahead)
    return soft(q, dry_level(middle, coulomb, bump, inverse_stribeck)) * inverse
