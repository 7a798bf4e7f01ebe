"""The way of a mass over one sub-step: exact where the force grows evenly, jumps or settles inside it."""

import numpy as np
import pytest

from plant.axis import Axis, Mechanics, Orientation, TorqueHold
from plant.friction import StribeckFriction
from plant.kernels.step import advance_velocity
from plant.simulation import simulate

FLAT = Axis("flat", Mechanics(Orientation.HORIZONTAL, M=20.0, J=5.0 * 0.05**2, Rc=0.05, Rm=0.01))
HELD, STRAIGHT = TorqueHold.HOLD, TorqueHold.LINEAR
SLIPPERY = StribeckFriction(0.0, 0.0, 0.1, 0.0)
MASS, DT = 25.0, 0.01
RESTLESS = 200.0 * np.random.default_rng(5).standard_normal(40)


def slid(substeps, hold, force=RESTLESS, **effects):
    """Positions of a mass without friction that is under way. (n,) [m]"""
    torque, start = force / FLAT.mechanics.gain, {"sample_time": DT, "velocity0": 5.0}
    moved = simulate(FLAT, SLIPPERY, torque, hold=hold, effects=effects, substeps=substeps, **start)
    assert (moved.velocity > 1.0).all()
    return moved.position


def test_a_force_that_grows_evenly_moves_a_mass_as_a_pencil_says():
    change = np.diff(RESTLESS) / MASS
    acceleration = RESTLESS[:-1] / MASS
    speed = 5.0 + np.concatenate([[0.0], np.cumsum(DT * (acceleration + 0.5 * change))])
    way = DT * speed[:-1] + DT**2 * (acceleration / 2.0 + change / 6.0)
    np.testing.assert_allclose(slid(1, STRAIGHT), np.concatenate([[0.0], np.cumsum(way)]), rtol=1e-13)


@pytest.mark.parametrize(
    ("hold", "effects"),
    [
        (HELD, {"dead_time": {"delay": 0.0137}}),
        (STRAIGHT, {"dead_time": {"delay": 0.0137}}),
        (HELD, {"actuator_lag": {"time_constant": 0.02}}),
        (HELD, {"actuator_lag": {"time_constant": 1e-4}}),
        (HELD, {"torque_saturation": {"limit": 1.5}}),
    ],
)
def test_a_force_that_jumps_settles_or_is_cut_off_inside_a_sub_step_moves_a_mass_exactly(hold, effects):
    np.testing.assert_allclose(slid(1, hold, **effects), slid(64, hold, **effects), rtol=0.0, atol=1e-12)


def test_a_drive_at_its_limit_pushes_evenly():
    limit = {"torque_saturation": {"limit": 0.5}}
    beyond = 300.0 + np.abs(RESTLESS)
    np.testing.assert_allclose(slid(1, STRAIGHT, beyond, **limit), slid(64, STRAIGHT, beyond, **limit), atol=1e-12)


@pytest.mark.parametrize("ramp", [-40.0, 0.0, 40.0])
def test_beside_friction_the_way_errs_with_the_fourth_power_of_the_sub_step(ramp):
    """The velocity's own error is of third order; before the way followed how the force grows, so was its."""

    def error(step, parts):
        way, v = 0.0, 0.05
        for i in range(parts):
            force = 30.0 + ramp * ((i + 0.5) / parts - 0.5) * step / 0.01
            v, mean = advance_velocity(
                v, force, ramp * step / 0.01 / parts, MASS * parts / step, 20.0, 15.0, 20.0, 60.0
            )
            way += step / parts * mean
        return way

    errors = [abs(error(step, 1) - error(step, 2000)) for step in (0.01, 0.005)]
    assert errors[0] / errors[1] > 12.0
