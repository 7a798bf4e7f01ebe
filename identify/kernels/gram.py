"""Sums of products of prediction errors and their differences: all that Gauss-Newton needs of n samples."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from plant.kernels.step import FASTMATH

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@njit(cache=True, fastmath=FASTMATH, error_model="numpy")
def gram(error: Floats, run: Ints, lanes: int, row: Floats, products: Floats) -> None:
    """Sum the products of k points, run by run.

    Args:
        error: point 0's error, then its errors with one unknown moved each, then point 1's, ... [m] (n, >= k lanes)
        run: index of the run a sample belongs to, ascending from 0. (n,)
        lanes: errors per point.
        row: scratch. (lanes,)
        products: filled with e e', where e is the point's error followed by its differences. (runs, k, lanes, lanes)
    """
    k = products.shape[1]
    products[:] = 0.0
    for t in range(error.shape[0]):
        sums = products[run[t]]
        for j in range(k):
            first = j * lanes
            base = error[t, first]
            row[0] = base
            for i in range(1, lanes):
                row[i] = error[t, first + i] - base
            for i in range(lanes):
                factor = row[i]
                for q in range(lanes):
                    sums[j, i, q] += factor * row[q]
