"""Ageing: each cause alone, and how causes compose."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plant.ageing import DAY, Ageing, Condition, Moment, wander
from plant.ageing_climate import Ambient, Load, Viscosity, WarmUp
from plant.ageing_damage import GrowingRailDefect, Jam, Scatter, Wear
from plant.ageing_lubricant import LubricantChange, LubricantLoss, Relubrication
from plant.errors import ParameterError
from plant.presets import paper_friction
from plant.scenario_file import CAUSES

NEW = paper_friction("paper-literal")
ONE_OF_EACH = (
    Relubrication((40.0, 80.0)),
    Ambient(mean=21.0, daily=2.0, yearly=5.0, weather=1.5),
    WarmUp(rise=6.0),
    Viscosity(0.03, 20.0),
    LubricantChange(50.0, 0.7),
    Load(3.0, 20.0, 30.0, 2.0),
    LubricantLoss(10.0),
    Wear(2e-3, 20.0, 0.5),
    GrowingRailDefect(1.2, 0.02, 0.5, 25.0),
    Jam(60.0, 30.0, 65.0),
    Scatter(0.01, 0.02, 0.03, 0.01, wandering=0.02),
)


def at(day: float, *stages, seed: int = 0) -> Condition:
    moment = Moment(day * DAY, travelled=2000.0 * day, time_of_day=(day % 1) * DAY, seed=seed)
    return Ageing(stages).condition(moment)


def test_every_cause_of_the_catalogue_is_tested():
    assert {type(stage) for stage in ONE_OF_EACH} == set(CAUSES.values())


def test_an_axis_without_causes_stays_new():
    assert at(100.0) == Condition()
    assert at(100.0).friction(NEW) == NEW


@given(st.permutations(ONE_OF_EACH), st.floats(0.0, 200.0))
def test_the_order_in_which_causes_are_listed_does_not_matter(stages, day):
    shuffled, listed = at(day, *stages), at(day, *ONE_OF_EACH)
    np.testing.assert_allclose(shuffled.friction(NEW).as_array, listed.friction(NEW).as_array, rtol=1e-12)
    assert shuffled.temperature == pytest.approx(listed.temperature, abs=1e-9)
    assert (shuffled.load, shuffled.effects) == (listed.load, listed.effects)


@given(st.floats(0.0, 400.0), st.integers(0, 2**31))
def test_friction_stays_physical_on_any_day(day, seed):
    law = at(day, *ONE_OF_EACH, seed=seed).friction(NEW).as_array
    assert (law > 0).all()
    assert np.isfinite(law).all()


def test_wear_follows_the_distance_from_its_onset_to_its_limit():
    wear = Wear(per_kilometre=1e-3, onset=100.0, limit=0.3)
    rises = [wear.age(Condition(), Moment(0.0, km * 1e3)).coulomb - 1 for km in (0, 100, 200, 400, 9999)]
    np.testing.assert_allclose(rises, [0.0, 0.0, 0.1, 0.3, 0.3], atol=1e-12)
    worn = wear.age(Condition(), Moment(0.0, 200e3)).friction(NEW)
    assert worn.static_force / worn.coulomb_force == pytest.approx(NEW.static_force / NEW.coulomb_force)
    assert worn.viscous_coefficient == NEW.viscous_coefficient


def test_lost_lubricant_shifts_the_stribeck_curve_and_relubrication_brings_it_back():
    loss = LubricantLoss(onset_day=30.0, time_constant=20.0)
    starved = at(110.0, loss).friction(NEW)
    assert starved.stribeck_velocity > 1.9 * NEW.stribeck_velocity
    assert starved.static_force > 1.5 * NEW.static_force
    assert starved.viscous_coefficient < 0.75 * NEW.viscous_coefficient
    slow, fast = 0.005, 2.0
    assert starved.force(slow) > 1.2 * NEW.force(slow)
    assert starved.force(fast) < NEW.force(fast)
    assert at(110.0, loss, Relubrication((110.0,))).friction(NEW) == NEW
    assert at(130.0, loss, Relubrication((110.0,))).stribeck == pytest.approx(at(50.0, loss).stribeck)


def test_relubrication_before_the_loss_begins_does_not_bring_it_forward():
    loss = LubricantLoss(onset_day=30.0)
    assert at(60.0, loss, Relubrication((5.0,))).stribeck == at(60.0, loss).stribeck


def test_a_thinner_lubricant_lowers_drag_and_raises_the_stribeck_velocity():
    thin = at(10.0, LubricantChange(5.0, viscosity_ratio=0.5)).friction(NEW)
    assert thin.viscous_coefficient == pytest.approx(90.0)
    assert thin.stribeck_velocity == pytest.approx(0.2)
    assert at(4.9, LubricantChange(5.0, 0.5)) == Condition()


def test_warmth_thins_the_lubricant_by_the_law_it_says():
    warm = at(1.0, Ambient(mean=40.0), Viscosity(per_kelvin=0.03, reference=20.0))
    assert warm.viscous == pytest.approx(np.exp(-0.6))
    assert warm.stribeck == pytest.approx(np.exp(0.6))


def test_the_day_is_warmest_in_the_afternoon_and_the_year_on_its_day():
    hours = [at(h / 24, Ambient(20.0, daily=2.0)).temperature for h in range(24)]
    assert int(np.argmax(hours)) == 15
    assert np.ptp(hours) == pytest.approx(4.0)
    days = [at(d, Ambient(20.0, yearly=5.0, warmest_day=200.0)).temperature for d in range(365)]
    assert int(np.argmax(days)) == 200


def test_a_machine_warms_through_its_shift_and_cools_at_night():
    warm_up = WarmUp(rise=6.0, time_constant=3600.0, shift_start=6.0, shift_hours=16.0)
    by_hour = {h: at(h / 24, warm_up).temperature - 20.0 for h in (6, 7, 12, 22, 23, 29)}
    assert by_hour[6] == pytest.approx(0.0, abs=1e-9)
    assert by_hour[7] == pytest.approx(6.0 * (1 - np.exp(-1)))
    assert by_hour[22] == pytest.approx(6.0, rel=1e-3)
    assert by_hour[23] == pytest.approx(6.0 * np.exp(-1), rel=1e-3)


def test_a_load_is_there_only_on_its_days_and_loads_the_guide():
    load = Load(mass=3.0, from_day=10.0, to_day=20.0, friction_per_kilogram=2.0)
    assert [at(d, load).load for d in (9.9, 10.0, 19.9, 20.0)] == [0.0, 3.0, 3.0, 0.0]
    assert at(15.0, load).friction(NEW).coulomb_force == pytest.approx(96.0)


def test_a_rail_defect_grows_from_its_onset_to_its_limit():
    defect = GrowingRailDefect(1.2, 0.02, newtons_per_day=0.5, onset_day=30.0, limit=40.0)
    assert at(30.0, defect).effects == ()
    amplitudes = [at(d, defect).effects[0][1]["amplitude"] for d in (31.0, 50.0, 200.0)]
    np.testing.assert_allclose(amplitudes, [0.5, 10.0, 40.0])
    assert at(50.0, defect).effects[0][0] == "rail_defect"


def test_a_jam_steps_up_and_is_cleared():
    jam = Jam(40.0, force=35.0, cleared_day=47.0)
    assert [at(d, jam).dry_force for d in (39.9, 40.0, 46.9, 47.0)] == [0.0, 35.0, 35.0, 0.0]


def test_friction_scatters_from_run_to_run_as_much_as_it_says():
    scatter = Scatter(0.02, 0.04, 0.06, 0.01)
    laws = np.array([at(day, scatter, seed=seed).friction(NEW).as_array for seed in range(20) for day in range(40)])
    np.testing.assert_allclose(np.log(laws / NEW.as_array).std(axis=0), [0.02, 0.04, 0.06, 0.01], rtol=0.08)
    chance = np.log(laws[:, 0] / NEW.coulomb_force).reshape(20, 40)
    assert abs(np.mean(chance[:, 1:] * chance[:, :-1])) < 0.15 * 0.02**2  # no memory from run to run


def test_wandering_is_slow_and_of_unit_variance():
    values = np.array([[wander(day * DAY, 5 * DAY, seed) for day in range(0, 60)] for seed in range(150)])
    assert values.std() == pytest.approx(1.0, rel=0.1)
    assert values.mean() == pytest.approx(0.0, abs=0.1)
    lag = [np.mean(values[:, k:] * values[:, : 60 - k]) for k in (1, 5, 20)]
    np.testing.assert_allclose(lag, np.exp(-0.5 * (np.array([1, 5, 20]) / 5) ** 2), atol=0.12)


def test_chance_belongs_to_the_moment_and_the_seed():
    scatter = Scatter(0.02, wandering=0.02)
    assert at(7.0, scatter, seed=3) == at(7.0, scatter, seed=3)
    several = [at(day, scatter, seed=seed).coulomb for day, seed in itertools.product((7.0, 7.5), (3, 4))]
    assert len(set(several)) == 4


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: WarmUp(5.0, time_constant=0.0), "warm_up: time_constant is 0 s, but must be > 0 s"),
        (lambda: WarmUp(5.0, shift_hours=30.0), "warm_up: shift_hours is 30 h"),
        (lambda: LubricantLoss(time_constant=-1.0), "lubricant_loss: time_constant is -1 d"),
        (lambda: LubricantLoss(viscous_rise=-1.0), "viscous_rise is -1, but must be > -1"),
        (lambda: LubricantChange(1.0, 0.0), "lubricant_change: viscosity_ratio is 0, but must be > 0"),
        (lambda: Scatter(coulomb=-0.1), "scatter: coulomb is -0.1, but must be >= 0"),
    ],
)
def test_a_value_out_of_range_names_itself(make, words):
    with pytest.raises(ParameterError, match=words):
        make()
