"""A pulley out of true: its motor turns faster where the radius is small; what it is told from, and how well known."""

import numpy as np
import pytest

from identify.mismatch.extended import ExtendedProblem
from identify.mismatch.guise import OFF_WHOLE
from identify.mismatch.ways import guises
from identify.preprocess import prepare
from plant.axis import Axis, Mechanics, Orientation
from plant.effects import find
from tests.identify.test_uncatalogued import setting
from tests.identify.true_numbers import missed, solved

LOAD, TURNING, RADIUS, VISCOUS = 20.0, 12.0, 0.05, 80.0  # kg, kg (J/R_c²), m, N s/m
ECCENTRICITY, PHASE, PEAK = 0.15, 0.7, 150.0
BELT = Axis("belt", Mechanics(Orientation.HORIZONTAL, M=LOAD, J=TURNING * RADIUS**2, Rc=RADIUS, Rm=RADIUS))


def mass(y):
    """Load, and the motor's inertia over the square of the radius it works at. [kg]"""
    return LOAD + TURNING / (1.0 + ECCENTRICITY * np.cos(y / RADIUS + PHASE)) ** 2


def driven(seconds=3.0, rate=200):
    """The machine by its energy, solved by SciPy: d/dt (m(y) v²/2) = F v/r - c v²."""
    t = np.arange(round(seconds * rate)) / rate
    force = PEAK * np.round(np.sin(2 * np.pi * 0.9 * t) + 0.5 * np.sin(2 * np.pi * 1.7 * t + 0.4), 3)

    def slope(_, state, push):
        y, v = state
        steeper = (mass(y + 1e-6) - mass(y - 1e-6)) / 2e-6
        lever = 1.0 + ECCENTRICITY * np.cos(y / RADIUS + PHASE)
        return v, (push / lever - VISCOUS * v - 0.5 * steeper * v * v) / mass(y)

    return solved(slope, force, rate, states=2, seen=0)


@pytest.fixture(scope="module")
def pulley():
    (guise,) = guises({"pulley_eccentricity": find("pulley_eccentricity")}, setting(BELT, mass=LOAD + TURNING))
    return guise


def test_a_motor_that_turns_faster_runs_as_its_energy_says(pulley):
    """Free for three seconds it stays within 0.1 % of the travel; with a constant mass it errs ten times more."""
    bare = ExtendedProblem(prepare(driven(), BELT), BELT, first_state=np.zeros((1, 2)))
    problem = bare.including((pulley.freed,)).refined(1e-3)

    def error(inertia):
        cosine, sine = ECCENTRICITY * np.cos(PHASE), -ECCENTRICITY * np.sin(PHASE)
        sizes = {"period": 2 * np.pi * RADIUS, "relative_eccentricity": cosine, "phase": sine, "inertia": inertia}
        return missed(problem, pulley.freed, VISCOUS, **sizes).max()

    travel = float(np.ptp(problem.samples.position))
    true = error(1.0)
    assert true < 1e-3 * travel
    assert error(0.0) > 10.0 * true


def test_the_turn_of_a_pulley_is_known_from_its_radius(pulley):
    """A free period bent to a drag that was missing: 1.2 % too long, and the drag was not found."""
    period = pulley.unknowns[0]
    assert period.unit == pytest.approx(2 * np.pi * RADIUS)
    assert period.spread == OFF_WHOLE
