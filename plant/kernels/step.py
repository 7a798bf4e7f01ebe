"""One sub-step of eq. (5) with set-valued friction: the piece of physics that simulator and fitter share.

Midpoint rule with the projection ("soft threshold") in both stages, velocity and way split where the velocity passes
through 0: second order, and a mass at rest stays exactly at rest while the driving force stays within the static force
(Moreau 1988; Acary & Brogliato 2008, ch. 1). The way of a mass that slides is that of a force that grows evenly: what
is left of its error is that of the velocity.
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
def sagging(ramp: float, steeper: float, mass_per_step: float) -> float:
    """How far the mean velocity lies below that of its ends where the force on a mass grows over the sub-step. [m/s].

    The drive grows by `ramp`, friction by `steeper` [N]: the acceleration bends the velocity, by a twelfth of its
    change times the sub-step. A force that is not straight counts as a straight one with its first moment.
    """
    return (1.0 / 12.0) * (ramp - steeper) / mass_per_step


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def turning(v: float, slide: float, restart: float, sag: float) -> tuple[float, float]:
    """Velocity at the end of a sub-step that may meet rest on its way, and its mean over the sub-step.

    `slide` is the velocity if friction kept opposing `v`. Where that has passed through 0, the mass came to rest after
    the fraction v/(v - slide) and started anew, towards `restart` had it begun at rest. Without this split a reversal
    under a force beyond the static one loses up to half a sub-step: first order, a millimetre in a fast sine; and a
    mass that comes to rest goes on for an eighth of the sub-step squared times what it was slowed by. One that slides
    all the time has its velocity bent by `sag` below the straight line.
    """
    slides = v * slide > 0.0
    rest = v / (v - slide) if v != 0.0 else 0.0
    ahead = slide if slides else (1.0 - rest) * restart
    mean = 0.5 * (v + slide) - sag if slides else 0.5 * (rest * v + (1.0 - rest) * ahead)
    return ahead, mean


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def advance_velocity(
    v: float,
    force: float,
    ramp: float,
    mass_per_step: float,
    coulomb: float,
    bump: float,
    inverse_stribeck: float,
    viscous: float,
) -> tuple[float, float]:
    """Velocity after one sub-step of length h under `force` (drive minus weight and constant force); its mean. [m/s].

    `force` is that at the middle, and grows by `ramp` from one end to the other [N]; `mass_per_step` is m_e/h [kg/s];
    the other arguments are eq. (2): alpha1, alpha2, 1/alpha3, alpha4.
    """
    half = 0.5 * viscous
    q = (mass_per_step - half) * v + force
    inverse = 1.0 / (mass_per_step + half)
    before = dry_level(abs(v), coulomb, bump, inverse_stribeck)
    ahead = soft(q, before) * inverse
    level = dry_level(0.5 * abs(v + ahead), coulomb, bump, inverse_stribeck)
    slide = (q - (level if v > 0.0 else -level)) * inverse
    more = 2.0 * (level - before)
    steeper = (more if v > 0.0 else -more) + viscous * (slide - v)
    return turning(v, slide, soft(force, level) * inverse, sagging(ramp, steeper, mass_per_step))
