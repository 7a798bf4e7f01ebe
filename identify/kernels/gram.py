"""Sums of products of prediction errors and their differences: all that Gauss-Newton needs of n samples."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from plant.kernels.step import FASTMATH

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

TOGETHER = 4  # samples whose products are added at once: a quarter of the loads and stores of the sums


@njit(cache=True, fastmath=FASTMATH, error_model="numpy")
def gram(error: Floats, edges: Ints, lanes: int, products: Floats) -> None:
    """Sum the products of k points, run by run.

    Args:
        error: point 0's error, then its errors with one unknown moved each, then point 1's, ... [m] (n, >= k lanes)
        edges: first sample of each run, and the end. (runs + 1,)
        lanes: errors per point.
        products: filled with e e', where e is the point's error followed by its differences. (runs, k, lanes, lanes)
    """
    k = products.shape[1]
    products[:] = 0.0
    rows = np.empty((TOGETHER, lanes))
    for r in range(edges.shape[0] - 1):
        for j in range(k):
            sums = products[r, j]
            first = j * lanes
            for begin in range(edges[r], edges[r + 1], TOGETHER):
                have = min(edges[r + 1] - begin, TOGETHER)
                for s in range(TOGETHER):
                    if s < have:
                        base = error[begin + s, first]
                        rows[s, 0] = base
                        for i in range(1, lanes):
                            rows[s, i] = error[begin + s, first + i] - base
                    else:
                        rows[s, :] = 0.0
                for i in range(lanes):
                    a, b, c, d = rows[0, i], rows[1, i], rows[2, i], rows[3, i]
                    for q in range(lanes):
                        sums[i, q] += (a * rows[0, q] + b * rows[1, q]) + (c * rows[2, q] + d * rows[3, q])
