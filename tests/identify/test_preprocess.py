"""What sensors get wrong is taken out before the fit and said; the physics stays what it was."""

import dataclasses

import numpy as np
import pytest

from identify.faults import bend, force_spikes, frozen, spikes_and_steps, unfelt, unwrapped
from identify.identification import identify_friction
from identify.preprocess import Piece, average_down, prepare, smooth_velocity
from plant.axis import TorqueHold
from plant.presets import paper_axis
from plant.recording import Recording
from tests.identify.studies.machines import FRICTION, Setting, draw_case

CASE = draw_case(3, Setting("multi", samples=2500))
CLOSED = draw_case(3, Setting("loop", samples=2500))
RNG_SEED = 5


def with_position(recording, position):
    return dataclasses.replace(recording, position=position)


def holds_truth(case, result):
    """Every friction parameter within one and a half times its interval (one seed each), the curve within 2 %."""
    for name in FRICTION:
        low, high = result.parameters[name].ci95
        assert abs(case.truth[name] - 0.5 * (low + high)) <= 0.75 * (high - low), name
    speeds = result.curve.fastest * np.array([0.1, 0.4, 0.9])
    assert np.allclose(result.curve_at(speeds)[0], case.law.force(speeds), rtol=0.02)


@pytest.mark.parametrize("case", [CASE, CLOSED], ids=["open", "closed"])
def test_nothing_is_removed_from_a_healthy_recording(case):
    result = identify_friction(case.recording, case.axis)
    assert result.preprocessing == ()
    holds_truth(case, result)


@pytest.mark.parametrize("size", [1.5e-3, 5e-3, 0.2], ids=["1.5 mm", "5 mm", "20 cm"])
@pytest.mark.parametrize("case", [CASE, CLOSED], ids=["open", "closed"])
def test_single_spikes_of_the_position_are_found_reported_and_do_no_harm(case, size):
    rng = np.random.default_rng(RNG_SEED)
    position = case.recording.position.copy()
    spots = rng.choice(np.arange(20, 2480), 6, replace=False)
    position[spots] += size * rng.choice([-1.0, 1.0], 6)
    clean = identify_friction(case.recording, case.axis)
    result = identify_friction(with_position(case.recording, position), case.axis)
    counted = sum(int(line.split(": ")[1]) for line in result.preprocessing if "outliers" in line)
    assert 5 <= counted <= 7
    for name in FRICTION:
        low, high = clean.parameters[name].ci95
        assert abs(result.parameters[name].value - clean.parameters[name].value) < 0.25 * (high - low)


def test_a_dropout_to_zero_of_some_samples_is_not_fitted():
    position = CASE.recording.position.copy()
    away = int(np.argmax(np.abs(position)))
    position[away - 2 : away + 2] = 0.0
    result = identify_friction(with_position(CASE.recording, position), CASE.axis)
    assert any("outliers" in line for line in result.preprocessing)
    holds_truth(CASE, result)


def test_a_jump_of_the_zero_begins_a_new_run():
    position = CASE.recording.position.copy()
    position[700:] += 0.05
    samples = prepare(with_position(CASE.recording, position), CASE.axis)
    assert samples.runs == 2
    assert samples.first.tolist() == [0, 700]
    holds_truth(CASE, identify_friction(with_position(CASE.recording, position), CASE.axis))


@pytest.mark.parametrize("length", [15, 80])
def test_a_frozen_position_is_not_fitted(length):
    speed = np.abs(smooth_velocity(prepare(CLOSED.recording, CLOSED.axis)))
    begin = int(np.flatnonzero(speed > 0.9 * speed.max())[0])
    position = CLOSED.recording.position.copy()
    position[begin : begin + length] = position[begin]
    result = identify_friction(with_position(CLOSED.recording, position), CLOSED.axis)
    assert any("frozen" in line for line in result.preprocessing)
    holds_truth(CLOSED, result)


def test_a_machine_that_truly_stands_still_is_not_called_frozen():
    case = draw_case(1, Setting("loop", noise=0.0, dirt=0.0))
    assert np.mean(np.diff(case.recording.position) == 0.0) > 0.02
    assert prepare(case.recording, case.axis).removed == ()


def test_force_spikes_that_the_machine_did_not_feel_are_replaced():
    force = CASE.recording.force.copy()
    force[[500, 1500]] += 300.0
    result = identify_friction(dataclasses.replace(CASE.recording, force=force), CASE.axis)
    assert result.preprocessing == ("force spikes replaced by their neighbours: 2",)
    holds_truth(CASE, result)


def test_force_spikes_that_the_machine_felt_stay(monkeypatch):
    from tests.identify.studies import machines

    excite = machines.excite

    def kicked(*arguments):
        torque = excite(*arguments)
        kick = torque.torque.copy()
        kick[[500, 1500]] += 3.0
        return dataclasses.replace(torque, torque=kick)

    monkeypatch.setattr(machines, "excite", kicked)
    case = draw_case(3, Setting("multi"))
    assert force_spikes(case.recording.force).sum() == 2
    result = identify_friction(case.recording, case.axis)
    assert result.preprocessing == ()
    holds_truth(case, result)


@pytest.mark.parametrize("late", [0, 3])
def test_short_strong_pulses_of_a_drive_are_no_spikes(late):
    """Jerk-limited moves of a stiff loop: half of the force's range for two samples, and the position shows it."""
    pulse = np.array([10.6, -241.3, -694.4, -747.1, -325.4, -40.0])
    force = np.zeros(2000)
    for number, start in enumerate(range(100, 1900, 150)):
        force[start : start + 6] = pulse * (-1.0) ** number
    force[1675] -= 700.0  # one that nothing moved by
    real = np.concatenate([np.zeros(late), force[: len(force) - late]])
    real[1675 + late] += 700.0
    speed = 0.01 * np.cumsum(real / 120.0)
    t = 0.01 * np.arange(len(force))
    odd = force_spikes(force)
    assert odd.sum() > 20
    assert np.flatnonzero(unfelt(t, force, 0.01 * np.cumsum(speed), odd, mass=120.0)).tolist() == [1675]


def test_a_gap_that_closes_is_no_spike_of_the_position():
    """The load is hit and goes on at another speed within a sample: far more than the drive could accelerate it by."""
    t = 0.01 * np.arange(400)
    speed = np.where(t < 2.0, 0.01, 0.25) + 1e-3 * np.sin(7.0 * t)
    position = np.cumsum(speed) * 0.01
    spikes, steps = spikes_and_steps(t, position, acceleration=4.0, resolution=1e-6)
    assert not spikes.any()
    assert steps.size == 0
    position[300] += 3e-4
    spikes, _ = spikes_and_steps(t, position, acceleration=4.0, resolution=1e-6)
    assert np.flatnonzero(spikes).tolist() == [300]


def test_a_motor_that_runs_free_in_a_gap_is_no_fault_of_its_sensor():
    """The motor is 5 of 55 kg: free of the load it speeds up eleven times as fast, till the other flank stops it."""
    t = 0.01 * np.arange(400)
    acceleration = np.where(np.arange(400) == 200, 8.0, 0.0) - np.where(np.arange(400) == 201, 8.0, 0.0)
    position = np.cumsum(0.1 + np.cumsum(acceleration) * 0.01) * 0.01
    force = np.sin(t) * 40.0
    for side, outliers in (("load", True), ("motor", False)):
        axis = dataclasses.replace(
            CASE.axis,
            mechanics=dataclasses.replace(CASE.axis.mechanics, M=50.0, J=5.0, Rc=1.0),
            sensor=dataclasses.replace(CASE.axis.sensor, side=side),
        )
        removed = prepare(Recording(t, force, position, sample_time=0.01), axis).removed
        assert any("position" in line for line in removed) is outliers


def test_square_waves_have_no_spikes_and_no_frozen_force():
    t = np.arange(2000) * 0.01
    force = np.where(np.sin(2 * np.pi * 0.4 * t) > 0, 80.0, -80.0)
    recording = Recording(t, force, 0.2 * np.sin(t), sample_time=0.01)
    assert prepare(recording, CASE.axis).removed == ()


def test_the_model_is_never_marched_across_a_gap():
    keep = np.ones(len(CASE.recording), dtype=bool)
    keep[1000:1100] = False
    keep[2000:2003] = False
    r = CASE.recording
    gappy = dataclasses.replace(r, t=r.t[keep], force=r.force[keep], position=r.position[keep])
    samples = prepare(gappy, CASE.axis)
    assert samples.runs == 3
    assert samples.steps.max() < 0.011
    result = identify_friction(gappy, CASE.axis)
    assert result.preprocessing == ("3 runs between gaps; 0 samples in shorter pieces left out",)
    holds_truth(CASE, result)


def test_an_irregular_clock_is_marched_as_it_ticks():
    rng = np.random.default_rng(RNG_SEED)
    fast = draw_case(4, Setting("multi", samples=20000, period=1e-3))
    rows = np.cumsum(rng.integers(6, 15, 1900))
    r = fast.recording
    # held over each 1 ms, the force is nearly linear over 6 to 14 of them
    jittered = dataclasses.replace(
        r, t=r.t[rows], force=r.force[rows] - 0.5 * np.diff(r.force)[rows], position=r.position[rows],
        sample_time=0.01, hold=TorqueHold.LINEAR,
    )  # fmt: skip
    samples = prepare(jittered, fast.axis)
    assert samples.runs == 1
    assert samples.steps[:-1].std() > 0.002
    holds_truth(fast, identify_friction(jittered, fast.axis))


@pytest.mark.parametrize(("position_step", "force_step"), [(1e-4, 0.0), (0.0, 1600 / 4096), (1e-4, 1600 / 4096)])
@pytest.mark.parametrize("case", [CASE, CLOSED], ids=["open", "closed"])
def test_coarse_resolution_is_survived(case, position_step, force_step):
    r = case.recording
    position = np.round(r.position / position_step) * position_step if position_step else r.position
    force = np.round(r.force / force_step) * force_step if force_step else r.force
    holds_truth(case, identify_friction(dataclasses.replace(r, position=position, force=force), case.axis))


def test_fast_recordings_are_averaged_and_stay_right():
    case = draw_case(6, Setting("multi", samples=16000, period=1e-3))
    result = identify_friction(case.recording, case.axis)
    assert result.preprocessing == ("1000 Hz averaged down to 200 Hz",)
    holds_truth(case, result)


@pytest.mark.parametrize("held", [True, False], ids=["held", "straight"])
def test_the_force_of_averaged_recordings_takes_a_mass_along_its_mean_positions(held):
    """However restless it is within the means; their plain mean errs by a quarter of what a restless force does."""
    rng = np.random.default_rng(4)
    period, ratio = 1e-3, 5
    force = rng.standard_normal(2000)
    ahead = force if held else np.append(force[1:], force[-1])
    velocity = np.concatenate([[0.0], np.cumsum(0.5 * (force + ahead)[:-1]) * period])
    moved = velocity[:-1] * period + (2.0 * force + ahead)[:-1] * period**2 / 6.0
    position = np.concatenate([[0.0], np.cumsum(moved)])
    piece = Piece(np.arange(2000) * period, force, position, np.ones(2000, dtype=np.bool_))
    mean = average_down(piece, ratio, held)
    turns = np.diff(mean.position, 2)[1:-1]

    def foretold(f):
        return ((f[:-2] + 4.0 * f[1:-1] + f[2:]) * (ratio * period) ** 2 / 6.0)[1:-1]

    assert foretold(mean.force) == pytest.approx(turns, abs=1e-9 * np.abs(turns).max())
    plain = force.reshape(-1, ratio).mean(axis=1)
    assert np.std(foretold(plain) - turns) > 0.25 * np.std(turns)


@pytest.mark.parametrize("ratio", [2, 5, 10])
def test_means_lie_where_the_axis_is_in_their_middle(ratio):
    """Not h^2/24 times the acceleration beside it: friction turns with the motion, and that would be a gap."""
    period, samples, pull = 1e-3, 4000, 5.0
    t = np.arange(samples) * period
    speed = 1.0 - np.abs((t % 2.0) - 1.0)  # of a slide that is pulled one way for a second, then the other
    position = pull * np.where(t % 2.0 < 1.0, 0.5 * speed**2, 1.0 - 0.5 * speed**2)
    mean = average_down(Piece(t, np.full(samples, pull), position, np.ones(samples, dtype=np.bool_)), ratio, held=True)
    u = mean.t % 2.0
    there = pull * np.where(u < 1.0, 0.5 * u**2, 1.0 - 0.5 * (2.0 - u) ** 2)
    away = np.abs(u - 1.0) < 1.0 - 3.0 * ratio * period
    away &= np.abs(u - 1.0) > 3.0 * ratio * period
    assert np.abs(mean.position - there)[away].max() < 1e-12
    plain = position[: len(mean.t) * ratio].reshape(-1, ratio).mean(axis=1)
    assert np.abs(plain - there)[away].min() > 0.9 * pull * ((ratio * period) ** 2 - period**2) / 24.0


@pytest.mark.parametrize("samples", [0, 1, 4, 5, 9, 10, 14, 15, 21])
def test_a_piece_of_a_few_means_is_averaged_like_any_other(samples):
    """A piece of three samples between two faults ended a diagnosis."""
    t = np.arange(samples) * 1e-3
    mean = average_down(Piece(t, np.full(samples, 2.0), t**2, np.ones(samples, dtype=np.bool_)), 5, held=True)
    assert len(mean.t) == len(mean.force) == len(mean.position) == samples // 5
    assert mean.force == pytest.approx(np.full(samples // 5, 2.0))


def test_a_mean_force_runs_through_its_sample_as_its_neighbours_say():
    ramp = dataclasses.replace(CASE.recording, force=30.0 * CASE.recording.t, hold=TorqueHold.MEAN)
    samples = prepare(ramp, CASE.axis)
    start, end = samples.ends
    assert 0.5 * (start + end) == pytest.approx(samples.force)
    assert (end - start)[1:-1] == pytest.approx(30.0 * samples.sample_time)
    held = prepare(dataclasses.replace(ramp, hold=TorqueHold.HOLD), CASE.axis)
    assert all(np.array_equal(end, held.force) for end in held.ends)


def test_a_wrong_nominal_sample_time_is_said_and_not_used():
    result = identify_friction(dataclasses.replace(CASE.recording, sample_time=0.02), CASE.axis)
    assert "nominal sample time 0.02 s not used" in result.preprocessing[0]
    holds_truth(CASE, result)


def test_a_wrapped_angle_is_unwrapped():
    angle = 30.0 * np.sin(np.linspace(0, 12, 3000))
    wrapped = (angle + 12.5) % 25.0 - 12.5
    straight, wraps, turn = unwrapped(wrapped)
    assert wraps == np.count_nonzero(np.abs(np.diff(wrapped)) > 20.0) == 7
    assert turn == pytest.approx(25.0, rel=1e-3)
    assert np.allclose(straight - straight[0], angle - angle[0], atol=0.1)


def test_an_angle_that_never_wraps_is_left_alone():
    angle = 3.0 * np.sin(np.linspace(0, 12, 3000))
    assert unwrapped(angle)[1] == 0


def test_a_cubic_does_not_bend_whatever_the_clock():
    t = np.cumsum(np.random.default_rng(1).uniform(0.5, 1.5, 50))
    assert np.abs(bend(t, 1 + t - 2 * t**2 + 0.1 * t**3)).max() < 1e-8


def test_equal_readings_with_gentle_ends_are_no_freeze():
    ramp = np.concatenate([np.linspace(0, 1, 50) ** 2 - 1, np.zeros(20), np.linspace(0, 1, 50) ** 2])
    assert not frozen(ramp, 0.1).any()
    assert frozen(np.concatenate([np.arange(50.0), np.full(20, 49.0), 70 + np.arange(50.0)]), 2.0).sum() == 20


def test_a_run_of_one_sample_has_no_velocity():
    samples = prepare(
        Recording(t=np.arange(300) * 0.01, force=np.ones(300), position=np.linspace(0, 3, 300)), paper_axis()
    )
    run = (np.arange(len(samples)) >= len(samples) - 1).astype(np.int64)
    velocity = smooth_velocity(dataclasses.replace(samples, run=run))
    assert velocity[-1] == 0.0
    assert velocity[:-1] == pytest.approx(np.full(len(samples) - 1, 3 / 2.99), rel=1e-6)
