"""Noise that was logged with the force: it makes masses too large, and the motion is likelier without it."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from identify.mismatch import baseline
from identify.mismatch.baseline import fit_baseline, read_torque
from identify.mismatch.compare import Fit
from identify.mismatch.data import gather
from identify.mismatch.force_error import native
from identify.mismatch.quiet import quieted, smooth
from identify.mismatch.residual import setting_of
from identify.mismatch.score import extend
from identify.mismatch.ways import guises
from identify.preprocess import prepare
from plant.effects import find
from plant.recording import Recording
from tests.identify.small_machine import AXIS, HELD, MASS, driven, dry

Floats = NDArray[np.float64]

UNKNOWN_MASS = replace(AXIS, mechanics=replace(AXIS.mechanics, inertia_known=False))


@pytest.fixture(scope="module")
def moves() -> Recording:
    """A machine of 20 N of dry friction, and the force that acted."""
    return driven(1, lambda t, y, v: (dry(v, 20.0), 0.0))


def logged(recording: Recording, noise: float) -> Recording:
    """The recording with white noise [N] on its force that the machine never felt."""
    return replace(
        recording, force=recording.force + noise * np.random.default_rng(7).standard_normal(len(recording.force))
    )


def mass_of(samples) -> float:
    """What the ordinary fit makes of the mass. [kg]"""
    found = fit_baseline(samples, UNKNOWN_MASS, 0)
    return next(value for name, _, value, _, _ in found.problem.named(found.x) if name == "moving_mass")


def moves_and_rests() -> Floats:
    """A force that speeds an axis up for 0.1 s, holds it for 0.4 s, and slows it down, either way. [N] (4000,)"""
    k = np.arange(4000)
    cycle, way = k % 500, np.where(k // 500 % 2, -1.0, 1.0)
    return way * (20.0 + 60.0 * (cycle < 10) - 60.0 * ((cycle >= 50) & (cycle < 60)) - 20.0 * (cycle >= 60))


def test_white_noise_goes_where_little_happens_and_edges_stay():
    """Moves with waits in between: of 5 N less than 1.2 are left while nothing happens, less than 3 N in all."""
    true = moves_and_rests()
    found = smooth(true + 5.0 * np.random.default_rng(3).standard_normal(len(true)))
    cycle = np.arange(len(true)) % 500
    calm = (cycle > 130) & (cycle < 430)
    assert np.std((found - true)[calm]) < 1.2
    assert np.std(found - true) < 3.0
    assert abs((found - true).mean()) < 0.5


def test_a_force_without_noise_stays_as_it_is():
    """It is the same to the last digit where no noise can be told, and to a thousandth with a millinewton of it."""
    true = moves_and_rests()
    assert np.array_equal(smooth(true), true)
    noisy = true + 1e-3 * np.random.default_rng(3).standard_normal(len(true))
    assert np.abs(smooth(noisy) - true).max() < 5e-3


def test_short_runs_keep_their_noise(moves):
    """What noise is, and what happened, is told by many samples."""
    samples = prepare(moves, AXIS).part(0, 80)
    assert np.array_equal(quieted(samples).force, samples.force)


def test_noise_of_the_log_makes_no_mass_larger_once_it_is_taken_out(moves):
    """With 15 N in the log of 10.5 kg; half of what was too much, or less, is left."""
    samples = prepare(logged(moves, 15.0), UNKNOWN_MASS)
    too_large = mass_of(samples) - MASS
    assert too_large > 0.15 * MASS
    assert abs(mass_of(quieted(samples)) - MASS) < 0.5 * too_large


@pytest.mark.parametrize(("noise", "quiet"), [(0.0, False), (5.0, True)])
def test_the_noise_of_the_log_is_taken_out_where_the_motion_is_likelier_so(moves, noise, quiet):
    """Said among what preprocessing did, in newtons; figures of the literature are those of the force as logged."""
    recording = logged(moves, noise)
    gathered = gather([recording], AXIS)
    evidence, fitted = read_torque(gathered, AXIS, False, 0)
    assert evidence.quiet is quiet
    assert any("noise of the logged force taken out" in line for line in evidence.removed) is quiet
    assert np.array_equal(evidence.train.force, gathered.train.force) is not quiet
    assert np.array_equal(fitted.problem.samples.force, evidence.train.force)
    parts = native([recording], AXIS, evidence)
    assert np.array_equal(np.concatenate([part.force for part in parts.train]), gathered.train.force)


def test_noise_that_the_machine_felt_stays():
    """It is in the log, and the drive gives it: 15 N, a new one every 10 ms."""
    noise, steps = 15.0 * np.random.default_rng(5).standard_normal(2001), itertools.count()

    def delivers(told: float, _: float) -> float:
        return told + noise[next(steps) // HELD]

    moved = driven(1, lambda t, y, v: (dry(v, 20.0), 0.0), delivers=delivers)
    recording = replace(moved, force=moved.force + noise[: len(moved.force)])
    assert not read_torque(gather([recording], AXIS), AXIS, False, 0)[0].quiet


@pytest.mark.parametrize(("delay", "asked"), [(0.0002, 0), (0.02, 3)])
def test_clocks_that_are_a_little_apart_do_not_grow_into_a_dead_time_by_reading_the_torque_anew(
    monkeypatch, delay, asked
):
    """Straight between samples comes half a period earlier than held: 2 % of one became a half (BG-0037)."""
    gathered = gather([driven(1, lambda t, y, v: (dry(v), 0.0), 6.0)], AXIS)
    bare = fit_baseline(gathered.train, AXIS, 0)
    setting = setting_of(bare.problem, bare.x, 0.01)
    late = guises({"dead_time": find("dead_time")}, setting)[0]
    problem, x = extend(bare, late, np.array([[late.unknown("delay").scaled(delay)]]))
    chosen = Fit(problem, replace(bare.found, x=x[0]))
    tried = []

    def refit(problem, points):
        tried.append(tuple(guise.name for guise in problem.guises))
        return Fit(problem, replace(bare.found, x=points[0]))

    monkeypatch.setattr(baseline, "fit", refit)
    monkeypatch.setattr(baseline, "fit_baseline", lambda *_: bare)
    baseline.read_again(gathered, gathered, chosen, 0)
    assert tried.count(("dead_time",)) == asked
    assert tried[:3] == [(), (), ()]
