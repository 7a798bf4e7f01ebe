"""Jams that build up, contacts that age ever more slowly, bristles in parallel: the same names, another shape."""

import math

import numpy as np
import pytest

from identify.mismatch.diagnosis import diagnose
from identify.mismatch.written import BENT
from tests.identify.small_machine import AXIS, STEP, driven, dry

SHARES = (0.4, 0.3, 0.2, 0.1)  # of the friction that each bristle bears
STIFFNESSES = (9e3, 4e3, 2e3, 1e3)  # N/m of each
A, TAU, SLIP = 9.0, 0.05, 2e-3  # N, s, m: stiction grows by A ln(1 + t/TAU), and goes with some slips


def test_a_jam_that_builds_up_is_a_step_of_its_size_and_keeps_its_moment():
    """As a sudden one it had two thirds of its size, and a step at another moment beside it."""
    jam = lambda t, y, v: (dry(v) + 8.0 * np.clip((t - 7.0) / 1.5, 0.0, 1.0), 0.0)  # noqa: E731
    found = diagnose([driven(1, jam)], AXIS)
    (effect,) = found.effects
    assert effect.name == "step_change"
    low, high = effect.parameters["step"].ci95
    assert low < 8.0 < high
    assert effect.parameters["step"].value == pytest.approx(8.0, rel=0.1)
    first, last = effect.parameters["time"].ci95
    assert 6.5 < first < 7.2  # it begins
    assert 8.3 < last < 9.0  # it is over
    assert BENT.format("step_change") in found.preprocessing


class Ageing:
    """Contacts whose friction grows with the logarithm of the rest."""

    def __init__(self):
        self.age = 0.0

    def __call__(self, t, y, v):
        """Friction level and force. [N]"""
        self.age = self.age + STEP / TAU if v == 0.0 else self.age * math.exp(-abs(v) * STEP / SLIP)
        return dry(v) + A * math.log1p(self.age), 0.0


class Bristles:
    """Springs in parallel, each of which slides at its share of the friction (Maxwell slip)."""

    def __init__(self):
        self.force = np.zeros(len(SHARES))

    def __call__(self, t, y, v):
        """Friction level, which is none, and force. [N]"""
        most = dry(v) * np.array(SHARES)
        self.force = np.clip(self.force + np.array(STIFFNESSES) * v * STEP, -most, most)
        return 0.0, float(self.force.sum())


def test_contacts_that_age_with_the_logarithm_of_the_rest_are_stiction():
    found = diagnose([driven(seed, Ageing()) for seed in (1, 2)], AXIS)
    assert [effect.name for effect in found.effects] == ["dwell_time_stiction"]


def test_bristles_in_parallel_are_bristles_that_nothing_damps():
    """They have no slope where none is; what bends like them led to nothing, and their damping ended on a bound."""
    found = diagnose([driven(seed, Bristles()) for seed in (1, 2)], AXIS)
    (effect,) = found.effects
    assert effect.name == "presliding_hysteresis"
    stiffness = effect.parameters["bristle_stiffness"]
    assert 3e3 < stiffness.value < 2e4
    assert effect.parameters["bristle_damping"].ci95[0] == 0.0
