"""What results show of a named effect: values, and units of the axis it is on."""

from types import SimpleNamespace

import numpy as np
import pytest

from identify.mismatch.guise import Guise, Unknown
from identify.mismatch.report_values import reported
from plant.effects import find

LAW = np.array([[2.0], [1.0], [10.0], [2.0], [1.0], [0.0]])  # N, N, s/m, N*s/m, kg, N


@pytest.mark.parametrize(
    ("effect", "parameter", "derived", "linear", "rotary"),
    [
        ("coulomb_asymmetry", "asymmetry_ratio", "coulomb_difference_half", "N", "N*m"),
        ("viscous_asymmetry", "asymmetry_ratio", "viscous_difference_half", "N*s/m", "N*m*s/rad"),
        ("position_dependent_friction", "relative_slope", "slope", "N/m", "N*m/rad"),
    ],
)
def test_what_follows_from_friction_has_the_unit_of_the_axis(effect, parameter, derived, linear, rotary):
    """An asymmetry of a rotary axis was given in newton."""
    guise = Guise(find(effect), (Unknown(parameter, 1.0, -2.0, 2.0),), np.ones((1, 1)))
    for is_rotary, unit in ((False, linear), (True, rotary)):
        axis = SimpleNamespace(is_rotary=is_rotary, position_unit="rad" if is_rotary else "m")
        problem = SimpleNamespace(axis=axis, slot=lambda _: slice(0, 1), law=lambda _: LAW)
        assert reported(problem, guise, np.array([0.5]))[derived] == (1.0, unit)
