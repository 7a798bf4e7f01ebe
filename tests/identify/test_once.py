"""A step that came once, in one of several recordings that follow each other."""

import dataclasses

import numpy as np
import pytest

from identify.mismatch import conclusion, once
from identify.mismatch.data import Judges, begins, following, gather
from identify.mismatch.diagnosis import diagnose
from identify.mismatch.once import FOLLOW
from tests.identify.small_machine import AXIS, driven, dry

RISE = 1.5  # N: jam


def stepping_at(moment, before=20.0):
    """Friction that is `before` [N], and more from the `moment` [s] on."""
    return lambda t, _, v: (dry(v, before + (RISE if t >= moment else 0.0)), 0.0)


@pytest.mark.parametrize(("moments", "which"), [((7.0, -1.0), 1), ((99.0, 7.0), 2)])
def test_a_step_in_one_recording_is_there_in_those_after_it(moments, which):
    """The other recording has no step at 7 s, and was taken to deny it."""
    recordings = [driven(seed, stepping_at(moment), 12.0) for seed, moment in zip((1, 2), moments, strict=True)]
    found = diagnose(recordings, AXIS)
    assert [effect.name for effect in found.effects] == ["step_change"]
    low, high = found.effects[0].parameters["step"].ci95
    assert low < RISE < high
    low, high = found.effects[0].parameters["time"].ci95
    assert low < 7.0 < high
    assert FOLLOW.format(which) in found.preprocessing


def test_friction_of_another_day_is_no_event():
    recordings = [driven(seed, stepping_at(99.0, level), 12.0) for seed, level in ((1, 20.0), (2, 18.5), (3, 18.5))]
    assert diagnose(recordings, AXIS).effects == ()


def test_a_step_that_one_place_in_time_tells_is_friction_that_wanders(monkeypatch):
    """Healthy machines had one: z of 1.1, 1.7 and 2.2."""
    recordings = [driven(seed, stepping_at(moment), 12.0) for seed, moment in ((1, 7.0), (2, -1.0))]
    monkeypatch.setattr(once, "Z_STRONG", 1e3)
    assert FOLLOW.format(1) not in diagnose(recordings, AXIS).preprocessing


def test_a_step_of_a_twentieth_is_friction_that_wanders(monkeypatch):
    """A healthy joint whose friction wandered by 3 % had one of 4.9 %."""
    recordings = [driven(seed, stepping_at(moment), 12.0) for seed, moment in ((1, 7.0), (2, -1.0))]
    monkeypatch.setattr(conclusion, "SLIGHT", 1.1 * RISE / 20.0)
    assert FOLLOW.format(1) not in diagnose(recordings, AXIS).preprocessing


@pytest.fixture(scope="module")
def three():
    return [driven(seed, stepping_at(99.0), 4.0) for seed in (1, 2, 3)]


@pytest.mark.parametrize(
    ("judges", "number", "starts", "ahead"),
    [
        (Judges.LAST, 0, [0.0, 4.0], 8.0),
        (Judges.LAST, 1, [-4.0, 0.0], 4.0),
        (Judges.OTHERS, 0, [0.0], -8.0),
    ],
)
def test_the_clock_of_one_recording_goes_on_in_the_others(three, judges, number, starts, ahead):
    evidence = gather(three, AXIS, judges)
    moved, place, length = following(evidence, number)
    assert place == number + (2 if judges is Judges.OTHERS else 0)
    assert length == pytest.approx(4.0, abs=0.02)
    assert moved.train.t[begins(evidence.train)] == pytest.approx(starts, abs=0.03)
    assert moved.held_out.t[0] == pytest.approx(ahead, abs=0.03)
    assert (np.diff(moved.held_out.t) > 0.0).all()
    same = dataclasses.replace(moved.train, t=evidence.train.t)
    assert np.array_equal(same.position, evidence.train.position)
