"""What a pencil, an energy book or SciPy's solver says about the machine, and what the machine does."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from plant.axis import Axis, Mechanics, Orientation, Sensor, TorqueHold
from plant.effects import find
from plant.effects.effect import Surroundings
from plant.friction import StribeckFriction
from plant.kernels.laws import SPEED
from plant.kernels.machine import advance_sample
from plant.machine import Plan
from plant.presets import paper_axis, paper_friction
from plant.simulation import simulate

MASS, MOTOR_MASS, GAIN = 20.0, 5.0, 100.0
MECHANICS = Mechanics(Orientation.HORIZONTAL, M=MASS, J=MOTOR_MASS * 0.05**2, Rc=0.05, Rm=0.01)
FLAT = Axis("flat", MECHANICS)
SLIPPERY = StribeckFriction(0.0, 0.0, 0.1, 0.0)
TOTAL = MASS + MOTOR_MASS
DT = 0.01


def push(force, n=1000, axis=FLAT, friction=SLIPPERY, **more):
    """Simulate under a force [N], one value or one per sample, at 100 Hz."""
    torque = np.broadcast_to(np.asarray(force, float), n) / axis.mechanics.gain
    return simulate(axis, friction, torque, **{"sample_time": DT, **more})


@pytest.mark.parametrize("pull", [-55.0, 0.0, 55.0])
@pytest.mark.parametrize("reading", ["paper-literal", "paper-bump"])
def test_a_vertical_mass_held_by_friction_stays_exactly_where_it_is(reading, pull):
    axis = paper_axis(reading)
    path = push(axis.mechanics.weight + pull, 20_000, axis, paper_friction(reading), position0=0.123)
    assert (path.position == 0.123).all()
    assert (path.velocity == 0.0).all()
    np.testing.assert_allclose(path.friction_force, pull, atol=1e-10)


def test_it_breaks_away_at_the_static_force_and_not_before():
    friction = StribeckFriction(50.0, 80.0, 0.05, 100.0)
    assert (push(79.9, friction=friction).position == 0.0).all()
    assert push(80.1, friction=friction).position[-1] > 0.1


def test_under_a_constant_force_the_speed_settles_where_friction_equals_it():
    friction = StribeckFriction(50.0, 80.0, 0.05, 100.0)
    path = push(120.0, 3000, friction=friction)
    expected = brentq(lambda v: friction.force(v) - 120.0, 0.1, 5.0, xtol=1e-14)
    assert path.velocity[-1] == pytest.approx(expected, rel=1e-9)
    assert path.friction_force[-1] == pytest.approx(120.0, rel=1e-9)


def test_viscous_friction_alone_is_an_exponential_decay():
    path = push(0.0, friction=StribeckFriction(0.0, 0.0, 0.1, 50.0), velocity0=1.0)
    np.testing.assert_allclose(path.velocity, np.exp(-50.0 / TOTAL * path.t), atol=5e-6)
    np.testing.assert_allclose(path.position, TOTAL / 50.0 * -np.expm1(-50.0 / TOTAL * path.t), atol=5e-6)


def test_coulomb_friction_alone_stops_the_mass_after_v_squared_over_two_a():
    path = push(0.0, friction=StribeckFriction(50.0, 50.0, 0.1, 0.0), velocity0=1.003, substeps=1)
    assert path.position[-1] == pytest.approx(1.003**2 * TOTAL / (2 * 50.0), rel=1e-12), "it stops within a sub-step"
    assert path.velocity[-1] == 0.0


@pytest.mark.parametrize("reading", ["paper-literal", "paper-bump"])
def test_energy_is_booked_and_none_is_made(reading):
    """Not to the last digit: the way follows how the forces grow inside a sub-step, their book values are means."""
    axis, friction = paper_axis(reading), paper_friction(reading)
    force = axis.mechanics.weight + 155.0 * np.sin(2 * np.pi * 0.2 * DT * np.arange(2000))
    path = push(force, 2000, axis, friction, substeps=1)
    way = np.diff(path.position)
    work = (force[:-1] - axis.mechanics.weight) * way
    lost = work - np.diff(0.5 * 25.0 * path.velocity**2)
    turns = (path.velocity[:-1] != 0.0) & (path.velocity[1:] * path.velocity[:-1] <= 0.0)
    assert 4 <= turns.sum() < 40
    unbooked = (path.friction_force[1:] * way - lost)[~turns]
    assert np.abs(unbooked).sum() < 3e-5 * lost.sum()
    assert (lost >= -1e-12).all(), "where it turns, the mean of the friction says less than what it takes each way"


def test_bristles_give_way_like_springs_before_they_break_away():
    sticky = StribeckFriction(50.0, 80.0, 0.05, 100.0)
    ramp = np.linspace(0.0, 2.0, 2000)
    path = push(
        ramp,
        2000,
        friction=sticky,
        effects={"presliding_hysteresis": {"bristle_stiffness": 1e5, "bristle_damping": 2000.0}},
    )
    stiffness = np.polyfit(path.position[500:], ramp[500:], 1)[0]
    assert stiffness == pytest.approx(1e5, rel=0.03)  # 2 N of 80 N: bristles have begun to slip by a fortieth
    assert path.position[-1] == pytest.approx(2.0 / 1e5, rel=0.03)


def test_bristles_break_away_near_the_static_force():
    sticky = StribeckFriction(50.0, 80.0, 0.05, 100.0)
    bristles = {"presliding_hysteresis": {"bristle_stiffness": 1e6, "bristle_damping": 1000.0}}
    ramp = np.linspace(0.0, 100.0, 2000)
    path = push(ramp, 2000, friction=sticky, effects=bristles)
    assert ramp[np.argmax(path.position > 2e-3)] == pytest.approx(80.0, abs=3.0)


def test_two_masses_ring_at_the_frequency_of_the_reduced_mass():
    k = 1e5
    axis = Axis("motor-side", MECHANICS, sensor=Sensor(side="motor"))
    spring = {"transmission_compliance": {"stiffness": k, "damping": 0.0}}
    force = np.where(np.arange(4000) < 1, 0.0, 50.0)
    path = push(force, 4000, axis, effects=spring, sample_time=0.001)
    ringing = path.velocity - 50.0 / TOTAL * (path.t - 0.001)
    up = np.nonzero((ringing[:-1] < 0) & (ringing[1:] >= 0))[0]
    period = (up[-1] - up[1]) * 0.001 / (len(up) - 2)
    expected = 2 * math.pi / math.sqrt(k / (MASS * MOTOR_MASS / TOTAL))
    assert period == pytest.approx(expected, rel=1e-3)
    assert np.ptp(ringing[-200:]) == pytest.approx(np.ptp(ringing[2:202]), rel=0.02)  # nothing damps it


def test_two_masses_move_together_on_average():
    spring = {"transmission_compliance": {"stiffness": 1e6, "damping": 500.0}}
    stiff, rigid = push(50.0, effects=spring), push(50.0)
    assert np.abs(stiff.position - rigid.position).max() < 2 * 50.0 / 1e6


def test_in_the_gap_the_motor_flies_alone():
    gap, force = 4e-3, -10.0
    forces = np.full(400, force)
    forces[0] = 1e-9  # pressed to the upper side first
    flight = math.sqrt(2 * gap * MOTOR_MASS / -force)
    load = push(forces, 400, effects={"backlash": {"gap": gap}}, sample_time=0.001)
    landed = np.argmax(load.position < -1e-9) * 0.001
    assert landed == pytest.approx(0.001 + flight, abs=0.002)
    motor_axis = Axis("motor-side", MECHANICS, sensor=Sensor(side="motor"))
    motor = push(forces, 400, motor_axis, effects={"backlash": {"gap": gap}}, sample_time=0.001)
    t = motor.t[1:60] - 0.001
    np.testing.assert_allclose(motor.position[1:60], 0.5 * force / MOTOR_MASS * t**2, atol=1e-7)
    assert motor.velocity[-1] == pytest.approx(force / TOTAL * 0.398, rel=0.05)  # then both go as one


def test_a_lag_delays_the_speed_by_its_time_constant():
    tau = 0.05
    force = np.where(np.arange(200) < 1, 0.0, 50.0)
    path = push(force, 200, effects={"actuator_lag": {"time_constant": tau}})
    t = path.t[1:] - DT
    np.testing.assert_allclose(path.velocity[1:], 50.0 / TOTAL * (t + tau * np.expm1(-t / tau)), atol=1e-12)


@pytest.mark.parametrize("hold", [TorqueHold.HOLD, TorqueHold.LINEAR])
@pytest.mark.parametrize("delay", [0.03, 0.033, 0.0501])
def test_dead_time_shows_the_same_motion_later(hold, delay):
    friction = StribeckFriction(50.0, 50.0, 0.05, 100.0)
    force = 150.0 * np.sin(2 * np.pi * 0.7 * DT * np.arange(500))
    plain = push(force, 500, friction=friction, hold=hold, substeps=50)
    late = push(force, 500, friction=friction, hold=hold, substeps=50, effects={"dead_time": {"delay": delay}})
    past = np.interp(late.t - delay, plain.t, plain.position)
    chord = 150.0 / TOTAL * DT**2 / 8  # what np.interp leaves out between two samples
    assert np.abs(late.position - past).max() < chord


def test_a_limit_is_a_clipped_torque_and_a_scale_a_scaled_one():
    friction = StribeckFriction(50.0, 80.0, 0.05, 100.0)
    force = 150.0 * np.sin(2 * np.pi * 0.7 * DT * np.arange(500))
    run = {"n": 500, "friction": friction, "substeps": 4}
    limited = push(force, effects={"torque_saturation": {"limit": 1.0}}, **run)
    np.testing.assert_allclose(limited.position, push(np.clip(force, -GAIN, GAIN), **run).position, atol=1e-13)
    scaled = push(force, effects={"torque_scale_error": {"relative_error": 0.1}}, **run)
    np.testing.assert_allclose(scaled.position, push(1.1 * force, **run).position, atol=1e-13)


def test_a_rounded_limit_bends_the_torque_in_a_parabola():
    """κ = 0.5 of 1 N·m: a parabola from 0.5 to 1.5 N·m, in which half the limit above its start takes off 1/8."""
    run = {"n": 400, "friction": StribeckFriction(0.0, 0.0, 0.1, 400.0), "substeps": 4}
    rounded = {"torque_saturation": {"limit": 1.0, "knee": 0.5}}
    for torque, left in ((0.4, 0.4), (0.5, 0.5), (1.0, 0.875), (-1.0, -0.875), (1.5, 1.0), (3.0, 1.0)):
        found = push(torque * GAIN, effects=rounded, **run).position
        np.testing.assert_allclose(found, push(left * GAIN, **run).position, atol=1e-13)


def test_known_effects_are_what_the_arguments_of_the_simulator_say():
    run = {"force": 150.0 * np.sin(0.044 * np.arange(500)), "n": 500, "friction": StribeckFriction(50, 80, 0.05, 100)}
    offset = push(effects={"force_offset": {"force": 5.0}}, **run)
    np.testing.assert_array_equal(offset.position, push(constant_force=5.0, **run).position)
    heavier = push(effects={"inertia_error": {"mass_error": 3.0}}, **run)
    np.testing.assert_array_equal(heavier.position, push(moving_mass=TOTAL + 3.0, **run).position)


def test_payload_weighs_on_a_vertical_axis_only():
    payload = {"inertia_error": {"mass_error": 2.0, "weight_share": 1.0}}
    axis = paper_axis()
    path = push(axis.mechanics.weight, 200, axis, SLIPPERY, effects=payload)
    assert path.velocity[-1] == pytest.approx(-2.0 * 9.81 / 27.0 * path.t[-1], rel=1e-9)
    assert push(0.0, effects=payload).velocity[-1] == 0.0


def test_an_end_stop_yields_by_force_over_stiffness_at_its_own_end():
    friction = StribeckFriction(0.0, 0.0, 0.1, 400.0)
    for sign in (1.0, -1.0):
        stop = {"end_stop": {"position": sign * 0.1, "stiffness": 1e4}}
        path = push(sign * 50.0, 2000, friction=friction, effects=stop, middle=0.0)
        assert path.position[-1] == pytest.approx(sign * (0.1 + 50.0 / 1e4), abs=1e-7)


def test_a_spring_swings_at_its_frequency_without_losing_height():
    path = push(0.0, 5000, effects={"position_spring": {"stiffness": 500.0, "rest_position": 0.1}}, substeps=20)
    omega = math.sqrt(500.0 / TOTAL)
    np.testing.assert_allclose(path.position, 0.1 - 0.1 * np.cos(omega * path.t), atol=2e-5)


@pytest.mark.parametrize("dissipation", [0.0, 0.2, 0.5])
def test_a_stop_that_damps_gives_back_less_of_the_speed(dissipation):
    """The coefficient of restitution is 1 - 2/3 α v, for little of it (Hunt & Crossley 1975)."""
    stop = {"end_stop": {"position": 0.1, "stiffness": 2e3, "dissipation": dissipation}}
    gliding = StribeckFriction(1e-6, 1e-6, 0.05, 1e-9)
    path = push(0.0, 400, friction=gliding, effects=stop, velocity0=0.2, substeps=50)
    assert path.velocity[-1] / -0.2 == pytest.approx(1.0 - 2.0 / 3.0 * dissipation * 0.2, abs=0.005)


def test_stiction_grows_at_rest_and_is_gone_after_sliding():
    friction = StribeckFriction(50.0, 50.0, 0.05, 100.0)
    dwell = {"dwell_time_stiction": {"stiction_rise": 30.0, "time_constant": 0.5}}

    def breaks_away_at(rest):
        force = np.concatenate([np.zeros(round(rest / DT)), np.linspace(0.0, 100.0, 4000), np.zeros(10)])
        path = push(force, len(force), friction=friction, effects=dwell)
        return force[np.argmax(path.position > 1e-6)]

    ramp = 20.0  # s to 50 N: by then the contact is old anyway
    assert breaks_away_at(0.0) == pytest.approx(50.0 + 30.0 * -math.expm1(-ramp / 0.5), abs=0.3)
    fast = np.concatenate([np.zeros(50), np.full(300, 70.0)])  # 0.5 s of rest: 50 + 30 (1 - 1/e) = 69.0 N
    assert push(fast, 350, friction=friction, effects=dwell).position[-1] > 0.1
    slow = np.concatenate([np.zeros(60), np.full(300, 70.0)])  # 0.6 s of rest: 71.0 N
    assert push(slow, 360, friction=friction, effects=dwell).position[-1] == 0.0


@pytest.mark.parametrize(("age", "moves"), [(0.0, True), (0.3, True), (0.5, False), (1.0, False)])
def test_stiction_may_have_grown_before_the_recording(age, moves):
    friction = StribeckFriction(50.0, 50.0, 0.05, 100.0)
    dwell = {"dwell_time_stiction": {"stiction_rise": 30.0, "time_constant": 50.0, "age": age}}
    assert bool(push(60.0, 50, friction=friction, effects=dwell).position[-1] > 0.0) is moves


@pytest.mark.parametrize(("share", "resists"), [(0.0, 50.0), (0.5, 65.0), (1.0, 80.0)])
def test_only_slip_takes_away_the_part_of_stiction_that_acts_at_any_speed(share, resists):
    friction = StribeckFriction(50.0, 50.0, 1e-5, 1e-9)
    values = {"stiction_rise": 30.0, "time_constant": 50.0, "age": 1.0, "level_share": share}
    moved = MASS + MOTOR_MASS
    path = push(200.0, 20, friction=friction, effects={"dwell_time_stiction": {**values, "slip": 1.0}})
    slipped = push(200.0, 20, friction=friction, effects={"dwell_time_stiction": {**values, "slip": 1e-6}})
    assert np.gradient(path.velocity, DT)[10] * moved == pytest.approx(200.0 - resists, rel=0.02)
    assert np.gradient(slipped.velocity, DT)[10] * moved == pytest.approx(150.0, rel=0.01)


def test_a_correction_that_friction_swallows_at_once_is_a_rest():
    """An observer moves the speed at every sample: half of every rest was missing, and the time constant halved."""
    plan = Plan(Surroundings.of(FLAT, 0.0), (find("dwell_time_stiction"),))
    values = np.array([[30.0], [1.0], [5e-4], [0.0], [0.0]])  # rise [N], time constant [s], slip [m], age, share
    blocks = plan.blocks(np.array([[50.0], [50.0], [0.05], [100.0]]), values)
    block = blocks.b[0]
    for k in range(200):  # 2 s
        block[SPEED] += 1e-5
        advance_sample(block, blocks.laws, blocks.structure, k * DT, DT, 2)
    age = block[blocks.laws[0][3]]
    assert block[SPEED] == 0.0
    assert age == pytest.approx(-math.expm1(-2.0), rel=0.02)


UP = StribeckFriction(50.0, 80.0, 0.05, 100.0)


def resisting(name, p, t, y, v, drive):
    """Friction-side force while moving up, written down once more from effects.md. [N]"""
    dry = 50.0 + 30.0 * math.exp(-v / 0.05)
    viscous = 100.0
    extra = 0.0
    match name:
        case "coulomb_asymmetry":
            dry *= 1 + p["asymmetry_ratio"]
        case "viscous_asymmetry":
            viscous *= 1 + p["asymmetry_ratio"]
        case "position_dependent_friction":
            dry *= 1 + p["relative_slope"] * (y - 0.7)
        case "rail_defect":
            dry += p["amplitude"] * math.exp(-((y - p["centre"]) ** 2) / (2 * p["width"] ** 2))
        case "torque_ripple":
            wave = math.cos(2 * math.pi * y / p["period"] + p["phase"])
            extra = p["amplitude"] * wave + p["relative_amplitude"] * drive * wave
        case "pulley_eccentricity":
            extra = drive - drive / (1 + p["relative_eccentricity"] * math.cos(y / 0.05 + p["phase"]))
        case "load_dependent_friction":
            dry += p["coefficient"] * abs(drive)
        case "thermal_drift":
            viscous *= 1 + p["relative_drop"] * math.exp(-t / p["time_constant"])
        case "quadratic_drag":
            extra = p["coefficient"] * v * abs(v)
        case "position_spring":
            extra = p["stiffness"] * (y - p["rest_position"])
    return dry + viscous * v + extra


@pytest.mark.parametrize(
    ("name", "p"),
    [
        ("baseline", {}),
        ("coulomb_asymmetry", {"asymmetry_ratio": 0.2}),
        ("viscous_asymmetry", {"asymmetry_ratio": -0.3}),
        ("position_dependent_friction", {"relative_slope": 0.2}),
        ("rail_defect", {"amplitude": 25.0, "centre": 0.9, "width": 0.05}),
        ("torque_ripple", {"period": 0.08, "amplitude": 15.0, "relative_amplitude": 0.05, "phase": 0.7}),
        ("pulley_eccentricity", {"relative_eccentricity": 0.1, "phase": -0.4}),
        ("load_dependent_friction", {"coefficient": 0.15}),
        ("thermal_drift", {"relative_drop": 0.8, "time_constant": 1.5}),
        ("quadratic_drag", {"coefficient": 60.0}),
        ("position_spring", {"stiffness": 30.0, "rest_position": 0.5}),
    ],
)
def test_smooth_motion_agrees_with_solve_ivp(name, p):
    t = np.linspace(0.0, 4.0, 4001)
    force = 150.0 + 8.0 * t

    def slope(at, state):
        drive = 150.0 + 8.0 * at
        return [state[1], (drive - resisting(name, p, at, state[0], state[1], drive)) / TOTAL]

    truth = solve_ivp(slope, (0, 4), [0.0, 0.3], method="DOP853", rtol=1e-10, atol=1e-12, max_step=0.05)
    ours = simulate(
        FLAT,
        UP,
        force / GAIN,
        t=t,
        hold=TorqueHold.LINEAR,
        effects={name: p} if p else {},
        velocity0=0.3,
        middle=0.7,
        substeps=10,
    )
    assert ours.velocity.min() > 0.05
    assert abs(ours.position[-1] - truth.y[0, -1]) < 2e-8
    assert abs(ours.velocity[-1] - truth.y[1, -1]) < 2e-8
