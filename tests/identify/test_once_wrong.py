"""Training cases that were once answered wrong, each for a reason that a rule now knows."""

import pytest

from identify.mismatch.diagnosis import diagnose
from identify.mismatch.result import Verdict
from tests.identify.studies.naming import drawn


@pytest.fixture
def answered(tmp_path):
    """The diagnosis of a training case of the blind study's plan."""

    def answer(seed: int, index: int):
        _, _, axis, recordings = drawn(seed, index, tmp_path)
        return diagnose(recordings, axis)

    return answer


def test_a_lag_of_another_shape_is_no_lag_and_a_dead_time(answered):
    found = answered(8900, 36)
    assert {effect.name for effect in found.effects} < {"actuator_lag", "dead_time"}
    assert {frozenset(names) for names in found.alternatives} == {frozenset({"actuator_lag"}), frozenset({"dead_time"})}


def test_an_offset_beside_a_lag_of_another_shape_may_be_an_offset(answered):
    found = answered(8900, 38)
    assert {effect.name for effect in found.effects} == {"actuator_lag", "force_offset"}


def test_what_a_data_sheet_does_not_know_is_no_finding(answered):
    """The machine is complete; a mass 0.6 % off would explain a little of its rough sensors."""
    assert answered(8900, 52).verdict is Verdict.NO_MISMATCH
