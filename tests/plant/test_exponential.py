"""Where the coefficients of exp(-x) come from, and how good they are; and that the kernel really has vector code."""

import re

import numpy as np
import pytest
from numba import njit

from plant.kernels import exponential
from plant.kernels.exponential import exp_neg, ln, power
from plant.kernels.population import march

Long = np.longdouble
HALF = np.log(Long(2)) / 2
OURS = [1.0, 1.0, *(getattr(exponential, f"C{k}") for k in range(2, 10))]


def chebyshev_coefficients(degree):
    """exp(r) = 1 + r s(r): s interpolates expm1(r)/r at Chebyshev nodes of |r| <= ln(2)/2; powers ascending."""
    nodes = HALF * np.cos(np.pi * (np.arange(degree, dtype=Long) + Long(0.5)) / degree)
    divided = np.expm1(nodes) / nodes
    for k in range(1, degree):
        divided[k:] = (divided[k:] - divided[k - 1 : -1]) / (nodes[k:] - nodes[:-k])
    powers = np.zeros(degree, Long)
    for k in range(degree - 1, -1, -1):
        powers = np.concatenate([[Long(0)], powers[:-1]]) - nodes[k] * powers
        powers[0] += divided[k]
    return [1.0, *(float(c) for c in powers)]


def relative_error(coefficients):
    r = np.linspace(-1, 1, 20001).astype(Long) * HALF
    value = sum(Long(c) * r**k for k, c in enumerate(coefficients))
    return float(np.abs(value / np.exp(r) - 1).max())


@njit
def logarithms(x, out):
    for i in range(len(x)):
        out[i] = ln(x[i])


def test_the_logarithm_is_right_to_ten_digits():
    x = np.concatenate([np.geomspace(1e-12, 1e12, 20001), [0.5, 1.0, np.sqrt(0.5), np.sqrt(2.0), 2.0]])
    out = np.empty_like(x)
    logarithms(x, out)
    np.testing.assert_allclose(out, np.log(x), rtol=0.0, atol=1e-10)


@pytest.mark.skipif(np.finfo(Long).eps > 1e-18, reason="needs extended precision, which this processor does not have")
def test_the_coefficients_are_the_interpolation_they_say_they_are():
    derived = chebyshev_coefficients(9)
    np.testing.assert_allclose(OURS, derived, rtol=1e-9, atol=1e-15)
    assert relative_error(OURS) < 4e-14
    assert relative_error(chebyshev_coefficients(8)) > 1e-12  # one degree less would show


def test_the_exponential_is_exact_at_rest_and_calm_far_away():
    assert exp_neg(0.0) == 1.0
    assert exp_neg(1e-300) == 1.0
    assert 0.0 < exp_neg(1e300) < 1e-300
    assert 0.0 < exp_neg(np.inf) < 1e-300


@pytest.mark.parametrize("exponent", [-1.8, -0.5, 0.0, 0.5, 4.0])
def test_a_power_is_good_to_1e_9(exponent):
    x = np.logspace(-3, 2, 501)
    assert np.array([power(one, exponent) for one in x]) == pytest.approx(x**exponent, rel=1e-9)


def test_over_the_whole_range_it_is_good_to_4e_14():
    @njit
    def fill(x, out):
        for i in range(len(x)):
            out[i] = exp_neg(x[i])

    x = np.concatenate([np.random.default_rng(0).uniform(0, 50, 100_000), np.logspace(-12, 2.8, 10_000)])
    out = np.empty_like(x)
    fill(x, out)
    assert np.abs(out / np.exp(-x.astype(Long)) - 1).max() < 4e-14


def test_the_population_kernel_is_compiled_to_vector_instructions():
    fresh = njit(march.py_func, fastmath={"contract", "nsz", "arcp"}, error_model="numpy")
    m = 20
    law = np.ones((6, m))
    fresh(np.zeros(3), np.full(2, 0.01), 2, False, law, np.zeros(m), np.zeros(m), np.empty((3, m)))
    code = "".join(fresh.inspect_asm().values())
    packed = len(re.findall(r"\bv?(?:mul|add|sub|fma\w*|fmadd\w*)pd\b|\bfm(?:la|ul)\s+v\d+\.2d", code))
    assert packed > 20
