"""Noise that was logged with the force: it makes masses too large, and the motion is likelier without it."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from identify.mismatch.baseline import fit_baseline, read_torque
from identify.mismatch.data import gather
from identify.mismatch.force_error import native
from identify.mismatch.quiet import quieted, smooth
from identify.preprocess import prepare
from plant.recording import Recording
from tests.identify.small_machine import AXIS, HELD, MASS, driven, dry

UNKNOWN_MASS = replace(AXIS, mechanics=replace(AXIS.mechanics, inertia_known=False))


@pytest.fixture(scope="module")
def moves() -> Recording:
    """A machine of 20 N of dry friction, and the force that acted."""
    return driven(1, lambda t, y, v: (dry(v, 20.0), 0.0))  # noqa: ARG005


def logged(recording: Recording, noise: float) -> Recording:
    """The recording with white noise [N] on its force that the machine never felt."""
    return replace(recording, force=recording.force + noise * np.random.default_rng(7).standard_normal(len(recording.force)))


def mass_of(samples) -> float:
    """What the ordinary fit makes of the mass. [kg]"""
    found = fit_baseline(samples, UNKNOWN_MASS, 0)
    return next(value for name, _, value, _, _ in found.problem.named(found.x) if name == "moving_mass")


def test_white_noise_goes_and_every_impulse_stays():
    """Moves of half a second in noise of a fifth of their size; without noise, even a force that jumps stays."""
    t = np.linspace(0.0, 20.0, 2000)
    true = 50.0 * np.sin(2.0 * np.pi * 0.6 * t) + 20.0 * np.sign(np.sin(2.0 * np.pi * 0.23 * t))
    noisy = true + 8.0 * np.random.default_rng(3).standard_normal(len(t))
    found = smooth(noisy)
    assert np.std(found - true) < 0.45 * 8.0
    assert found.sum() == pytest.approx(noisy.sum())
    assert np.std(smooth(true) - true) < 1.0


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

    moved = driven(1, lambda t, y, v: (dry(v, 20.0), 0.0), delivers=delivers)  # noqa: ARG005
    recording = replace(moved, force=moved.force + noise[: len(moved.force)])
    assert not read_torque(gather([recording], AXIS), AXIS, False, 0)[0].quiet
