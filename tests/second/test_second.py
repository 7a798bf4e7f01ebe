"""The second simulator converges, obeys a law one can write down, draws the same again, and labels what it hid."""

import numpy as np
import pytest

from .cases import MOTIONS, PAIRS, TARGETS, CaseSpec, Course, UndrawableError, draw_case
from .effects import EFFECTS, draw_effect
from .machine import HELD, run
from .motion import KINDS, draw_motion
from .outside import COORDINATES, OUTSIDE, draw_outside
from .parameters import FIELDS, record
from .plants import base_values, draw_plant

DURATION = 8.0  # s


def drawn(name, seed=3, variant=0):
    """A machine with a motion that suits `name`, and its values without and with it at its first size."""
    rng = np.random.default_rng([99, seed])
    plant = draw_plant(rng, {name}, variant)
    plant.duration = DURATION
    base = base_values(rng, plant, {name})
    kind = MOTIONS.get(name, ("jerk",))[0]
    motion = draw_motion(rng, kind, DURATION, plant.drive_period, plant.low, plant.high, plant.v_max, plant.a_max)
    n = len(motion[0]) - len(motion[0]) % plant.per_sample
    still = [np.zeros(n)]
    course = Course(plant, [[np.ascontiguousarray(series[:n]) for series in motion]], still, still)
    plant.stroke = course.span[1] - course.span[0]
    plant.peak_force = float(np.abs(course.run(base)[0].current).max())
    if name == "nothing":
        return course, base, base
    draw = draw_outside(rng, name, plant, course.span) if name in OUTSIDE else None
    draw = draw or draw_effect(rng, name, plant, course.span, variant)
    return course, base, base | draw.of(draw.first).fields


@pytest.mark.parametrize(
    ("name", "variant"),
    [("nothing", 0), ("rail_defect", 0), ("presliding_hysteresis", 0), ("presliding_hysteresis", 1), ("backlash", 0),
     ("transmission_compliance", 0), ("dwell_time_stiction", 0), ("end_stop", 0), ("pendulum", 0)],
)  # fmt: skip
def test_a_quarter_of_the_step_changes_next_to_nothing(name, variant):
    course, _, values = drawn(name, variant=variant)
    coarse = course.run(values)[0]
    course.plant.substeps *= 4
    fine = course.run(values)[0]
    assert np.sqrt(np.mean((coarse.position - fine.position) ** 2)) < 2e-6 * course.plant.stroke
    assert np.sqrt(np.mean((coarse.command - fine.command) ** 2)) < 2e-3 * course.plant.coulomb


@pytest.mark.parametrize("name", [*EFFECTS, *OUTSIDE])
def test_everything_that_can_be_hidden_moves_something(name):
    course, base, values = drawn(name)
    without, with_it = course.run(base)[0], course.run(values)[0]
    changed = np.abs(with_it.command - without.command).max() / course.plant.coulomb
    assert changed > 0.01
    assert np.isfinite(with_it.position).all()


def test_constant_speed_needs_the_force_of_the_law():
    values = {"motor_mass": 2.0, "coulomb": 10.0, "static": 14.0, "stribeck": 0.05, "stribeck_exponent": 1.3,
              "viscous": 30.0, "weight": 5.0, "torque_scale": 1.0, "speed_gain": 120.0, "integral_gain": 1200.0,
              "position_gain": 12.0, "speed_filter": 0.001, "weight_forward": 5.0, "smooth_speed": 0.01,
              "integral_limit": 1e3, "command_limit": 1e9}  # fmt: skip
    n, period, v = 4000, 0.001, 0.08
    motion = [v * period * np.arange(n), np.full(n, v), np.zeros(n)]
    moved = run(record(values), motion, np.zeros(n), np.zeros(n), period, 20, 1, HELD)
    expected = 10.0 + 4.0 * np.exp(-((v / 0.05) ** 1.3)) + 30.0 * v + 5.0
    assert moved.command[-500:] == pytest.approx(expected, rel=1e-3)


def test_the_same_generator_gives_the_same_case_and_its_label_says_what_is_in_it():
    spec = CaseSpec("single", ("force_offset",))
    first, again = (next(cases(spec, 41)) for _ in range(2))
    assert first.axis == again.axis
    assert all(np.array_equal(a.values, b.values) for a, b in zip(first.tables, again.tables, strict=True))
    assert first.labels == again.labels
    assert set(first.labels["effects"]) == {"force_offset"}
    assert first.labels["severity_ratio"] > 1
    assert first.labels["shapes"] == {}


def cases(spec, seed):
    """Cases of `spec`, without the draws that show nothing."""
    for attempt in range(20):
        try:
            yield draw_case(np.random.default_rng([seed, attempt]), spec)
        except UndrawableError:
            continue


def test_names_in_the_tables_are_names_of_something():
    hidden = {*EFFECTS, *OUTSIDE}
    assert {*MOTIONS, *TARGETS} <= hidden
    assert {name for pair in PAIRS for name in pair} <= set(EFFECTS)
    assert set(COORDINATES) == set(OUTSIDE)
    assert {kind for kinds in MOTIONS.values() for kind in kinds} <= set(KINDS)
    assert len(set(FIELDS)) == len(FIELDS)
