"""Faults of sensors are told when they are news, and the words they are counted from are those of the preprocessing."""

import dataclasses

import numpy as np

from identify.mending import Mender
from monitor.data_quality import COUNTED, faults_of
from monitor.drift import DriftRule, Kind
from monitor.identify_window import jitter_of
from plant.presets import paper_axis
from plant.recording import Recording
from plant.sensors import add_spikes, freeze_position, jitter_stamps
from tests.monitor.estimates import estimate
from tests.monitor.watching import watch


def test_bad_data_in_a_row_is_a_matter_of_data_quality():
    bad = [estimate(k, verdict="bad_data") for k in range(4)]
    _, held = watch(DriftRule(), [*bad, estimate(4, verdict="not_informative")])
    assert held == [set(), set(), {Kind.DATA_QUALITY}, {Kind.DATA_QUALITY}, set()]


def test_a_sensor_that_begins_to_fail_is_news_and_one_that_always_did_is_not():
    rng = np.random.default_rng(0)
    always, more = {"position outliers": 0.004}, {"position outliers": 0.03}
    state, held = watch(DriftRule(), (estimate(k, rng, faults=always) for k in range(30)))
    assert not any(held)
    state, held = watch(DriftRule(), (estimate(k, rng, faults=more) for k in range(30, 40)), state)
    assert held[:3] == [set(), set(), {Kind.DATA_QUALITY}]
    assert held[-1] == {Kind.DATA_QUALITY}
    _, held = watch(DriftRule(), (estimate(k, rng, faults=always) for k in range(40, 44)), state)
    assert held[-1] == set()


def recording():
    t = 0.01 * np.arange(2000)
    position = np.round((0.3 * np.sin(2 * np.pi * 0.3 * t) + 0.5) / 1e-5) * 1e-5
    return Recording(t, 100 * np.cos(2 * np.pi * 0.3 * t), position, sample_time=0.01)


def faults(seen):
    mender = Mender(paper_axis())
    mender.mend(seen.t, seen.force, seen.position)
    return faults_of(mender.report(), len(seen), jitter_of(seen))


def test_the_words_of_the_preprocessing_are_understood():
    rng, clean = np.random.default_rng(0), recording()
    assert faults(clean) == {}
    assert abs(faults(freeze_position(clean, 6.0, 2.5))["frozen position"] - 0.125) < 0.01
    assert abs(faults(add_spikes(clean, 0.005, 0.05, rng))["position outliers"] - 0.005) < 0.003
    assert faults(jitter_stamps(clean, 2e-3, rng))["jitter of the stamps"] > 0.15
    kept = np.r_[0:500, 700:2000]
    lost = dataclasses.replace(clean, t=clean.t[kept], force=clean.force[kept], position=clean.position[kept])
    assert jitter_of(lost) < 0.05  # a gap is no jitter
    assert set(COUNTED.values()) >= {"frozen position", "position outliers"}
