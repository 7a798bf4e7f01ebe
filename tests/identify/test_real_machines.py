"""Real machines: the numbers of others' work within stated limits, intervals as wide as what cycles scatter by."""

import numpy as np
import pytest

from identify.identification import identify_friction
from identify.result import Verdict
from tests.identify.studies.real_machines import data_folder, joint, load

pytestmark = pytest.mark.skipif(
    not (data_folder() / "emps" / "emps_train.csv.gz").exists(),
    reason=f"recordings are not in {data_folder()}; set TRIBOWATCH_DATA",
)

MASS = 95.1089  # kg, published least squares
CYCLE = 6240  # samples at 1 kHz
SPEEDS = np.array([0.03, 0.06, 0.12])


@pytest.fixture(scope="module")
def emps():
    return load("emps")


@pytest.fixture(scope="module")
def whole(emps):
    axis, recording = emps
    return identify_friction(recording, axis)


@pytest.fixture(scope="module")
def cycles(emps):
    axis, recording = emps
    return [identify_friction(recording.window(k * CYCLE, CYCLE), axis) for k in range(3)]


def test_emps_mass_is_found_from_a_rough_start(whole):
    assert whole.verdict is Verdict.IDENTIFIED
    assert whole.parameters["moving_mass"].value == pytest.approx(MASS, rel=0.03)


def test_emps_friction_curve_is_the_published_one(whole):
    force, _ = whole.curve_at(SPEEDS)
    assert force == pytest.approx(20.3935 + 203.5034 * SPEEDS, rel=0.05)


def test_emps_pulses_tell_the_same_machine(whole):
    axis, recording = load("emps", 1)
    other = identify_friction(recording, axis)
    assert other.parameters["moving_mass"].value == pytest.approx(MASS, rel=0.03)
    assert other.curve_at(SPEEDS)[0] == pytest.approx(whole.curve_at(SPEEDS)[0], rel=0.05)


def test_emps_intervals_are_no_narrower_than_the_scatter_of_the_cycles(whole, cycles):
    """Three cycles of one recording: the interval of each must hold at least what they differ by."""
    forces = np.array([cycle.curve_at(SPEEDS)[0] for cycle in cycles])
    halves = np.array([cycle.curve_at(SPEEDS)[1] for cycle in cycles])
    assert np.all(1.96 * forces.std(axis=0, ddof=1) <= halves.max(axis=0))
    masses = np.array([cycle.parameters["moving_mass"].value for cycle in cycles])
    intervals = [cycle.parameters["moving_mass"].ci95 for cycle in cycles]
    assert 1.96 * masses.std(ddof=1) <= 0.5 * max(high - low for low, high in intervals)
    _, half = whole.curve_at(SPEEDS)
    assert np.all(half >= 1.96 * forces.std(axis=0, ddof=1) / np.sqrt(len(cycles)))


def test_cart_friction_agrees_between_strokes_at_other_places():
    """Friction of the cart at 0.3 m/s from long strokes over different parts of the rail."""
    forces, halves = [], []
    for run in ("testOffPointOne", "testOffPointThree", "testOffPointFive"):
        axis, recording = load("rail-cart", run=run)
        result = identify_friction(recording, axis)
        assert result.verdict is Verdict.IDENTIFIED
        force, half = result.curve_at([0.3])
        forces.append(force[0])
        halves.append(half[0])
    assert np.ptp(forces) <= 0.15 * np.mean(forces)


def test_servo_runs_agree_with_a_regression_and_with_each_other():
    results = [
        identify_friction(recording, axis) for axis, recording in (load("servo", test="J", run=k) for k in (6, 8))
    ]
    inertia, coulomb, viscous = regression(load("servo", test="J", run=6)[1])
    first = results[0]
    assert first.parameters["moving_mass"].value == pytest.approx(inertia, rel=0.03)
    assert first.curve_at([15.0])[0][0] == pytest.approx(coulomb + viscous * 15.0, rel=0.03)
    assert results[1].curve_at([15.0])[0][0] == pytest.approx(first.curve_at([15.0])[0][0], rel=0.03)


def regression(recording, reach=20):
    """Inertia, Coulomb and viscous friction by least squares on differences, above 3 rad/s."""
    t, y = recording.t, recording.position
    velocity = (y[2 * reach :] - y[: -2 * reach]) / (t[2 * reach :] - t[: -2 * reach])
    middle, force = t[reach:-reach], recording.force[reach:-reach]
    acceleration = (velocity[2 * reach :] - velocity[: -2 * reach]) / (middle[2 * reach :] - middle[: -2 * reach])
    velocity, force = velocity[reach:-reach], force[reach:-reach]
    fast = np.abs(velocity) > 3.0
    design = np.stack([acceleration, np.sign(velocity), velocity, np.ones_like(velocity)], axis=1)[fast]
    inertia, coulomb, viscous, _ = np.linalg.lstsq(design, force[fast], rcond=None)[0]
    return inertia, coulomb, viscous


def test_servo_break_away_and_pre_sliding_are_refused_with_reasons():
    axis, recording = load("servo", test="Fs", run=1)
    result = identify_friction(recording, axis)
    assert result.verdict is Verdict.NOT_INFORMATIVE
    assert "one way" in result.reason
    axis, recording = load("servo", test="sigma0", run=1)
    result = identify_friction(recording, axis)
    assert result.verdict is Verdict.BAD_DATA
    assert "stood still" in result.reason


def test_a_robot_joint_repeats_its_friction_curve():
    first, again = (identify_friction(recording, axis) for axis, recording in (joint(1), joint(1, 2)))
    speeds = np.array([2.0, 4.0])
    force, half = first.curve_at(speeds)
    other, other_half = again.curve_at(speeds)
    assert np.all(np.abs(force - other) <= half + other_half)
