"""Closed-loop motion: the controller's laws, its limits, and what a recording takes of it."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from plant.axis import Axis, Mechanics, Orientation, TorqueHold
from plant.effects import CATALOGUE, find
from plant.errors import ParameterError
from plant.friction import StribeckFriction
from plant.motion import Cascade, ClosedLoop, record_motion, simulate_motion
from plant.presets import paper_axis, paper_friction
from plant.profiles import PointToPoint, ProductionCycle, SineMotion

PAPER = paper_axis("paper-bump")
LAW = paper_friction("paper-bump")
CYCLE = ProductionCycle((0.5, 1.3, 0.9), (0.5, 0.3, 0.6), 0.6, 3.0, 30.0)
FREE = StribeckFriction(0.0, 0.0, 0.1, 0.0)
CART = Axis("cart", Mechanics(Orientation.HORIZONTAL, M=10.0))
SIZES = {  # one plausible value each
    "force_offset": {"force": 20.0},
    "coulomb_asymmetry": {"asymmetry_ratio": 0.2},
    "viscous_asymmetry": {"asymmetry_ratio": 0.3},
    "position_dependent_friction": {"relative_slope": 0.3},
    "rail_defect": {"amplitude": 40.0, "centre": 1.0, "width": 0.02},
    "presliding_hysteresis": {"bristle_stiffness": 1e5, "bristle_damping": 300.0},
    "backlash": {"gap": 3e-4},
    "transmission_compliance": {"stiffness": 2e5, "damping": 100.0},
    "torque_ripple": {"amplitude": 10.0},
    "pulley_eccentricity": {"relative_eccentricity": 0.05},
    "load_dependent_friction": {"coefficient": 0.1},
    "thermal_drift": {"relative_drop": 0.5, "time_constant": 5.0},
    "quadratic_drag": {"coefficient": 50.0},
    "position_spring": {"stiffness": 100.0, "rest_position": 0.5},
    "inertia_error": {"mass_error": 3.0},
    "torque_scale_error": {"relative_error": 0.1},
    "actuator_lag": {"time_constant": 0.005},
    "dead_time": {"delay": 0.004},
    "torque_saturation": {"limit": 4.9},
    "dwell_time_stiction": {"stiction_rise": 40.0, "time_constant": 0.3},
    "end_stop": {"position": 1.2, "stiffness": 2e4},
    "step_change": {"step": 30.0, "time": 3.0},
}


def drive(reference, axis=PAPER, law=LAW, duration=5.0, torque="sample", **settings):
    options = {name: settings.pop(name) for name in ("effects", "substeps", "known") if name in settings}
    return simulate_motion(axis, law, ClosedLoop(reference, Cascade(**settings), torque), duration, **options)


@pytest.mark.parametrize("reference", [CYCLE, SineMotion(1.0, 0.2, 0.2), PointToPoint(0.5, 1.5, 0.5, 2.0, 20.0)])
def test_a_loop_follows_its_reference(reference):
    run = drive(reference)
    assert np.abs(run.position - run.wanted).max() < 2e-3
    assert np.ptp(run.position) > 0.35


def test_a_position_step_without_friction_answers_as_the_linear_loop_does():
    """m y'' = k_v (K_v (1 - y) - y'): second order with poles of s² + (k_v/m) s + (k_v/m) K_v."""
    step = PointToPoint(0.0, 1.0, 1e6, 1e9)
    gain, rate = 5.0, 40.0
    run = drive(
        step,
        CART,
        FREE,
        2.0,
        position_gain=gain,
        velocity_gain=rate * 10.0,
        integral_time=None,
        velocity_feedforward=0.0,
        loop_time=1e-4,
    )
    p, q = np.roots([1.0, rate, rate * gain]).real
    expected = 1 + (q * np.exp(p * run.t) - p * np.exp(q * run.t)) / (p - q)
    np.testing.assert_allclose(run.position, expected, atol=2e-3)


def test_integral_action_removes_the_error_that_friction_and_weight_leave():
    move = PointToPoint(0.5, 1.0, 0.5, 2.0)
    proportional = drive(move, duration=8.0, integral_time=None, weight_feedforward=False)
    integral = drive(move, duration=8.0, weight_feedforward=False)
    assert abs(proportional.position[-1] - 1.0) > 1e-4
    assert abs(integral.position[-1] - 1.0) < 1e-5


def test_acceleration_feed_forward_lowers_the_following_error():
    without, with_it = (
        drive(CYCLE, law=FREE, acceleration_feedforward=share, integral_time=None) for share in (0.0, 1.0)
    )
    assert np.abs(with_it.position - with_it.wanted).max() < 0.1 * np.abs(without.position - without.wanted).max()


def test_the_force_never_exceeds_the_limit_and_the_integrator_does_not_wind_up():
    rated = 2.0 * PAPER.mechanics.weight / PAPER.mechanics.gain
    move = PointToPoint(0.3, 1.5, 2.0, 20.0)
    run = drive(move, torque_limit=rated, duration=6.0)
    limit = rated * PAPER.mechanics.gain
    assert np.abs(run.force).max() == pytest.approx(limit)
    assert (np.abs(run.force) > 0.999 * limit).mean() > 0.05
    assert run.position.max() < 1.5 + 0.05
    assert run.position[-1] == pytest.approx(1.5, abs=1e-3)


def test_a_coarse_encoder_makes_the_torque_rough_but_keeps_the_axis_in_place():
    fine, coarse = (drive(CYCLE, encoder_resolution=step, velocity_filter=0.001) for step in (1e-8, 1e-5))
    assert np.abs(coarse.position - coarse.wanted).max() < 3e-3
    assert np.std(np.diff(coarse.force)) > 2 * np.std(np.diff(fine.force))


def test_the_default_sub_steps_are_fine_enough():
    coarse, fine = drive(CYCLE), drive(CYCLE, substeps=16)
    assert np.abs(coarse.position - fine.position).max() < 1e-5
    assert np.abs(coarse.force - fine.force).mean() < 0.1


def test_the_quick_path_without_laws_marches_as_the_one_with_laws_does():
    nearly_nothing = {"rail_defect": {"amplitude": 1e-12, "centre": 0.0, "width": 0.01}}
    quick, general = drive(CYCLE, substeps=2), drive(CYCLE, substeps=2, effects=nearly_nothing)
    np.testing.assert_allclose(quick.position, general.position, atol=1e-10)
    np.testing.assert_allclose(quick.friction_force[1:], general.friction_force[1:], atol=1e-6)


def test_the_rigid_motion_obeys_the_equation_of_motion():
    run = drive(SineMotion(1.0, 0.2, 0.5), substeps=8)
    acceleration = np.diff(run.velocity) / 1e-3
    balance = run.force[:-1] - PAPER.mechanics.moving_mass * acceleration - PAPER.mechanics.weight
    sliding = np.minimum(np.abs(run.velocity[:-1]), np.abs(run.velocity[1:])) > 0.02
    middle = 0.5 * (run.velocity[1:] + run.velocity[:-1])
    np.testing.assert_allclose(balance[sliding], LAW.force(middle[sliding]), atol=0.2)


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_effect_runs_in_the_loop_and_is_felt(name):
    soft = {"position_gain": 8.0, "velocity_gain": 800.0, "integral_time": 0.1}  # stable with a soft belt, too
    plain, run = drive(CYCLE, **soft), drive(CYCLE, effects={name: SIZES[name]}, **soft)
    assert find(name).parameters
    assert np.isfinite(run.position).all()
    assert np.abs(run.force - plain.force).max() > 1.0
    assert np.abs(run.position - run.wanted).max() < 0.2


def test_a_dead_time_acts_late_in_the_loop_too():
    """Without friction, weight and feedback of position, a delayed force is the same force later."""
    reference = PointToPoint(0.0, 0.5, 0.5, 2.0, 20.0)  # begins without acceleration
    settings = {"position_gain": 1e-9, "velocity_gain": 1e-6, "integral_time": None, "acceleration_feedforward": 1.0}
    early = drive(reference, CART, FREE, 3.0, **settings)
    late = drive(reference, CART, FREE, 3.0, effects={"dead_time": {"delay": 0.25}}, **settings)
    np.testing.assert_allclose(late.velocity[250:], early.velocity[:-250], atol=2e-3)


def test_a_recording_takes_every_tenth_tick_or_the_mean_of_ten():
    loop = ClosedLoop(CYCLE, torque="mean")
    run = simulate_motion(PAPER, LAW, loop, 5.0)
    mean = record_motion(run, loop, 0.01)
    sample = record_motion(run, dataclasses.replace(loop, torque="sample"), 0.01)
    np.testing.assert_allclose(mean.force, run.force.reshape(-1, 10).mean(axis=1))
    np.testing.assert_array_equal(sample.force, run.force[::10])
    np.testing.assert_array_equal(mean.position, run.position[::10])
    assert (mean.hold, sample.hold, mean.loop) == (TorqueHold.MEAN, TorqueHold.UNKNOWN, "closed")
    assert record_motion(run, loop, 0.001).hold == TorqueHold.HOLD


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Cascade(position_gain=0.0), "cascade: position_gain is 0 1/s, but must be > 0 1/s"),
        (lambda: Cascade(velocity_gain=-1.0), r"cascade: velocity_gain is -1 N\*s/m"),
        (lambda: Cascade(integral_time=0.0), "cascade: integral_time is 0 s"),
        (lambda: Cascade(torque_limit=0.0), r"cascade: torque_limit is 0 N\*m"),
        (lambda: Cascade(encoder_resolution=-1.0), "cascade: encoder_resolution is -1 m, but must be >= 0 m"),
        (lambda: drive(CYCLE, duration=0.0), "duration is 0 s, but must be >= loop_time = 0.001 s"),
        (lambda: ClosedLoop(CYCLE).factor(0.0015), "sample_time is 0.0015 s, but must be a multiple of"),
    ],
)
def test_a_value_out_of_range_names_itself(make, words):
    with pytest.raises(ParameterError, match=words):
        make()
