"""exp(-x) and ln(x) that vectorise on every processor: the Stribeck term is most of the cost of a simulated step."""

from __future__ import annotations

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

# exp(r) = 1 + r s(r) on |r| <= ln(2)/2, s of degree 8 through expm1(r)/r at the nine Chebyshev nodes (divided
# differences in extended precision; tests/plant/test_exponential.py derives them anew): 4e-14 relative, and exactly 1
# at rest. Taylor needs degree 11 for 9e-15; two multiplications less are 10 % of a simulated step.
C2, C3, C4, C5, C6, C7, C8, C9 = (
    0.49999999999797934,
    0.16666666666648303,
    0.041666666890957035,
    0.008333333353716946,
    0.0013888821677626286,
    0.00019841208757195633,
    2.4876164024149295e-05,
    2.762510194150749e-06,
)


_intrinsic: Any = intrinsic  # its decorated functions are called without the first argument, which no type says


@_intrinsic
def _bits(typingctx: Any, value: Any) -> Any:  # noqa: ARG001
    """The 64 bits of a float, as an integer."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:  # noqa: ARG001
        return builder.bitcast(args[0], ir.IntType(64))

    return types.int64(types.float64), codegen


@_intrinsic
def _float(typingctx: Any, value: Any) -> Any:  # noqa: ARG001
    """The float whose 64 bits are `value`."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:  # noqa: ARG001
        return builder.bitcast(args[0], ir.DoubleType())

    return types.float64(types.int64), codegen


@njit(forceinline=True, fastmath={"contract", "nsz", "arcp"}, error_model="numpy")
def exp_neg(x: float) -> float:
    """exp(-x) for x >= 0, to 4e-14 relative; 1e-304 from x = 700 on. Branch-free, so LLVM vectorises it."""
    x = min(x, LARGEST)
    shifted = ROUND_TO_INTEGER - x * LOG2_E
    k = shifted - ROUND_TO_INTEGER
    r = (-x - k * LN2_HIGH) - k * LN2_LOW
    r2 = r * r
    r4 = r2 * r2
    low = (1.0 + r) + r2 * (C2 + r * C3)  # Estrin's order: a shorter chain than Horner's
    high = (C4 + r * C5) + r2 * (C6 + r * C7) + r4 * (C8 + r * C9)
    p = low + r4 * high
    value: float = _float(_bits(p) + (_bits(shifted) << np.int64(52)))
    return value


MANTISSA = 0x000FFFFFFFFFFFFF
ONE = 0x3FF0000000000000
SQRT2 = 1.4142135623730951
LN2 = 0.6931471805599453


@njit(forceinline=True, fastmath={"contract", "nsz", "arcp"}, error_model="numpy")
def ln(x: float) -> float:
    """Natural logarithm of a normal x > 0, to 1e-10 absolute. Branch-free, so LLVM vectorises it.

    x = 2^k m with m between sqrt(1/2) and sqrt(2), ln m = 2 artanh((m - 1)/(m + 1)) by its series.
    """
    bits = _bits(x)
    k = float((bits >> np.int64(52)) - np.int64(1023))
    m = _float((bits & np.int64(MANTISSA)) | np.int64(ONE))
    above = m > SQRT2
    m, k = (0.5 * m if above else m), (k + 1.0 if above else k)
    s = (m - 1.0) / (m + 1.0)
    q = s * s
    series = 1.0 + q * (1.0 / 3.0 + q * (0.2 + q * (1.0 / 7.0 + q * (1.0 / 9.0 + q * (1.0 / 11.0)))))
    value: float = k * LN2 + 2.0 * s * series
    return value


@njit(forceinline=True, fastmath={"contract", "nsz", "arcp"}, error_model="numpy")
def power(x: float, exponent: float) -> float:
    """A normal x > 0 to the power of `exponent`, to 1e-10 of it. Branch-free, so LLVM vectorises it."""
    value: float = exp_neg(-exponent * ln(x))
    return value
