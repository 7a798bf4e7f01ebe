"""Candidates side by side: how many there are changes nothing for any of them."""

import numpy as np
import pytest

from identify.mismatch.compare import fit
from identify.mismatch.extended import ExtendedProblem
from identify.mismatch.residual import setting_of
from identify.mismatch.score import leads, leads_at
from identify.mismatch.ways import guises
from identify.observer import gain_table
from identify.preprocess import prepare
from plant.axis import Axis, Mechanics, Orientation
from plant.effects import find
from plant.recording import Recording

TABLE = Axis("table", Mechanics(Orientation.HORIZONTAL, M=20.0, J=0.012, Rc=0.045))
KINDS = ("rail_defect", "dead_time", "actuator_lag", "backlash", "presliding_hysteresis", "torque_ripple")


@pytest.fixture(scope="module")
def problem():
    """Four seconds of a swing that rests at its ends."""
    t = np.arange(400) * 0.01
    force = 120.0 * np.sin(2 * np.pi * 0.5 * t) ** 3
    position = 0.2 * (1.0 - np.cos(2 * np.pi * 0.5 * t)) + 1e-6 * np.sin(37.0 * t)
    return ExtendedProblem(prepare(Recording(t, force, position, sample_time=0.01), TABLE), TABLE)


@pytest.fixture(scope="module")
def fitted(problem):
    """The baseline's fit."""
    return fit(problem, np.zeros((1, problem.size)) + 0.1)


@pytest.mark.parametrize("name", KINDS)
def test_a_candidate_ends_as_it_would_alone(problem, fitted, name):
    """One fills half a block, nine and twenty whole ones: to the last bit the same errors."""
    guise = next(g for g in guises({name: find(name)}, setting_of(problem, fitted.x, 0.01)))
    model = problem.including((guise,))
    x = np.zeros((20, model.size))
    x[:, : problem.base] = fitted.x[: problem.base]
    x[:, model.slot(guise)] = guise.scaled_starts()[0]
    x[:, 0] += 0.003 * np.arange(20)
    gain = gain_table(0.01)[0][:, 9]
    model.steps_of = lambda _: 3  # what a block's stiffest candidates ask for is another matter
    together = model.errors(x, gain).copy()
    assert np.isfinite(together).all()
    assert np.ptp(together, axis=1).max() > 0.0
    for count in (1, 8, 9):
        np.testing.assert_array_equal(model.errors(x[:count], gain), together[:, :count])


def test_leads_of_several_observers_are_those_of_each(problem, fitted):
    """Starts share the lanes with those seen through other observers, and lead to the same."""
    ways = guises({name: find(name) for name in KINDS}, setting_of(problem, fitted.x, 0.01))
    gains = gain_table(0.01)[0][:, [3, 9, 14]]
    for gain, seen in zip(gains.T, leads_at(fitted, ways, gains), strict=True):
        alone = leads(fitted, ways, gain)
        assert [lead.guise for lead in seen] == [lead.guise for lead in alone]
        np.testing.assert_allclose([lead.gain for lead in seen], [lead.gain for lead in alone], rtol=1e-6, atol=1e-9)
