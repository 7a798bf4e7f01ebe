from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from identify.criterion import FREE
from identify.observer import gain_table
from identify.polish import Linearised, _step, linearise, polish, polish_all, scatter
from identify.preprocess import prepare
from identify.problem import FrictionProblem
from identify.search import CLASSICAL
from tests.identify.studies.machines import Setting, draw_case


def problem(seed=0, **setting):
    case = draw_case(seed, Setting("sine", samples=1500, **setting))
    return FrictionProblem(prepare(case.recording, case.axis), case.axis)


def strong(one):
    gains, settings = gain_table(one.samples.sample_time)
    return gains[:, np.flatnonzero(settings[0] == 0.15)[3]]


def classical(one):
    x = np.zeros(one.size)
    x[:4] = CLASSICAL
    return x


def test_the_loss_of_a_linearised_point_is_the_problems_loss():
    one = problem()
    x = np.stack([classical(one), classical(one) + 0.05])
    gains = np.repeat(strong(one)[:, None], 2, axis=1)
    assert linearise(one, x, gains).loss == pytest.approx(one.losses(x, strong(one)), rel=1e-12)


def test_normal_equations_are_those_of_the_jacobian():
    one = problem()
    x = classical(one)
    model = linearise(one, x[None], strong(one)[:, None])
    error, slope = one.jacobian(x, strong(one))
    variance = error @ error / one.samples.used
    centre, spread = one.prior
    normal = slope.T @ slope / variance + np.diag(spread**-2.0)
    downhill = -slope.T @ error / variance - (x - centre) / spread**2
    assert model.normal[0] == pytest.approx(normal, rel=1e-9, abs=1e-9 * np.abs(normal).max())
    assert model.downhill[0] == pytest.approx(downhill, rel=1e-9, abs=1e-9 * np.abs(downhill).max())


def test_two_runs_have_starts_of_their_own():
    case = draw_case(0, Setting("sine", samples=1500))
    keep = np.r_[0:700, 760:1500]
    recording = case.recording
    recording = type(recording)(
        recording.t[keep], recording.force[keep], recording.position[keep], sample_time=recording.period
    )
    one = FrictionProblem(prepare(recording, case.axis), case.axis)
    assert one.samples.runs == 2
    model = linearise(one, classical(one)[None], strong(one)[:, None]).normal[0]
    first, second = slice(one.p, one.p + 2), slice(one.p + 2, one.p + 4)
    assert (model[first, second] == 0).all()
    assert (np.diag(model)[one.p :] > 0).all()


@pytest.mark.parametrize("seed", range(5))
def test_it_never_ends_higher_than_it_began_and_stays_within_bounds(seed):
    one = problem(seed)
    rng = np.random.default_rng(seed)
    low, high = one.bounds
    x = np.clip(classical(one) + rng.normal(size=(6, one.size)), low, high)
    for gain in (strong(one), FREE):
        ends = polish_all(one, x, gain, 10)
        assert (ends.loss <= one.losses(x, gain) + 1e-6).all()  # rounding of two ways to sum
        assert ((ends.x >= low) & (ends.x <= high)).all()


def test_points_side_by_side_end_where_each_would_alone():
    one = problem()
    x = np.stack([classical(one), classical(one) + 0.1, classical(one) - 0.1])
    together = polish_all(one, x, strong(one))
    for k in range(3):
        alone = polish(one, x[k], strong(one))
        assert together.loss[k] == pytest.approx(alone.loss, abs=1e-6)


def test_it_comes_to_rest_at_the_truth_of_clean_data():
    case = draw_case(1, Setting("sine", samples=1500, noise=1e-4, dirt=0.0))
    one = FrictionProblem(prepare(case.recording, case.axis), case.axis)
    ends = polish_all(one, classical(one)[None], strong(one))
    assert ends.rested.all()
    values = [value for _, _, value, _, _ in one.named(ends.x[0])[:2]]
    assert values == pytest.approx([case.truth["coulomb_force"], case.truth["static_force"]], rel=0.1)


def test_a_pinned_unknown_stays():
    one = problem()
    x = np.stack([classical(one), classical(one)])
    x[:, 2] = -2.0, -1.0
    ends = polish_all(one, x, strong(one), 5, pinned=2)
    assert ends.x[:, 2].tolist() == [-2.0, -1.0]
    assert (ends.x[:, 0] != x[:, 0]).all()


def test_a_race_ends_with_the_best_point_at_rest():
    one = problem()
    x = np.stack([classical(one), classical(one) + 0.3])
    race = polish_all(one, x, strong(one), 30, race=True)
    assert race.rested[race.best]
    assert race.evaluations <= polish_all(one, x, strong(one), 30).evaluations


@pytest.mark.parametrize("known", [1e3, 5e14])
def test_the_root_of_a_covariance_is_that_of_cholesky_and_none_is_refused(known):
    """A lift had unknowns of 0.4 beside some of 5e14: rounding made the covariance indefinite, Cholesky gave up."""
    turned = np.linalg.qr(np.random.default_rng(3).normal(size=(7, 7))).Q
    normal = turned @ np.diag(np.geomspace(0.4, known, 7)) @ turned.T
    covariance = np.linalg.pinv(normal, hermitian=True)
    root = scatter(normal)
    assert np.array_equal(root, np.tril(root))
    np.testing.assert_allclose(root @ root.T, covariance, atol=1e-9 * covariance.max())
    if known < 1e4:
        np.testing.assert_allclose(root, np.linalg.cholesky(covariance), rtol=1e-6, atol=1e-9)


def test_what_nothing_tells_does_not_scatter():
    normal = np.diag([4.0, 0.0, 25.0])
    np.testing.assert_allclose(scatter(normal) @ scatter(normal).T, np.diag([0.25, 0.0, 0.04]), atol=1e-15)


@pytest.mark.parametrize("seed", range(20))
def test_a_step_that_meets_a_bound_goes_on_along_it(seed):
    rng = np.random.default_rng(seed)
    k, size = 8, 6
    slope = rng.normal(size=(k, 12, size)) @ (rng.normal(size=(size, size)) + np.eye(size))
    normal = np.einsum("kni,knj->kij", slope, slope)
    low, high = np.full(size, -0.3), np.full(size, 0.4)
    x, downhill = rng.uniform(low, high, size=(k, size)), 20.0 * rng.normal(size=(k, size))
    x[:, 0] = high[0]
    now = Linearised(x, np.zeros(k), normal, downhill)
    step = _step(SimpleNamespace(bounds=(low, high), size=size), now, np.zeros(k), None)
    best = np.stack([x[i] + _bounded(normal[i], downhill[i], low - x[i], high - x[i]) for i in range(k)])
    held = (x >= high) & (downhill > 0)
    assert ((step >= low) & (step <= high)).all()
    assert (step[held] == x[held]).all()
    assert (now.promise(step) > 0).all()
    assert (now.promise(step) <= now.promise(best) + 1e-9).all()
    assert now.promise(step).sum() > 0.8 * now.promise(best).sum()


def _bounded(normal, downhill, low, high):
    """The step within bounds that gains most."""
    root = np.linalg.cholesky(normal)
    return lsq_linear(root.T, np.linalg.solve(root, downhill), (low, high), tol=1e-12).x


def test_a_bound_takes_nothing_from_what_a_step_promises():
    """Cut off where one of two unknowns may go no further, a step goes uphill: a polish hardly begun rested there."""
    normal = np.array([[[1.0, 0.99], [0.99, 1.0]]])
    wanted = np.array([[5.0, -4.9]])
    low, high = np.array([-10.0, -10.0]), np.array([0.1, 10.0])
    now = Linearised(np.zeros((1, 2)), np.zeros(1), normal, np.einsum("kij,kj->ki", normal, wanted))
    step = _step(SimpleNamespace(bounds=(low, high), size=2), now, np.zeros(1), None)
    assert now.promise(np.clip(wanted, low, high))[0] < 0.0 < now.promise(step)[0]
    assert step[0] == pytest.approx([0.1, now.downhill[0, 1] - 0.99 * 0.1])
