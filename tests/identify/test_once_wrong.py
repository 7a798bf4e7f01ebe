"""Training cases that were once answered wrong, each for a reason that a rule now knows: `make once-wrong`.

`make test` asks those that take little time.
"""

import numpy as np
import pytest

from identify.mismatch.data import TURNED
from identify.mismatch.diagnosis import diagnose
from identify.mismatch.result import Verdict
from tests.blind.sealing import drawable
from tests.identify.small_machine import AXIS, MECHANICS, driven, dry
from tests.identify.studies import naming
from tests.identify.studies.reading import recorded


def answered(seed: int, index: int):
    """The diagnosis of a training case of the blind study's plan."""
    _, _, case = drawable(seed, index)
    axis, recordings = recorded(case)
    return diagnose(recordings, axis)


@pytest.mark.slow
def test_a_lag_of_another_shape_is_no_lag_and_a_dead_time():
    found = answered(8900, 36)
    assert {effect.name for effect in found.effects} < {"actuator_lag", "dead_time"}
    assert {frozenset(names) for names in found.alternatives} == {frozenset({"actuator_lag"}), frozenset({"dead_time"})}


@pytest.mark.slow
def test_an_offset_beside_a_lag_of_another_shape_may_be_an_offset():
    found = answered(8900, 38)
    assert {effect.name for effect in found.effects} == {"actuator_lag", "force_offset"}


@pytest.mark.slow
def test_what_a_data_sheet_does_not_know_is_no_finding():
    """The machine is complete; a mass 0.6 % off would explain a little of its rough sensors."""
    assert answered(8900, 52).verdict is Verdict.NO_MISMATCH


@pytest.mark.slow
def test_the_twin_of_a_name_is_tried_though_no_shortlist_had_room_for_it():
    """A torque constant 6 % off, called a wrong mass: on this axis they are one and the same."""
    names = {name for names in answered(8700, 34).alternatives for name in names}
    assert {"torque_scale_error", "inertia_error"} <= names


def test_a_loop_that_logs_its_own_restlessness_tells_nothing():
    found = answered(8700, 37)
    assert found.verdict is Verdict.INSUFFICIENT_DATA
    assert "restlessness from sample to sample" in (found.reason or "")


@pytest.mark.slow
def test_a_name_that_leaves_most_of_the_latent_force_is_none():
    """A magnet beside the rail is no ripple of the motor."""
    assert answered(8700, 25).verdict is Verdict.UNEXPLAINED


def test_a_step_may_raise_the_static_friction_too():
    assert [effect.name for effect in answered(8700, 86).effects] == ["step_change"]


@pytest.mark.slow
def test_two_effects_that_look_like_an_odd_one_are_named():
    """Bristles and an eccentric pulley: alone, the pulley's period would not fit its radius."""
    assert {effect.name for effect in answered(8700, 45).effects} == {"presliding_hysteresis", "pulley_eccentricity"}


@pytest.mark.slow
def test_an_effect_that_acts_in_the_unseen_recording_alone_is_named():
    """The drive saturates in the second recording, on which the baseline of the first is 1400 times worse."""
    found = answered(8700, 70)
    assert [effect.name for effect in found.effects] == ["torque_saturation"]
    assert found.held_out_kind == "time"


def test_a_ripple_of_one_turn_shows_on_a_little_less_than_a_turn():
    assert [effect.name for effect in answered(8700, 87).effects] == ["torque_ripple"]


@pytest.mark.slow
def test_a_drag_that_friction_imitates_is_named_where_unseen_data_tell():
    """Evidence of 45 from few places; but the other recording is fast, and predicted fifty times better."""
    assert [effect.name for effect in answered(9300, 84).effects] == ["quadratic_drag"]


@pytest.mark.slow
def test_a_loop_logged_at_points_is_no_soft_transmission():
    """A bad spot on the guide distorts how the force between the samples looks; once it is named, it runs straight."""
    found = answered(9300, 62)
    assert [effect.name for effect in found.effects] == ["rail_defect"]
    assert any("torque read as straight" in line for line in found.preprocessing)


def test_a_break_away_that_no_run_predicts_in_time_may_still_be_named():
    """Stiction that grows at rest: a few runs that break away too late decide the plain sum of squares."""
    assert [effect.name for effect in answered(9300, 120).effects] == ["dwell_time_stiction"]


def test_a_second_name_that_nearly_all_unseen_data_ask_for_is_no_mending():
    """A stop with ten thousand of evidence hid an eccentric pulley with a tenth of that."""
    names = {effect.name for effect in answered(1060000, 107).effects}
    assert names == {"end_stop", "pulley_eccentricity"}


def test_a_constant_force_that_has_appeared_since_commissioning_is_named():
    """The everyday baseline holds the same force, and predicts as well: a name gains nothing but the name."""
    assert [effect.name for effect in answered(1060000, 158).effects] == ["force_offset"]


@pytest.mark.slow
def test_a_ripple_of_a_tenth_of_a_newton_is_none_however_finely_it_is_marched():
    """The machine is complete. Finer steps, which the ripple asks for, alone looked like newtons at each break-away."""
    assert answered(1080000, 115).effects == ()


def test_what_only_the_last_recording_tells_is_named_where_the_others_foretell_it():
    """A limit of 39 N that slow moves do not reach has no evidence there; friction beside it foretells them."""
    limited = lambda told, _: np.clip(told, -39.0, 39.0)  # noqa: E731
    slow, fast = (
        driven(seed, lambda t, y, v: (dry(v), 0.0), delivers=limited, swiftest=speed)
        for seed, speed in ((1, 0.05), (2, 0.4))
    )
    assert np.abs(slow.force).max() < 39.0
    found = diagnose([slow, fast], AXIS)
    assert [effect.name for effect in found.effects] == ["torque_saturation"]
    assert found.effects[0].parameters["limit"].value == pytest.approx(39.0 / MECHANICS.force_per_torque, rel=1e-3)
    assert found.held_out_kind == "recording"
    assert TURNED in found.preprocessing


@pytest.mark.slow
def test_a_rounded_limit_of_the_torque_is_one():
    """A hard one leaves so much of it that an eccentric pulley was named beside it."""
    assert [effect.name for effect in answered(1160000, 386).effects] == ["torque_saturation"]


def test_the_naming_study_keeps_what_its_line_tells(tmp_path):
    """Stiction that rises at rest hides behind a spring; a fit of both from the truth is hardly likelier."""
    found = naming.case_of(8300, 12, tmp_path)
    assert [one["name"] for one in found["named"]] == ["position_spring"]
    assert found["oracle"]["price"] < found["baseline"]["price"] - 300.0
    assert "dwell_time_stiction,position_spring -> position_spring" in naming.line(found)
