"""What must hold for every machine, not only for the examples."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from plant.axis import Axis, Mechanics, Orientation
from plant.friction import StribeckFriction
from plant.kernels.cosine import cos_turns
from plant.kernels.exponential import exp_neg
from plant.kernels.shift import delay_pieces
from plant.simulation import simulate
from tests.plant.effect_examples import EXAMPLES

FLAT = Axis("flat", Mechanics(Orientation.HORIZONTAL, M=20.0, J=0.0125, Rc=0.05, Rm=0.01, travel=(-1.0, 1.0)))
frictions = st.builds(
    StribeckFriction,
    st.floats(0, 200),
    st.floats(0, 200),
    st.floats(0.005, 0.5),
    st.floats(0, 400),
)
torques = st.builds(
    lambda seed, size, rough: (
        size * np.cumsum(np.random.default_rng(seed).standard_normal(300)) * rough
        + size * np.sin(0.05 * np.arange(300))
    ),
    st.integers(0, 2**32 - 1),
    st.floats(0.1, 5.0),
    st.floats(0.0, 0.2),
)
# Nothing in these prefers a direction or a place.
MIRRORED = ("presliding_hysteresis", "load_dependent_friction", "quadratic_drag", "actuator_lag", "backlash",
            "transmission_compliance", "dwell_time_stiction", "thermal_drift", "dead_time", "torque_saturation",
            "step_change", "torque_ripple_in_quadrature")  # fmt: skip
PASSIVE = ("coulomb_asymmetry", "viscous_asymmetry", "position_dependent_friction", "rail_defect", "thermal_drift",
           "load_dependent_friction", "quadratic_drag", "dwell_time_stiction", "step_change")  # fmt: skip


@settings(max_examples=25, deadline=None)
@given(friction=frictions, torque=torques, name=st.sampled_from((None, *MIRRORED)))
def test_mirrored_torque_is_mirrored_motion_on_a_level_symmetric_axis(friction, torque, name):
    effects = {name: EXAMPLES[name]} if name in EXAMPLES else {}
    there = simulate(FLAT, friction, torque, sample_time=0.01, effects=effects, substeps=3)
    back = simulate(FLAT, friction, -torque, sample_time=0.01, effects=effects, substeps=3)
    assert np.array_equal(there.position, -back.position)
    assert np.array_equal(there.velocity, -back.velocity)


@settings(max_examples=25, deadline=None)
@given(friction=frictions, torque=torques, names=st.sets(st.sampled_from(PASSIVE), max_size=3))
def test_friction_never_gives_power(friction, torque, names):
    effects = {name: EXAMPLES[name] for name in names}
    path = simulate(FLAT, friction, torque, sample_time=0.01, effects=effects, substeps=1)
    lost = path.friction_force[1:] * np.diff(path.position)
    moves_on = path.velocity[1:] * path.velocity[:-1] > 0  # else it acts both ways within this one sub-step
    power = FLAT.mechanics.gain * np.abs(torque[:-1]) * np.abs(np.diff(path.position))
    rounding = 1e-12 * max(1.0, float(power.max()))  # of the work that the drive does in a step
    assert (lost[moves_on] >= -rounding).all()
    assert lost.sum() >= -rounding * len(lost)


@settings(max_examples=25, deadline=None)
@given(friction=frictions, torque=torques, shift=st.floats(-5, 5), cut=st.integers(1, 298))
def test_a_run_may_be_cut_anywhere_and_moved(friction, torque, shift, cut):
    whole = simulate(FLAT, friction, torque, sample_time=0.01, substeps=3)
    first = simulate(FLAT, friction, torque[: cut + 1], sample_time=0.01, substeps=3)
    rest = simulate(
        FLAT,
        friction,
        torque[cut:],
        sample_time=0.01,
        substeps=3,
        position0=first.position[-1] + shift,
        velocity0=first.velocity[-1],
    )
    np.testing.assert_allclose(rest.position - shift, whole.position[cut:], atol=1e-9, rtol=1e-9)


@settings(max_examples=200, deadline=None)
@given(x=st.floats(0, 650))
def test_the_exponential_is_good_to_4e_14(x):
    assert exp_neg(x) == pytest.approx(np.exp(-x), rel=5e-14)


@settings(max_examples=200, deadline=None)
@given(x=st.floats(-1e3, 1e3))
def test_the_cosine_is_good_to_1e_12(x):
    turn = np.longdouble(x) - np.round(np.longdouble(x))
    assert cos_turns(x) == pytest.approx(float(np.cos(2 * np.longdouble(np.pi) * turn)), abs=1e-12)


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), delay=st.floats(0.0, 0.3), linear=st.booleans())
def test_a_delay_keeps_the_impulse(seed, delay, linear):
    rng = np.random.default_rng(seed)
    t = np.cumsum(rng.uniform(0.002, 0.02, 80))
    force = np.concatenate([[0.0], rng.standard_normal(40), np.zeros(39)])
    start, end = force[:-1], force[1:] if linear else force[:-1]
    end = np.ascontiguousarray(end)
    pieces = np.empty((79, 5, 2))
    delay_pieces(t, start, end, np.full(2, delay), pieces)
    assert np.array_equal(pieces[:, :, 0], pieces[:, :, 1])
    first_line, first_end, switch, second_line, second_end = pieces[:, :, 0].T
    at_switch = first_line + (first_end - first_line) * switch / 2
    behind = second_end - (second_end - second_line) * (1 - switch) / 2
    impulse = np.concatenate([[0.0], np.cumsum(0.5 * (start + end) * np.diff(t))])
    mean = at_switch * switch + behind * (1 - switch)
    late = np.concatenate([[0.0], np.cumsum(mean * np.diff(t))])
    k = np.searchsorted(t, t - delay, side="right") - 1
    inside = k >= 0
    past = t[inside] - delay - t[k[inside]]
    step = np.append(np.diff(t), 1.0)[k[inside]]
    first, last = np.append(start, 0.0)[k[inside]], np.append(end, 0.0)[k[inside]]
    expected = impulse[k[inside]] + past * (first + 0.5 * (last - first) * past / step)
    np.testing.assert_allclose(late[inside], expected, atol=1e-9)
