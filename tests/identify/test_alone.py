"""What acts in one of several recordings alone is unseen data to nobody: that recording is asked by itself."""

import dataclasses

import numpy as np
import pytest

from identify.mismatch import alone, diagnosis
from identify.mismatch.alone import loudest_alone
from identify.mismatch.data import Judges, at_one_rate, gather, split
from identify.mismatch.diagnosis import conclude, diagnose
from identify.mismatch.result import Verdict
from tests.identify.small_machine import AXIS, driven, dry

TONE = 0.7  # Hz


def plain(_t, _y, v):
    return dry(v), 0.0


def shaken(t, _y, v):
    return dry(v), 3.0 * np.sin(2.0 * np.pi * TONE * t)


@pytest.fixture(scope="module")
def recordings():
    return [driven(1, plain, 12.0), driven(2, shaken, 20.0)]


@pytest.fixture(scope="module")
def answered(recordings):
    """The answer, and what was said before either recording was asked by itself."""
    before = []

    def asked(together, *others):
        before.append(together)
        return loudest_alone(together, *others)

    with pytest.MonkeyPatch.context() as changed:
        changed.setattr(diagnosis, "loudest_alone", asked)
        return diagnose(recordings, AXIS), before[0]


@pytest.fixture(scope="module")
def together(answered):
    return answered[1]


def test_a_tone_in_one_of_two_recordings_is_found(recordings, answered):
    found, together = answered
    assert together.verdict is Verdict.NO_MISMATCH
    assert found.verdict is Verdict.UNEXPLAINED
    assert found.location.coordinate == "frequency"
    low, high = found.location.interval
    assert low < TONE < high
    assert any(line.startswith("recording 2 asked by itself: it leaves") for line in found.preprocessing)
    assert found.data_sha256 == gather(recordings, AXIS).sha256  # of both


def test_names_stand_only_where_the_others_do_not_speak_against_them(recordings, together):
    asked = loudest_alone(together, recordings, (), False)
    assert asked.recordings == (recordings[1],)
    assert not asked.stands(together)  # nothing is missing: no answer to why it is loud
    dragged = conclude([driven(4, lambda _t, _y, v: (dry(v) + 80.0 * v * v, 0.0))], AXIS)
    assert dragged.said == {"quadratic_drag"}
    assert not asked.stands(dragged)  # the quiet recording has no drag


def test_no_recording_is_asked_that_is_no_louder_than_all(recordings, together, monkeypatch):
    monkeypatch.setattr(alone, "LOUDER", 1e4)
    assert loudest_alone(together, recordings, (), False) is None
    assert loudest_alone(together, recordings[:1], (), False) is None


def test_one_recording_and_commissioning_are_what_is_gathered(recordings):
    first = dataclasses.replace(recordings[0], note="commissioning")
    every = [first, *recordings]
    evidence = split(every, at_one_rate(every, AXIS), Judges.LAST, (), only=2)
    assert evidence.kind == "time"
    assert evidence.before is not None
    assert evidence.train.t.max() < evidence.held_out.t.min()
    whole = gather([recordings[1]], AXIS)
    assert np.array_equal(evidence.train.position, whole.train.position)
