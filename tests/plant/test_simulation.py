"""The front door: right on the paper's case, and one clear line for whoever gives it nonsense."""

import numpy as np
import pytest

import plant
from plant.axis import Axis, Mechanics, Orientation, TorqueHold
from plant.errors import InputError, ParameterError
from plant.friction import StribeckFriction
from plant.presets import READINGS, paper_axis, paper_friction, paper_torque
from plant.simulation import simulate, simulate_population


@pytest.fixture(params=READINGS)
def paper(request):
    axis = paper_axis(request.param)
    return axis, paper_friction(request.param), paper_torque(axis)


def worst(a, b):
    return float(np.max(np.abs(a - b)))


def test_public_names_are_functions_even_after_the_module_is_imported():
    assert callable(plant.simulate)
    assert callable(plant.simulate_population)


def test_paper_machine_moves_about_a_fifth_of_a_metre_each_way(paper):
    position = simulate(*paper).position
    assert np.ptp(position[-1000:]) / 2 == pytest.approx(0.2, abs=0.01)
    assert paper[0].mechanics.moving_mass == pytest.approx(25.0)


def test_default_substeps_err_by_less_than_50_micrometres_over_20_seconds(paper):
    reference = simulate(*paper, substeps=4000)
    default = simulate(*paper)
    assert worst(default.position, reference.position) < 15e-6
    population = simulate_population(paper[0], paper[2], paper[1].as_array[np.newaxis])
    assert worst(population[0], reference.position) < 50e-6


def test_population_and_single_run_are_one_law(paper):
    axis, friction, torque = paper
    candidates = friction.as_array * np.linspace(0.7, 1.3, 19)[:, np.newaxis]
    positions = simulate_population(axis, torque, candidates, substeps=3, constant_force=2.0, position0=0.1)
    assert positions.shape == (19, len(torque))
    for candidate, position in zip(candidates[::6], positions[::6], strict=True):
        one = simulate(axis, StribeckFriction(*candidate), torque, substeps=3, constant_force=2.0, position0=0.1)
        assert worst(one.position, position) < 1e-12


def test_linear_and_held_torque_differ_by_millimetres(paper):
    held, linear = (simulate(*paper, hold=hold).position for hold in (TorqueHold.HOLD, TorqueHold.LINEAR))
    assert 1e-3 < worst(held, linear) < 20e-3


def test_the_mean_of_a_sample_acts_like_a_held_one(paper):
    assert np.array_equal(simulate(*paper, hold=TorqueHold.MEAN).position, simulate(*paper).position)


def test_irregular_stamps_of_a_linear_torque_tell_the_same_story(paper):
    axis, friction, _ = paper
    rng = np.random.default_rng(3)
    t = np.sort(np.concatenate([np.linspace(0.0, 5.0, 2001), rng.uniform(0.0, 5.0, 700)]))
    torque = axis.mechanics.weight / axis.mechanics.gain + 2.1 * np.sin(2 * np.pi * 0.2 * t)
    irregular = simulate(axis, friction, torque, t=t + 17.0, hold=TorqueHold.LINEAR)
    even = np.linspace(0.0, 5.0, 2001)
    torque = axis.mechanics.weight / axis.mechanics.gain + 2.1 * np.sin(2 * np.pi * 0.2 * even)
    regular = simulate(axis, friction, torque, t=even, hold=TorqueHold.LINEAR)
    assert worst(irregular.position[np.searchsorted(t, even)], regular.position) < 2e-5


def test_a_rotary_axis_marches_in_radians_and_newton_metres():
    axis = Axis("joint", Mechanics(Orientation.ROTARY, J=0.5, force_per_torque=1.0))
    path = simulate(axis, StribeckFriction(1.0, 1.0, 0.1, 2.0), np.full(4000, 5.0), sample_time=0.005)
    assert path.velocity[-1] == pytest.approx((5.0 - 1.0) / 2.0)


FLAT = Axis("flat", Mechanics(Orientation.HORIZONTAL, M=20.0, J=0.01, Rc=0.05, force_per_torque=100.0))
FRICTION = StribeckFriction(50.0, 80.0, 0.05, 100.0)


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"torque": [[1.0]]}, "torque has shape (1, 1)"),
        ({"torque": []}, "torque has shape (0,)"),
        ({"torque": [1.0, np.nan]}, "torque[1] is nan N*m, but must be finite N*m"),
        ({"sample_time": None}, "axis flat has no [stream] sample_time"),
        ({"sample_time": 0.0}, "sample_time is 0 s, but must be > 0 s"),
        ({"t": [0.0, 1.0, 2.0]}, "t and sample_time are both given"),
        ({"sample_time": None, "t": [0.0, 1.0]}, "t has 2 samples, torque has 3"),
        ({"sample_time": None, "t": [0.0, 1.0, 1.0]}, "t[2] is 1 s, but must be later than t[1] = 1 s"),
        ({"hold": TorqueHold.UNKNOWN}, "hold is unknown, but must be hold, linear or mean"),
        ({"moving_mass": 0.0}, "moving_mass is 0 kg, but must be > 0 kg"),
        ({"constant_force": np.inf}, "constant_force[0] is inf N"),
        ({"position0": np.nan}, "position0 is nan m"),
        ({"velocity0": np.inf}, "velocity0 is inf m/s"),
        ({"substeps": 0}, "substeps is 0, but must be a whole number >= 1"),
        ({"effects": {"rail_defekt": {}}}, "no effect is called rail_defekt: did you mean rail_defect?"),
        ({"effects": {"rail_defect": {"height": 1.0}}}, "rail_defect has no parameter height: it has amplitude"),
        ({"effects": {"rail_defect": {"amplitude": 1.0, "centre": 0.0}}}, "rail_defect needs width [m]"),
    ],
)
def test_a_bad_argument_is_one_clear_line(change, line):
    arguments = {"torque": [1.0, 2.0, 3.0], "sample_time": 0.01, **change}
    with pytest.raises(InputError) as error:
        simulate(FLAT, FRICTION, arguments.pop("torque"), **arguments)
    assert line in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("candidates", "line"),
    [
        ([1.0, 2.0, 3.0, 4.0], "candidates has shape (4,), but must be (m, 4)"),
        ([[90.0, 60.0, 0.1, 180.0], [-1.0, 60.0, 0.1, 180.0]], "coulomb_force is -1 N, but must be >= 0 N"),
        ([[90.0, 60.0, 0.0, 180.0]], "stribeck_velocity is 0 m/s, but must be > 0 m/s"),
    ],
)
def test_a_bad_candidate_is_one_clear_line(candidates, line):
    with pytest.raises(InputError, match=r"^" + line.replace("(", r"\(").replace(")", r"\)")):
        simulate_population(FLAT, [1.0, 2.0], candidates, sample_time=0.01)


def test_an_unknown_reading_of_the_paper_names_the_two():
    with pytest.raises(ParameterError, match="one of paper-literal, paper-bump"):
        paper_axis("paper-other")


def test_one_sample_is_a_run_too():
    path = simulate(FLAT, FRICTION, [1.0], sample_time=0.01, position0=0.3)
    assert path.position.tolist() == [0.3]
