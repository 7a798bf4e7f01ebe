"""cos(2 pi x) that vectorises on every processor, for ripples; the turn is the natural unit of a period."""

from __future__ import annotations

import math

from numba import njit

from plant.kernels.step import FASTMATH

# sin(z)/z in z^2 up to z^17: 4e-14 at z = pi/2.
S3, S5, S7, S9, S11, S13, S15, S17 = ((-1.0) ** k / math.factorial(2 * k + 1) for k in range(1, 9))
TWO_PI = 2.0 * math.pi


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def cos_turns(x: float) -> float:
    """Cosine of `x` turns, to 1e-13."""
    away = abs(x - math.floor(x + 0.5))  # 0 .. 0.5 turns from the crest
    z = TWO_PI * (0.25 - away)
    s = z * z
    p = S15 + s * S17
    p = S13 + s * p
    p = S11 + s * p
    p = S9 + s * p
    p = S7 + s * p
    p = S5 + s * p
    p = S3 + s * p
    return z + z * s * p
