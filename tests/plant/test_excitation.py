"""Excitations: their shape, their seeds, and what they refuse."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from plant.errors import ParameterError
from plant.excitation import (
    FORMS,
    Multisine,
    PiecewiseConstant,
    Random,
    SawTooth,
    Sine,
    Square,
    TwoSquares,
    holding_torque,
)
from plant.presets import paper_axis, paper_torque

T = 0.01 * np.arange(2000)
ONE_OF_EACH = (
    Sine(2.1, 0.2, offset=2.65),
    Square(2.1, 0.1, 2.65),
    SawTooth(2.1, 0.2, 2.65),
    TwoSquares((1.5, 0.6), (0.05, 0.3), 2.65),
    Multisine(0.7, (0.1, 0.2, 0.5), seed=4, offset=2.65),
    Random(2.1, 0.01, seed=4, offset=2.65),
    PiecewiseConstant(2.1, 0.3, 2.0, seed=4, offset=2.65),
)


def test_every_form_of_the_catalogue_is_tested():
    assert {type(excitation) for excitation in ONE_OF_EACH} == set(FORMS.values())


def test_the_sine_about_the_holding_torque_is_the_papers():
    axis = paper_axis("paper-bump")
    sine = Sine(2.1, 0.2, offset=holding_torque(axis.mechanics))
    np.testing.assert_allclose(sine.torque(T), paper_torque(axis), rtol=1e-13)


@pytest.mark.parametrize("excitation", ONE_OF_EACH, ids=lambda e: e.form)
def test_the_same_value_gives_the_same_torque_and_a_longer_run_begins_with_the_shorter(excitation):
    np.testing.assert_array_equal(excitation.torque(T)[:700], excitation.torque(T[:700]))


@pytest.mark.parametrize("excitation", ONE_OF_EACH, ids=lambda e: e.form)
def test_times_before_the_start_are_refused(excitation):
    with pytest.raises(ParameterError, match=r"-0\.01 s, but must be >= 0 s"):
        excitation.torque([-0.01, 0.0])


@pytest.mark.parametrize("excitation", ONE_OF_EACH, ids=lambda e: e.form)
def test_one_time_gives_one_torque(excitation):
    assert excitation.torque(0.5).shape == ()
    assert excitation.torque(np.zeros(0)).shape == (0,)


@given(st.integers(1, 400), st.integers(1, 9))
def test_a_square_spends_half_of_each_period_on_either_side_whatever_the_rounding(steps_per_half, periods):
    half = 0.01 * steps_per_half
    torque = Square(1.0, 1.0 / (2 * half)).torque(0.01 * np.arange(2 * steps_per_half * periods))
    expected = np.tile(np.repeat([1.0, -1.0], steps_per_half), periods)
    np.testing.assert_array_equal(torque, expected)


def test_a_saw_tooth_rises_straight_and_falls_at_once():
    torque = SawTooth(1.0, 1.0).torque(0.01 * np.arange(300)).reshape(3, 100)
    np.testing.assert_allclose(torque, np.tile(np.linspace(-1.0, 0.98, 100), (3, 1)), atol=1e-8)


def test_two_squares_are_the_sum_of_two_squares():
    expected = 1.0 + Square(1.5, 0.05).torque(T) + Square(0.6, 0.3).torque(T)
    np.testing.assert_allclose(TwoSquares((1.5, 0.6), (0.05, 0.3), 1.0).torque(T), expected, rtol=1e-15)


def test_a_multisine_has_its_power_on_its_lines_only():
    spectrum = np.abs(np.fft.rfft(Multisine(0.7, (0.1, 0.2, 0.5), seed=1).torque(T))) * 2 / len(T)
    lines = np.flatnonzero(spectrum > 1e-9)
    np.testing.assert_array_equal(lines, [2, 4, 10])  # of 0.05 Hz
    np.testing.assert_allclose(spectrum[lines], 0.7)


@settings(max_examples=25)
@given(st.integers(0, 2**32), st.floats(0.02, 0.5))
def test_random_torque_changes_only_at_its_holds(seed, hold):
    torque = Random(1.0, hold, seed).torque(T)
    changes = T[1:][np.diff(torque) != 0]
    into_hold = np.mod(changes + 1e-9 * hold, hold)
    assert (into_hold < 0.01).all()


def test_random_torque_has_the_deviation_it_says_and_seeds_differ():
    runs = np.array([Random(2.1, 0.01, seed).torque(T) for seed in range(50)])
    assert runs.std() == pytest.approx(2.1, rel=0.01)
    assert runs.mean() == pytest.approx(0.0, abs=0.03)
    assert np.abs(np.corrcoef(runs)[np.triu_indices(50, 1)]).max() < 0.12


def test_pieces_are_as_long_as_they_may_be():
    lengths = []
    for seed in range(40):
        torque = PiecewiseConstant(2.1, 0.3, 2.0, seed).torque(T)
        assert np.abs(torque).max() <= 2.1
        lengths += np.diff(np.flatnonzero(np.diff(torque))).tolist()
    assert min(lengths) >= 29
    assert max(lengths) <= 201
    assert np.mean(lengths) == pytest.approx(115, rel=0.1)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Sine(-1.0, 0.2), r"sine: amplitude is -1 N\*m, but must be >= 0 N\*m"),
        (lambda: Square(1.0, 0.0), r"square: frequency is 0 Hz, but must be > 0 Hz"),
        (lambda: SawTooth(float("nan"), 1.0), r"saw_tooth: amplitude is nan N\*m"),
        (lambda: TwoSquares((1.0, 1.0), (0.1, -2.0)), r"two_squares: frequency is -2 Hz"),
        (lambda: Multisine(1.0, (0.1, 0.0)), r"multisine: frequency is 0 Hz"),
        (lambda: Random(1.0, 0.0), r"random: hold_time is 0 s, but must be > 0 s"),
        (lambda: PiecewiseConstant(1.0, 2.0, 1.0), r"longest is 1 s, but must be >= shortest = 2 s"),
    ],
)
def test_a_value_out_of_range_names_itself_with_value_range_and_unit(make, words):
    with pytest.raises(ParameterError, match=words):
        make()
