"""The scatter of blocks on problems with known answers; a slice of the coverage study (`make coverage` for all)."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom

from identify.uncertainty import block_scatter, is_white
from tests.identify.studies.coverage import CASES, binomial, study
from tests.identify.studies.machines import coloured_noise

REPEATS = 400


def linear_fits(correlation, rng, n=600):
    """Errors of a straight-line fit and the variances the scatter of blocks states. (REPEATS, 2) each"""
    design = np.stack([np.ones(n), np.linspace(-1, 1, n)], axis=1)
    normal = design.T @ design
    errors, variances = [], []
    for _ in range(REPEATS):
        noise = coloured_noise(n, 1.0, correlation, rng)
        fit = np.linalg.solve(normal, design.T @ noise)
        left = noise - design @ fit
        variance = left @ left / (n - 2)
        variances.append(np.diag(block_scatter(left, design, variance, 1e-9 * np.eye(2), 12)))
        errors.append(fit)
    return np.array(errors), np.array(variances)


@pytest.mark.parametrize("correlation", [0.0, 3.0, 8.0])
def test_the_scatter_of_blocks_states_the_true_variance_whatever_the_correlation(correlation):
    errors, variances = linear_fits(correlation, np.random.default_rng(1))
    ratio = variances.mean(axis=0) / errors.var(axis=0)
    assert np.all(ratio > 0.75)
    assert np.all(ratio < 1.5)


def test_a_block_that_carries_all_the_information_widens_the_interval():
    rng = np.random.default_rng(2)
    slope = np.full((500, 1), 1e-3)
    spread_out = slope.copy()
    slope[200:210] = np.sqrt(50.0) * 1.0
    spread_out[:] = 1.0
    noise = rng.standard_normal(500)
    alone = block_scatter(noise, slope, 1.0, 1e-9 * np.eye(1), 10)[0, 0]
    together = block_scatter(noise, spread_out, 1.0, 1e-9 * np.eye(1), 10)[0, 0]
    assert alone > 20 * together


def test_white_and_coloured_errors_are_told_apart():
    rng = np.random.default_rng(4)
    assert sum(is_white(rng.standard_normal(1500)) for _ in range(100)) >= 94
    assert not any(is_white(coloured_noise(1500, 1.0, 1.0, rng)) for _ in range(50))
    assert not is_white(np.zeros(100))


def test_binomial_intervals_hold_the_rate():
    low, high = binomial(950, 1000)
    assert low < 0.95 < high
    assert high - low < 0.03
    assert binomial(0, 10)[0] == 0.0
    assert binomial(10, 10)[1] == 1.0


SLICE = ("white noise, open loop, hold", "dirt 0.5 %, closed loop", "dirt 2 %", "coloured noise (50 ms), dirt 0.5 %",
         "dirt 0.5 %, mass unknown")  # fmt: skip
WINDOWS = 8


def test_intervals_cover_over_a_slice_of_the_study():
    """Parameters of one window err together, so windows are counted: 40 of them, five or six parameters each."""
    shares = []
    band = []
    for label in SLICE:
        for window in study(replace(CASES[label], samples=1500), range(WINDOWS)):
            assert window.verdict == "identified"
            shares.append(np.nanmean(list(window.hits.values())))
            band.append(np.mean(window.band))
    # 95 % intervals: so few over 40 windows happens once in a thousand even were a window one draw
    worst = binom.ppf(1e-3, len(shares), 0.95) / len(shares)
    assert np.mean(shares) > worst
    assert np.mean(band) > worst
