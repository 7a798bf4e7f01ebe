"""Reference motions: within their limits, smooth, and where they should be."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plant.errors import ParameterError
from plant.profiles import PointToPoint, ProductionCycle, SineMotion, move

T = np.linspace(0.0, 8.0, 80001)
LIMITS = {"speed": st.floats(0.05, 3.0), "acceleration": st.floats(0.1, 20.0)}


@given(distance=st.floats(1e-4, 2.0), jerk=st.floats(1.0, 1e4), down=st.booleans(), **LIMITS)
def test_a_move_arrives_at_rest_and_keeps_its_limits(distance, jerk, down, speed, acceleration):
    distance = -distance if down else distance
    pieces = move(distance, speed, acceleration, jerk)
    y = v = 0.0
    for piece in pieces:
        assert abs(piece.acceleration) <= acceleration * (1 + 1e-9)
        assert abs(piece.jerk) <= jerk * (1 + 1e-9)
        s = piece.duration
        y += s * (v + s * (piece.acceleration / 2 + s * piece.jerk / 6))
        v += s * (piece.acceleration + s * piece.jerk / 2)
        assert abs(v) <= speed * (1 + 1e-9)
    assert y == pytest.approx(distance, rel=1e-9, abs=1e-12)
    assert v == pytest.approx(0.0, abs=1e-9)


@given(distance=st.floats(1e-3, 2.0), **LIMITS)
def test_a_trapezoid_is_the_limit_of_s_curves_and_the_quickest(distance, speed, acceleration):
    def duration(jerk):
        return sum(piece.duration for piece in move(distance, speed, acceleration, jerk))

    trapezoid = duration(math.inf)
    assert duration(1e9) == pytest.approx(trapezoid, rel=1e-3)
    assert duration(50.0) > trapezoid


@pytest.mark.parametrize(
    "reference",
    [
        SineMotion(1.0, 0.2, 0.3),
        PointToPoint(0.2, 1.2, 0.5, 2.0),
        PointToPoint(1.2, 0.2, 0.5, 2.0, 15.0),
        PointToPoint(0.2, 0.23, 0.5, 2.0, 15.0),
        ProductionCycle((0.2, 1.1, 0.6), (0.3, 0.5, 0.0), 0.8, 4.0, 60.0),
    ],
)
def test_velocity_and_acceleration_are_the_derivatives(reference):
    motion = reference.motion(T)
    np.testing.assert_allclose(np.gradient(motion.position, T)[1:-1], motion.velocity[1:-1], atol=2.1e-4)
    jumps = np.abs(np.diff(motion.acceleration)) > 0.1
    smooth = ~(jumps[1:] | jumps[:-1])
    slope = np.gradient(motion.velocity, T)[1:-1]
    np.testing.assert_allclose(slope[smooth], motion.acceleration[1:-1][smooth], atol=4e-3)


def test_a_point_to_point_move_ends_where_it_should_and_stays():
    motion = PointToPoint(0.2, 1.2, 0.5, 2.0, 15.0).motion(np.array([0.0, 60.0]))
    np.testing.assert_allclose(motion.position, [0.2, 1.2], rtol=1e-12)
    np.testing.assert_array_equal(motion.velocity, 0.0)


def test_a_production_cycle_dwells_at_its_stations_and_begins_anew():
    cycle = ProductionCycle((0.2, 1.2), (0.5, 1.0), speed=0.5, acceleration=1.0)
    # 1 m at 0.5 m/s with 0.5 s ramps: 2.5 s each way; cycle of 2.5 + 1.0 + 2.5 + 0.5 s
    t = np.array([2.6, 3.4, 6.1, 6.4, 6.5 + 2.6])
    np.testing.assert_allclose(cycle.motion(t).position, [1.2, 1.2, 0.2, 0.2, 1.2], atol=1e-9)
    np.testing.assert_allclose(cycle.motion(t).velocity, 0.0, atol=1e-9)


def test_a_sine_begins_at_rest_at_its_lower_end():
    motion = SineMotion(1.0, 0.2, 0.3).motion(np.array([0.0, 1 / 0.6]))
    np.testing.assert_allclose(motion.position, [0.8, 1.2])
    np.testing.assert_allclose(motion.velocity, 0.0, atol=1e-12)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: SineMotion(1.0, 0.0, 0.3), "sine: amplitude is 0 m, but must be > 0 m"),
        (lambda: PointToPoint(0.0, 1.0, -0.5, 2.0), "point_to_point: speed is -0.5 m/s, but must be > 0 m/s"),
        (lambda: PointToPoint(1.0, 1.0, 0.5, 2.0), "point_to_point: end is 1 m, but must be other than start = 1 m"),
        (lambda: PointToPoint(0.0, 1.0, 0.5, 2.0, 0.0), r"jerk is 0 m/s\^3"),
        (lambda: ProductionCycle((1.0, 1.0), (0.0, 0.0), 0.5, 2.0), "at least two different positions"),
        (lambda: ProductionCycle((0.0, 1.0), (0.1,), 0.5, 2.0), "dwells is .* one >= 0 for each station"),
    ],
)
def test_a_value_out_of_range_names_itself(make, words):
    with pytest.raises(ParameterError, match=words):
        make()
