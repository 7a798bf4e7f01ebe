"""exp(-x) that vectorises on every processor: the Stribeck term is most of the cost of a simulated step."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic

LOG2_E = 1.4426950408889634
LN2_HIGH = 6.93147180369123816490e-01  # ln 2 split in two so that the reduced argument is exact (Cody & Waite 1980)
LN2_LOW = 1.90821492927058770002e-10
ROUND_TO_INTEGER = 6755399441055744.0  # 1.5 * 2^52: adding it leaves the rounded integer in the low mantissa bits
LARGEST = 700.0  # exp(-700) = 1e-304: beyond it the friction law has no bump left

# Taylor coefficients 1/k! up to k = 11: below 2e-16 relative for |r| <= ln(2)/2.
C = tuple(1.0 / math.factorial(k) for k in range(12))
C2, C3, C4, C5, C6, C7, C8, C9, C10, C11 = C[2:]


@intrinsic
def _bits(typingctx: Any, value: Any) -> Any:  # noqa: ARG001
    """The 64 bits of a float, as an integer."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:  # noqa: ARG001
        return builder.bitcast(args[0], ir.IntType(64))

    return types.int64(types.float64), codegen


@intrinsic
def _float(typingctx: Any, value: Any) -> Any:  # noqa: ARG001
    """The float whose 64 bits are `value`."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:  # noqa: ARG001
        return builder.bitcast(args[0], ir.DoubleType())

    return types.float64(types.int64), codegen


@njit(forceinline=True, fastmath={"contract", "nsz", "arcp"}, error_model="numpy")
def exp_neg(x: float) -> float:
    """exp(-x) for x >= 0, to 1e-15 relative; 1e-304 from x = 700 on. Branch-free, so LLVM vectorises it."""
    x = min(x, LARGEST)
    shifted = ROUND_TO_INTEGER - x * LOG2_E
    k = shifted - ROUND_TO_INTEGER
    r = (-x - k * LN2_HIGH) - k * LN2_LOW
    p = C10 + r * C11
    p = C9 + r * p
    p = C8 + r * p
    p = C7 + r * p
    p = C6 + r * p
    p = C5 + r * p
    p = C4 + r * p
    p = C3 + r * p
    p = C2 + r * p
    p = 1.0 + r * (1.0 + r * p)
    return _float(_bits(p) + (_bits(shifted) << np.int64(52)))
