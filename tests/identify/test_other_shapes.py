"""Jams that build up, contacts that age ever more slowly, bristles in parallel: the same names, another shape."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from identify.mismatch.baseline import fit_baseline
from identify.mismatch.diagnosis import diagnose
from identify.mismatch.explore import explore
from identify.mismatch.own_curves import _slower
from identify.mismatch.report_values import measured, quantities
from identify.mismatch.residual import setting_of
from identify.mismatch.uncatalogued import uncatalogued
from identify.mismatch.ways import guises
from identify.mismatch.written import BENT
from identify.preprocess import prepare
from plant.effects import find, names
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


@pytest.mark.parametrize(("slows", "slides"), [(0.0, 0.0), (3.0, 0.0), (0.0, 0.4), (6.0, 1.0)])
def test_contacts_age_and_slip_as_scipy_solves_them(slows, slides):
    """Over two time constants of rest, then a fifth of a slip length."""
    aged = solve_ivp(lambda _, x: (1.0 - x) ** (1.0 + slows), (0.0, 2.0), [0.1], rtol=1e-10, atol=1e-12).y[0, -1]
    slipped = solve_ivp(lambda _, x: -(x ** (1.0 - slides)), (0.0, 0.2), [aged], rtol=1e-10, atol=1e-12).y[0, -1]
    assert _slower.py_func(0.1, 0.0, 2.0, 0.0, slows, slides) == pytest.approx(aged, rel=1e-6)
    assert _slower.py_func(aged, 0.0, 0.0, 0.2, slows, slides) == pytest.approx(slipped, rel=1e-6)


def test_contacts_that_age_with_the_logarithm_of_the_rest_are_stiction():
    """The exponential explains so much less that a torque limit was named beside it."""
    fitted, unseen = (prepare(driven(seed, Ageing()), AXIS) for seed in (1, 2))
    baseline = fit_baseline(fitted, AXIS, 0)
    ways = guises({"dwell_time_stiction": find("dwell_time_stiction")}, setting_of(baseline.problem, baseline.x))
    _, (bent, *_) = explore(baseline, ways, unseen)
    _, (own, *_) = explore(baseline, [replace(way, freed=None) for way in ways], unseen)
    assert bent.refused is None
    assert bent.guise.shapes == ("slows", "slides")
    assert bent.evidence.bic < 1.5 * own.evidence.bic
    assert bent.evidence.foreseen > 1.5 * own.evidence.foreseen
    assert bent.evidence.unseen < 0.3 * own.evidence.unseen


def test_bristles_in_parallel_are_bristles_that_nothing_damps():
    """They have no slope where none is; what bends like them led to nothing, and their damping ended on a bound."""
    fitted, unseen = (prepare(driven(seed, Bristles(), seconds=10.0), AXIS) for seed in (1, 2))
    baseline = fit_baseline(fitted, AXIS, 0)
    setting = setting_of(baseline.problem, baseline.x)
    ways = guises({"presliding_hysteresis": find("presliding_hysteresis")}, setting)
    _, (best, *_) = explore(baseline, [*ways, *uncatalogued(setting, names())], unseen)
    assert best.guise.name == "presliding_hysteresis"
    assert best.refused is None
    sizes = quantities(measured(best.fit), best.guise)
    assert 3e3 < sizes["bristle_stiffness"].value < 2e4
    assert sizes["bristle_damping"].ci95[0] == 0.0
