"""Binary coding of parameters, eq. (3)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def decode(code: Ints, low: Floats, high: Floats, bits: int = 8) -> Floats:
    """Values of `code` (..., p) between `low` and `high` (p,), eq. (3): low + (high - low)/(2^bits - 1) E."""
    return np.asarray(low + (high - low) / (2**bits - 1) * code, dtype=np.float64)


def encode(value: Floats, low: Floats, high: Floats, bits: int = 8) -> Ints:
    """Nearest codes of `value` (..., p); values outside the range take its ends."""
    width = np.where(high > low, high - low, 1.0)
    return np.asarray(np.rint(np.clip((value - low) / width, 0.0, 1.0) * (2**bits - 1)), dtype=np.int64)
