"""What results show of a named effect: values, and units of the axis it is on."""

from types import SimpleNamespace

import numpy as np
import pytest

from identify.mismatch import report_values
from identify.mismatch.guise import PLACED_SPREAD, Guise, Unknown
from identify.mismatch.report_values import reported
from plant.effects import find

MOMENT = Unknown("time", 1.0, 0.0, 40.0, spread=PLACED_SPREAD)
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


def test_what_both_recordings_tell_of_a_size_is_weighed_by_how_well_they_know_it(monkeypatch):
    """The summary of two studies, with and without more between them than chance."""
    monkeypatch.setattr(report_values, "_on_scale", lambda one, _: {"gap": one})
    fit = SimpleNamespace(problem=None)

    class Known(tuple):
        fit: SimpleNamespace

    def known(value, half, log=False):
        told = Known((value, "m", np.log(value) if log else value, half))
        told.fit = fit
        return told

    guise = SimpleNamespace(name="backlash", optional=lambda _: False)
    alike = report_values.quantities(known(1.0, 0.3), guise, known(1.2, 0.4), pooled=True)["gap"]
    assert alike.value == pytest.approx((1.0 / 0.09 + 1.2 / 0.16) / (1.0 / 0.09 + 1.0 / 0.16))
    assert alike.ci95[1] - alike.value == pytest.approx((1.0 / 0.09 + 1.0 / 0.16) ** -0.5)
    apart = report_values.quantities(known(1.0, 0.3), guise, known(5.0, 0.4), pooled=True)["gap"]
    assert apart.ci95[0] < 1.0 < 5.0 < apart.ci95[1], "two motions that differ by more than chance"
    log = report_values.quantities(known(1.0, 0.3, log=True), guise, known(1.2, 0.3, log=True), pooled=True)["gap"]
    assert log.value == pytest.approx(1.2**0.5)
    assert np.prod(log.ci95) == pytest.approx(1.2)
    bound = report_values.quantities(known(1.0, 0.3), guise, known(1.2, 0.0), pooled=True)["gap"]
    assert bound.value == 1.0, "on a bound, nothing is known of it"


@pytest.mark.parametrize(("begin", "end", "asked"), [(0.0, 14.7, False), (0.0, 36.8, True), (22.0, 36.8, False)])
def test_data_that_end_before_a_step_know_nothing_of_its_size(monkeypatch, begin, end, asked):
    """A step at 21.6 s was dropped, 5160 and 3058: half of it was what the first 14.7 s made of its size."""
    step = Guise(find("step_change"), (Unknown("step", 1.0, -9.0, 9.0), MOMENT), np.array([[1.0, 9.0]]))
    problem = SimpleNamespace(slot=lambda _: slice(0, 2), samples=SimpleNamespace(t=np.array([begin, end])))
    one, other = (SimpleNamespace(fit=SimpleNamespace(problem=problem, x=np.array([1.0, 21.6]))) for _ in range(2))
    told = {id(one): (4.0, "N", 4.0, 0.1), id(other): (0.0, "N", 0.0, 0.1)}
    monkeypatch.setattr(report_values, "_on_scale", lambda known, _: {"step": told[id(known)]})
    low, high = report_values.quantities(one, step, other)["step"].ci95
    assert (high - low > 1.0) is asked
