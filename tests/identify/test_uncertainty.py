"""The scatter of waves on problems with known answers; a slice of the coverage study (`make coverage` for all)."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom

from identify.gain_drift import gain_drift
from identify.identification import fit, identify_friction
from identify.preprocess import prepare
from identify.profile import alternatives
from identify.uncertainty import Uncertainty, uncertainty
from identify.waves import NORMAL, cosine_products, cosine_sums, wave_scatter
from tests.identify.studies.coverage import CASES, binomial, study
from tests.identify.studies.machines import Setting, coloured_noise, draw_case

REPEATS = 400


def linear_fits(correlation, rng, n=600, stroke=slice(None)):
    """Straight-line fits: errors and half-widths, in standard deviations, that the waves state. (REPEATS, 2) each

    Only the samples of `stroke` tell the slope.
    """
    design = np.stack([np.ones(n), np.zeros(n)], axis=1)
    design[stroke, 1] = np.linspace(-1, 1, n)[stroke]
    normal = design.T @ design
    errors, widths = [], []
    for _ in range(REPEATS):
        noise = coloured_noise(n, 1.0, correlation, rng)
        fit = np.linalg.solve(normal, design.T @ noise)
        left = noise - design @ fit
        variance = left @ left / (n - 2)
        widths.append(NORMAL * np.sqrt(np.diag(wave_scatter(left, design, variance, 1e-9 * np.eye(2)))))
        errors.append(fit)
    return np.abs(errors), np.array(widths)


@pytest.mark.parametrize("correlation", [0.0, 3.0, 8.0])
def test_nineteen_of_twenty_intervals_hold_the_truth_whatever_the_correlation(correlation):
    errors, widths = linear_fits(correlation, np.random.default_rng(1))
    held = (errors < widths).mean(axis=0)
    assert np.all(held > binom.ppf(1e-4, REPEATS, 0.95) / REPEATS)
    assert np.all(held < binom.ppf(1 - 1e-4, REPEATS, 0.95) / REPEATS)


def test_columns_that_act_in_one_run_alone_are_summed_as_all_others():
    """A recording with gaps has two unknowns for the start of each run, zero everywhere else."""
    rng = np.random.default_rng(4)
    slope = rng.standard_normal((900, 3 + 2 * 5 + 1))
    for run in range(5):
        slope[: 180 * run, 3 + 2 * run : 5 + 2 * run] = 0.0
        slope[180 * run + 40 :, 3 + 2 * run : 5 + 2 * run] = 0.0
    slope[:, -1] = 0.0
    dense = cosine_sums(slope[:, :, None] * slope[:, None, :], 25)
    assert np.allclose(cosine_products(slope, 25), dense, rtol=0.0, atol=1e-9)


def test_what_a_single_stroke_tells_gets_a_wide_interval_that_holds():
    """A tenth of the recording: white errors there, yet the waves know their size from two or three looks only."""
    stroke = slice(500, 560)
    errors, widths = linear_fits(0.0, np.random.default_rng(3), stroke=stroke)
    assert (errors[:, 1] < widths[:, 1]).mean() > 0.9
    scatter = np.sqrt(np.mean(errors[:, 1] ** 2))
    assert np.median(widths[:, 1]) > 1.2 * NORMAL * scatter


def test_what_is_known_from_elsewhere_tells_what_goes_with_it():
    """A lag and the clocks, whose sum is known: the lag is in doubt by no more than by what clocks differ."""
    apart = np.array([[1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 4.0]])
    wide = Uncertainty(2.25 * apart + 1e-4 * np.eye(3), np.zeros(3, dtype=bool), 10.0)
    told = wide.known(0, 0.1).covariance
    assert np.sqrt(told[0, 0]) == pytest.approx(0.1)
    assert np.sqrt(told[1, 1]) == pytest.approx(0.1, rel=0.01)
    assert np.sqrt(told[:2, :2].sum()) == pytest.approx(np.sqrt(2e-4), rel=0.2)  # of their sum
    assert told[2, 2] == wide.covariance[2, 2]
    assert wide.known(2, 4.0) is wide


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


def test_looking_along_the_valley_never_ends_on_a_worse_answer():
    """A window whose v_s is doubtful: refits with other v_s widen the interval, but the likeliest answer stays."""
    case = draw_case(8, Setting("loop", samples=1500))
    problem, found = fit(prepare(case.recording, case.axis), case.axis, np.random.default_rng(0))
    others = alternatives(problem, found.x, found.gain, uncertainty(problem, found.x, found.gain))
    assert others
    assert all(other.worse > 0.0 for other in others)
    result = identify_friction(case.recording, case.axis)
    assert result.parameters["coulomb_force"].value == pytest.approx(problem.named(found.x)[0][2], rel=1e-3)


def test_the_weakest_observers_are_held_against_a_stronger_one():
    """They have no weaker one in the table; what a stronger one says differently widens their intervals."""
    drifts = []
    for seed in range(6):
        case = draw_case(seed, Setting(noise=1e-3, samples=1500))
        problem, found = fit(prepare(case.recording, case.axis), case.axis, np.random.default_rng(seed))
        free = np.arange(problem.size)
        prior = np.diag(problem.prior[1] ** -2.0)
        if 0.0 < found.setting[1] < 31.0:
            drifts.append(gain_drift(problem, found.x, found.gain, free, prior))
    assert len(drifts) >= 4
    assert sum(bool(drift[:4].any()) for drift in drifts) >= len(drifts) / 2
