"""The step-halving table against 4000 sub-steps: `pytest tests/plant/test_step_halving.py -m slow -s` prints it."""

import numpy as np
import pytest

from plant.effects import CATALOGUE
from plant.presets import READINGS, paper_axis, paper_friction, paper_torque
from plant.simulation import simulate
from tests.plant.effect_examples import EXAMPLES

STEPS = (1, 2, 5, 10, 20, 50, 100)
FINE = ("presliding_hysteresis", "backlash", "transmission_compliance")


@pytest.mark.slow
@pytest.mark.parametrize("reading", READINGS)
@pytest.mark.parametrize("name", ["baseline", *CATALOGUE])
def test_position_error_over_20_seconds(reading, name):
    axis, friction = paper_axis(reading), paper_friction(reading)
    torque = paper_torque(axis)
    effects = {} if name == "baseline" else {name: EXAMPLES[name]}

    def run(substeps):
        return simulate(axis, friction, torque, effects=effects, middle=0.2, substeps=substeps)

    reference = run(4000).position
    errors = [float(np.abs(run(count).position - reference).max()) for count in STEPS]
    default = run(None)
    settled = float(np.abs(default.position - reference).max())
    order = -np.polyfit(np.log(STEPS[3:]), np.log(np.maximum(errors[3:], 1e-12)), 1)[0]
    cells = " | ".join(f"{1e6 * error:.3g}" for error in errors)
    print(f"\n| {name} | {reading[6:]} | {cells} | {order:.1f} | {default.substeps} | {1e6 * settled:.2g} |")
    assert settled < 50e-6
    assert order > 1.0 if name != "dwell_time_stiction" else order > 0.5
