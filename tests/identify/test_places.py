"""Where along its coordinate a force without a name acts: both ends of it, on a machine that shares no code with it."""

import numpy as np
import pytest

from identify.mismatch.diagnosis import diagnose
from identify.mismatch.nameless import Structure, large_enough
from identify.mismatch.uncatalogued_memory import remembers_along
from tests.identify.small_machine import AXIS, driven, dry


def rough_speeds(_, __, v):
    """A seal that flutters between 0.15 and 0.25 m/s: 1.5 N more."""
    return dry(v) + (1.5 if 0.15 < abs(v) < 0.25 else 0.0), 0.0


def detent(_, y, v):
    """A magnet at 0.2 m that draws the slide in over 25 mm on either side: 2 N at most."""
    there = abs(y - 0.2) < 0.025
    return dry(v), (2.0 * np.sin(np.pi * (y - 0.2) / 0.025) if there else 0.0)


@pytest.mark.parametrize(
    ("physics", "coordinate", "interval"),
    [(rough_speeds, "velocity", (0.15, 0.25)), (detent, "position", (0.175, 0.225))],
)
def test_a_force_has_its_coordinate_and_both_its_ends(physics, coordinate, interval):
    found = diagnose([driven(seed, physics) for seed in (1, 2)], AXIS)
    assert found.verdict.value == "unexplained"
    assert found.location.coordinate == coordinate
    low, high = found.location.interval
    shared = min(high, interval[1]) - max(low, interval[0])
    assert shared > 0.6 * (max(high, interval[1]) - min(low, interval[0]))


def joint(_, y, v):
    """Past 0.24 m the rail is preloaded harder."""
    return dry(v) + (2.5 if y > 0.24 else 0.0), 0.0


def sump(_, y, v):
    """Old grease around 0.15 m."""
    return dry(v) + 20.0 * np.exp(-(((y - 0.15) / 0.03) ** 2)) * abs(v), 0.0


def notch(_, y, v):
    """A notch in the pulley: a push around 2 rad of each turn."""
    return dry(v), 3.0 * np.exp(8.0 * (np.cos(y / 0.02 - 2.0) - 1.0))


def valve(_, __, v):
    """A valve that opens above 0.2 m/s on the way up."""
    return dry(v) + (3.0 if v > 0.2 else 0.0), 0.0


@pytest.mark.parametrize(
    ("physics", "coordinate", "interval", "like"),
    [
        (joint, "position", (0.24, 0.4), "depends on position"),
        (sump, "position", (0.1, 0.2), "old grease"),
        (notch, "pulley_angle", (1.4, 2.6), "sector of each turn"),
        (valve, "velocity", (0.2, 0.4), "one direction of motion"),
    ],
)
def test_what_acts_in_part_of_its_coordinate_is_no_defect_no_ripple_no_asymmetry(physics, coordinate, interval, like):
    """A tenth author's rail joint was a defect, the notch a ripple and an eccentricity, the valve an asymmetry."""
    found = diagnose([driven(seed, physics) for seed in (1, 2)], AXIS)
    assert found.verdict.value == "unexplained", found.effects
    assert found.location.coordinate == coordinate
    assert like in found.explanation
    low, high = found.location.interval
    assert min(high, interval[1]) - max(low, interval[0]) > 0.6 * (max(high, interval[1]) - min(low, interval[0]))


def test_a_small_axis_has_small_dents():
    """Its dent of 1.7 mm on 80 mm was none: 2 mm are narrow on a machine five times as long."""

    def dent(_, y, v):
        return dry(v) + 5.0 * np.exp(-0.5 * ((y - 0.03) / 1.2e-3) ** 2), 0.0

    found = diagnose([driven(seed, dent, swiftest=0.08, travel=0.08) for seed in (1, 2)], AXIS)
    assert [effect.name for effect in found.effects] == ["rail_defect"]
    for name, true in (("amplitude", 5.0), ("centre", 0.03), ("width", 1.2e-3)):
        low, high = found.effects[0].parameters[name].ci95
        assert low < true < high


def test_a_healthy_machine_has_no_band_of_speeds():
    found = diagnose([driven(seed, lambda _, __, v: (dry(v), 0.0)) for seed in (1, 2)], AXIS)
    assert found.verdict.value == "no_mismatch"


@pytest.mark.parametrize(
    ("coordinate", "acting", "z", "told"),
    [
        ("velocity", 0.02, 5.0, True),
        ("velocity", 0.0, 5.0, False),
        ("velocity", 0.02, 3.0, False),
        ("velocity", 0.05, 3.0, True),
        ("distance_since_reversal", 0.05, 3.0, True),
        ("distance_since_reversal", 0.05, 2.0, False),
        ("torque", 0.05, 5.0, False),
        ("position", 0.0, 5.0, True),
    ],
)
def test_a_little_force_is_told_only_where_friction_has_none_of_its_own(coordinate, acting, z, told):
    found = Structure(coordinate, (0.1, 0.2), 500.0, z, 0.01 * 20.0, acting=acting * 20.0)
    assert large_enough(found, 20.0) == told


def test_friction_that_remembers_long_changes_with_time_and_briefly_since_the_reversal():
    assert remembers_along(30.0, 60.0) == ("time", "velocity")
    assert remembers_along(3.0, 60.0) == ("velocity",)
    assert remembers_along(0.3, 60.0) == ("velocity", "time_since_reversal")


def test_where_a_spring_rests_is_known_as_far_as_a_constant_force_is_ordinary():
    """Of seven machines with a push of their own, less than 1 % of rated force, no interval held the truth."""
    pushed = [driven(seed, lambda t, y, v: (dry(v), 60.0 * (y - 0.15) + 1.2)) for seed in (1, 2)]
    (spring,) = diagnose(pushed, AXIS).effects
    rest = spring.parameters["rest_position"]
    low, high = rest.ci95
    assert spring.name == "position_spring"
    assert rest.value == pytest.approx(0.13, abs=0.002), "the push moves it"
    assert low < 0.15 < high
    assert high - rest.value == pytest.approx(0.01 * AXIS.drive.rated_force / 60.0, rel=0.1)
