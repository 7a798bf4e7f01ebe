"""Gains of the observer for two masses, against scipy's Riccati solver, and what a rigid machine's would leave."""

import numpy as np
import pytest
from scipy.linalg import expm, solve_discrete_are

from identify.kernels.transmission_gain import (
    ALIKE,
    ALIKE_LATENT,
    ALIKE_SPEED,
    DECAY,
    GAINS,
    JOLTS,
    LATENT,
    LOAD,
    LOAD_SPEED,
    MOTOR,
    MOTOR_SPEED_GAIN,
    transmission_gains,
)
from identify.observer import FREE_RUN, gain_table, kalman_gain
from plant.kernels.laws import DAMPING, LANES, MASS, MOTOR_MASS, MOTOR_POSITION, POSITION, STIFFNESS

BOTH_MASSES = [LOAD, LOAD_SPEED, LATENT, DECAY, MOTOR, MOTOR_SPEED_GAIN]
LOAD_MASS, MOTORS_MASS, TAU, RHO = 50.0, 20.0, 0.15, 1000.0


def block(stiffness, damping):
    """Machines that differ by the damping of their transmission alone, the first with `damping`."""
    b = np.zeros((STIFFNESS // LANES + 8) * LANES)
    for row, value in ((MASS, LOAD_MASS), (MOTOR_MASS, MOTORS_MASS), (STIFFNESS, stiffness)):
        b[row : row + LANES] = value
    b[DAMPING : DAMPING + LANES] = damping * np.arange(1, LANES + 1)
    return b


def rigid_gains(step):
    return np.repeat(np.array(kalman_gain(step, TAU, RHO))[:, None], LANES, axis=1)


def moves(stiffness, damping, step):
    """How load, motor and latent acceleration (y, v, y_m, v_m, d) move in one sample, in SI units."""
    k, c, m, w = stiffness, damping, LOAD_MASS, MOTORS_MASS
    rates = np.array(
        [
            [0.0, 1.0, 0.0, 0.0, 0.0],
            [-k / m, -c / m, k / m, c / m, (m + w) / m],
            [0.0, 0.0, 0.0, 1.0, 0.0],
            [k / w, c / w, -k / w, -c / w, 0.0],
            [0.0, 0.0, 0.0, 0.0, 0.0],
        ]
    )
    transition = expm(rates * step)
    transition[4, 4] = np.exp(-step / TAU)
    return transition


def by_scipy(stiffness, damping, step, measured):
    """Gains of y, v, y_m, v_m and d, in SI units."""
    m, w = LOAD_MASS, MOTORS_MASS
    units = np.array([1.0, step, 1.0, step, step**2])
    transition = moves(stiffness, damping, step) * units[:, None] / units
    noise = np.zeros((5, 5))
    noise[4, 4] = (RHO * step**2) ** 2 * (1.0 - transition[4, 4] ** 2)
    jolt = RHO * step * np.sqrt(JOLTS * step) * (m + w) * np.array([0.0, 1.0 / m, 0.0, -1.0 / w, 0.0])
    noise += np.outer(jolt, jolt)
    of = np.eye(5)[[measured]]
    covariance = solve_discrete_are(transition.T, of.T, noise, np.eye(1))
    return covariance[:, measured] / (covariance[measured, measured] + 1.0) / units


@pytest.mark.parametrize(("observed", "measured"), [(POSITION, 0), (MOTOR_POSITION, 2)])
@pytest.mark.parametrize("step", [0.001, 0.01])
def test_both_masses_are_corrected_as_the_riccati_equation_says(observed, measured, step):
    gains = transmission_gains(block(2e5, 300.0), rigid_gains(step), observed, step, 3)
    for j in range(3):
        expected = by_scipy(2e5, 300.0 * (j + 1), step, measured)
        found = gains[[LOAD, LOAD_SPEED, MOTOR, MOTOR_SPEED_GAIN, LATENT], j]
        assert found == pytest.approx(expected, rel=1e-5)
    assert (gains[:, 3:] == gains[:, 2:3]).all()  # nobody asks for the machines behind


@pytest.mark.parametrize("observed", [POSITION, MOTOR_POSITION])
def test_a_transmission_that_does_not_give_is_corrected_like_a_rigid_machine(observed):
    for rigid in gain_table(0.002)[0].T:
        rows = np.repeat(rigid[:, None], LANES, axis=1)
        gains = transmission_gains(block(1e12, 1e5), rows, observed, 0.002, LANES)
        assert gains[BOTH_MASSES, 0] == pytest.approx(rigid[[0, 1, 2, 3, 0, 1]], rel=1e-3)


@pytest.mark.parametrize(("stiffness", "damping"), [(np.inf, 1.0), (np.nan, 1.0), (2e5, np.inf), (1e30, 0.0)])
def test_a_candidate_that_no_machine_is_has_the_gains_of_a_rigid_one(stiffness, damping):
    rigid = rigid_gains(0.005)
    gains = transmission_gains(block(stiffness, damping), rigid, POSITION, 0.005, LANES)
    assert (gains[BOTH_MASSES] == rigid[[0, 1, 2, 3, 0, 1]]).all()


def test_in_a_gap_both_masses_have_the_gains_of_a_rigid_machine_and_a_free_run_has_none():
    rigid = rigid_gains(0.005)
    gains = transmission_gains(block(2e5, 300.0), rigid, POSITION, 0.005, LANES)
    assert gains.shape == (GAINS, LANES)
    assert not np.isclose(gains[BOTH_MASSES], rigid[[0, 1, 2, 3, 0, 1]], rtol=1e-3).all()
    assert (gains[ALIKE:] == rigid[:3]).all()
    free = np.repeat(np.array(FREE_RUN)[:, None], LANES, axis=1)
    assert not transmission_gains(block(2e5, 300.0), free, POSITION, 0.005, LANES).any()


def test_a_transmission_that_rings_unforeseen_is_quieted_by_the_observer():
    """Rigid gains, which move both masses alike, leave it to the damping of the transmission."""
    step, damping = 0.002, 60.0
    own = transmission_gains(block(2e5, damping), rigid_gains(step), MOTOR_POSITION, step, LANES)[:, 0]
    left = []
    for rows in (
        [ALIKE, ALIKE_SPEED, ALIKE, ALIKE_SPEED, ALIKE_LATENT],
        [LOAD, LOAD_SPEED, MOTOR, MOTOR_SPEED_GAIN, LATENT],
    ):
        error, seen = np.array([0.0, 0.0, 1e-4, 0.0, 0.0]), []
        for _ in range(150):
            seen.append(error[2])
            error = moves(2e5, damping, step) @ (error - own[rows] * error[2])
        left.append(np.sqrt(np.mean(np.square(seen[75:]))))
    assert left[1] < 0.3 * left[0]
