"""How long a burst of 2000 samples takes to make; a time-lapse wants at most 10 ms."""

from __future__ import annotations

import numpy as np
import pytest

from plant.motion import ClosedLoop, simulate_motion
from plant.presets import paper_axis, paper_friction
from plant.profiles import ProductionCycle
from plant.scenario_file import read_scenario

CYCLE = ProductionCycle((0.5, 1.3, 0.9), (0.5, 0.3, 0.6), 0.6, 3.0, 30.0)


@pytest.mark.parametrize("name", ["wear", "rail_defect", "production"])
def test_a_burst_of_a_scenario(benchmark, name):
    scenario = read_scenario(name)
    burst = benchmark(scenario.burst, len(scenario) - 1)
    assert len(burst.recording) == 2000
    assert 0.2 < np.ptp(burst.recording.position) < 1.0


@pytest.mark.parametrize(
    "effects",
    [
        {},
        {"rail_defect": {"amplitude": 40.0, "centre": 1.0, "width": 0.02}},
        {"presliding_hysteresis": {"bristle_stiffness": 1e5, "bristle_damping": 300.0}},
        {"backlash": {"gap": 3e-4}},
    ],
    ids=lambda effects: next(iter(effects), "baseline"),
)
def test_twenty_seconds_of_a_one_kilohertz_loop(benchmark, effects):
    axis, law = paper_axis("paper-bump"), paper_friction("paper-bump")
    run = benchmark(simulate_motion, axis, law, ClosedLoop(CYCLE), 20.0, effects=effects)
    assert np.abs(run.position - run.wanted).max() < 3e-3
