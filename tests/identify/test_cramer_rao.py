"""The bound that the study of errors is held against: right where it can be said in closed form, and respected."""

import numpy as np
import pytest

from identify import identify_friction
from tests.identify.studies.cramer_rao import bound, information
from tests.identify.studies.machines import FRICTION, Setting, draw_case


def test_of_a_free_constant_speed_it_is_that_of_a_straight_line():
    n, h, noise = 400, 0.01, 1e-3
    law = np.array([10.0, 10.0, -5.0, 0.0, 0.0])  # F_c alone: the mass falls behind by F_c t^2 / 2 m
    mass, speed = 20.0, 5.0
    velocity = speed * np.ones(n)
    known = information(velocity, 10.0 * np.ones(n), law, mass, h, noise, 1e-9, 0.9)
    t = h * np.arange(n - 1)
    design = np.stack([np.ones(n - 1), t, 0.5 * t**2 / mass], axis=1)  # unknown start, and the force
    exact = np.linalg.inv(design.T @ design / noise**2 + np.diag([1.0, 1.0, 0.0]))[2, 2]
    assert 1.0 / known[0, 0] == pytest.approx(exact, rel=1e-3)


def test_nobody_beats_it_and_we_come_near():
    setting = Setting("multi", samples=2000)
    ratios = []
    for seed in range(9100, 9112):
        case = draw_case(seed, setting)
        result = identify_friction(case.recording, case.axis, seed=seed)
        errors = np.array([np.log(result.parameters[name].value / case.truth[name]) for name in FRICTION])
        ratios.append(errors / bound(case, setting))
    rms = np.sqrt(np.mean(np.square(ratios)))  # 48 numbers: 10 % of scatter
    assert 0.7 < rms < 2.0
