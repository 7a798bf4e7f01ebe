"""The bar is where it must be, on deviates that are independent, alike in error, unequally certain, or few."""

import dataclasses

import numpy as np
import pytest

from monitor.glr import LONGEST, YEAR_NS, bar, common_bars, freedom, look, variances, widest
from monitor.moments import Fitted

STEPS = 365.25


def fit(correlation=0.0, spread=None):
    return Fitted(
        np.zeros((0 if spread is None else 1, 1)), np.zeros((1, 0, 0)) if spread is None else spread,
        np.ones(1), np.array([correlation]), np.zeros(1), np.ones(1), np.zeros(1), 1e9, 1e9,
    )  # fmt: skip


def alarms_per_year(residuals, height, fitted, looseness=None):
    """How often a new alarm begins, each followed by a fresh start."""
    count, begin = 0, 0
    for end in range(1, len(residuals) + 1):
        part = slice(max(begin, end - LONGEST), end)
        loose = np.ones((end - part.start, 1)) if looseness is None else looseness[part, None]
        looked = look(residuals[part, None], loose, np.zeros((end - part.start, 0)), fitted, 10**9)
        if np.abs(looked.t).max() > height:
            count, begin = count + 1, end
    return count / (len(residuals) / STEPS)


def test_a_known_healthy_number_passes_the_bar_as_often_as_set_or_less():
    rng = np.random.default_rng(1)
    rate = 20.0  # often, so that 25 years suffice
    often = alarms_per_year(rng.standard_normal(9000), bar(rate, STEPS, 1e9), fit())
    assert 0.3 * rate < often < 1.1 * rate


def test_neighbours_that_err_alike_do_not_raise_it_more_often():
    rng, rho, rate = np.random.default_rng(2), 0.5, 20.0
    x = rng.standard_normal(6000)
    for k in range(1, len(x)):
        x[k] = rho * x[k - 1] + np.sqrt(1 - rho**2) * x[k]
    told = alarms_per_year(x, bar(rate, STEPS, 1e9), fit(rho))
    assert told < 1.2 * rate
    assert alarms_per_year(x, bar(rate, STEPS, 1e9), fit(0.0)) > 1.5 * told  # what it would cost not to know


def test_an_uncertain_window_counts_less():
    rng, rate = np.random.default_rng(3), 20.0
    loose = rng.choice([1.0, 25.0], 5000)
    x = rng.standard_normal(5000) * np.sqrt(loose)
    assert alarms_per_year(x, bar(rate, STEPS, 1e9), fit(), loose) < 1.2 * rate


def test_a_window_that_does_not_tell_is_no_window():
    told = look(np.array([[1.0], [np.nan], [2.0]]), np.ones((3, 1)), np.zeros((3, 0)), fit(), 10**9)
    assert told.mean[:, 0] == pytest.approx([2.0, 2.0, 1.5])
    assert told.error[2, 0] == pytest.approx(np.sqrt(1 / 2), rel=1e-6)


def test_far_from_the_usual_temperature_less_is_known():
    spread = np.array([[[0.01]]])
    near, far = (
        look(np.zeros((4, 1)), np.ones((4, 1)), np.full((4, 1), x), fit(spread=spread), 10**9) for x in (0.0, 20.0)
    )
    assert (far.error > near.error).all()
    assert far.error[3, 0] == pytest.approx(np.sqrt(0.25 + 0.01 * 400), rel=1e-6)
    assert far.plain == pytest.approx(near.plain)


def test_few_windows_and_rare_alarms_raise_the_bar():
    assert bar(1.0, STEPS, 19) > bar(1.0, STEPS, 100) > bar(1.0, STEPS, 1e9) > bar(3.0, STEPS, 1e9)
    assert bar(1.0, 10 * STEPS, 1e9) > bar(1.0, STEPS, 1e9)
    assert pytest.approx(STEPS * 86400e9) == YEAR_NS


def test_what_few_blocks_tell_of_the_wandering_raises_the_bar_of_long_means_more_than_of_one_window():
    known = dataclasses.replace(fit(), wandering=np.full(1, 0.1), dof=60.0, wandering_dof=4.0)
    total = np.arange(1.0, LONGEST + 1)[:, None]
    dof = freedom(total, known, 80)[:, 0]
    assert dof[0] > 50 > 10 > dof[-1] > 4
    errors, most = (np.sqrt(of(total, known, 80)) for of in (variances, widest))

    def bars_with(dof):
        return common_bars(1.0, STEPS, errors, np.full(1, 1e-6), dof, most, 60.0)

    bars = bars_with(dof[:, None])
    assert (np.diff(bars[:, 0]) > 0).all()
    sure = bars_with(np.full((LONGEST, 1), 60.0))
    assert bars[-1, 0] > 1.3 * sure[-1, 0]
    assert bars[0, 0] < 1.1 * sure[0, 0]
    known = dataclasses.replace(known, most=np.full(1, 0.1))  # no axis wanders further than this one is believed to
    most = np.sqrt(widest(total, known, 80))
    assert bars_with(dof[:, None])[-1, 0] == pytest.approx(sure[-1, 0], rel=1e-6)
