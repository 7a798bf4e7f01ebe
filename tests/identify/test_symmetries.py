"""Physics does not depend on where we count from, in which unit, or which way is up."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.identification import identify_friction
from plant.axis import Orientation
from tests.identify.studies.machines import FRICTION, Setting, draw_case

FEW = settings(max_examples=4, deadline=None, derandomize=True)
SEEDS = st.integers(0, 30)
EXCITATIONS = st.sampled_from(["sine", "multi", "loop"])


def values(result):
    return np.array([result.parameters[name].value for name in (*FRICTION, "constant_force")])


def widths(result):
    """Half-widths of the intervals; infinite where nothing is known."""
    intervals = [result.parameters[name].ci95 for name in (*FRICTION, "constant_force")]
    return np.array([np.inf if one is None else 0.5 * (one[1] - one[0]) for one in intervals])


def same(one, other, width, share=0.05):
    """Equal to a small share of what is known at all."""
    assert np.all(np.abs(one - other) <= share * width + 1e-6 * np.abs(one))


@FEW
@given(seed=SEEDS, excitation=EXCITATIONS, shift=st.floats(-1e3, 1e3))
def test_time_may_begin_anywhere(seed, excitation, shift):
    case = draw_case(seed, Setting(excitation, samples=1500))
    later = dataclasses.replace(case.recording, t=case.recording.t + shift)
    first, second = identify_friction(case.recording, case.axis), identify_friction(later, case.axis)
    same(values(first), values(second), widths(first))


@FEW
@given(seed=SEEDS, excitation=EXCITATIONS, shift=st.floats(-50.0, 50.0))
def test_position_may_be_counted_from_anywhere(seed, excitation, shift):
    case = draw_case(seed, Setting(excitation, samples=1500))
    moved = dataclasses.replace(case.recording, position=case.recording.position + shift)
    first, second = identify_friction(case.recording, case.axis), identify_friction(moved, case.axis)
    same(values(first), values(second), widths(first))


@FEW
@given(seed=SEEDS, excitation=EXCITATIONS, scale=st.sampled_from([1e-3, 0.1, 10.0, 1e3]))
def test_another_unit_of_length_is_the_same_machine(seed, excitation, scale):
    """Lengths times s, forces and masses as they were times s: g times s, F = m a keeps."""
    case = draw_case(seed, Setting(excitation, samples=1500))
    r, mechanics = case.recording, case.axis.mechanics
    other = dataclasses.replace(r, position=r.position * scale, force=r.force * scale)
    axis = dataclasses.replace(
        case.axis,
        mechanics=dataclasses.replace(mechanics, g=mechanics.g * scale),
        drive=dataclasses.replace(case.axis.drive, rated_force=case.axis.drive.rated_force * scale),
    )
    first, second = identify_friction(r, case.axis), identify_friction(other, axis)
    unit = np.array([scale, scale, scale, 1.0, scale])
    same(values(first), values(second) / unit, widths(first))


@FEW
@given(seed=SEEDS, excitation=EXCITATIONS)
def test_a_mirrored_horizontal_machine_mirrors_the_constant_force_alone(seed, excitation):
    case = draw_case(seed, Setting(excitation, samples=1500))
    weight = case.axis.mechanics.weight
    mechanics = dataclasses.replace(case.axis.mechanics, orientation=Orientation.HORIZONTAL)
    axis = dataclasses.replace(case.axis, mechanics=mechanics)
    right = dataclasses.replace(case.recording, force=case.recording.force - weight)
    left = dataclasses.replace(right, force=-right.force, position=-right.position)
    first, second = identify_friction(right, axis), identify_friction(left, axis)
    same(values(first), values(second) * np.array([1, 1, 1, 1, -1]), widths(first))


def test_the_same_seed_gives_the_same_answer_bit_by_bit():
    case = draw_case(1, Setting())
    first, second = (identify_friction(case.recording, case.axis, seed=3) for _ in range(2))
    assert first.to_dict() == second.to_dict()


def test_another_seed_of_the_search_finds_the_same_optimum():
    case = draw_case(1, Setting("loop"))
    results = [identify_friction(case.recording, case.axis, seed=seed) for seed in range(4)]
    for result in results[1:]:
        same(values(results[0]), values(result), widths(results[0]))


@pytest.mark.parametrize("start", [1.0, 3.0])
def test_a_start_competes_and_does_not_bind(start):
    case = draw_case(5, Setting())
    wrong = {name: case.truth[name] * start for name in FRICTION}
    cold = identify_friction(case.recording, case.axis)
    warm = identify_friction(case.recording, case.axis, start=wrong)
    same(values(cold), values(warm), widths(cold))
