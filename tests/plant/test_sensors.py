"""Sensors and drive: each part alone, and the order in which they stand."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plant import sensors
from plant.axis import TorqueHold
from plant.errors import ParameterError
from plant.recording import Recording
from plant.sensors import Sensors

SEEDS = range(30)


def recording(n: int = 2000, period: float = 0.01) -> Recording:
    t = period * np.arange(n)
    return Recording(
        t=t,
        force=100.0 * np.sin(2 * np.pi * 0.2 * t),
        position=0.2 * np.sin(2 * np.pi * 0.2 * t - 0.7),
        velocity=np.cos(t),
        sample_time=period,
    )


def rng(seed: int) -> np.random.Generator:
    return np.random.default_rng(seed)


@pytest.mark.parametrize(
    ("add", "channel"), [(sensors.add_position_noise, "position"), (sensors.add_force_noise, "force")]
)
def test_noise_has_the_deviation_it_says_and_touches_one_channel(add, channel):
    clean = recording()
    noises = []
    for seed in SEEDS:
        noisy = add(clean, 1e-3, rng(seed))
        noises.append(getattr(noisy, channel) - getattr(clean, channel))
        for other in set(clean.channels()) - {channel}:
            np.testing.assert_array_equal(getattr(noisy, other), getattr(clean, other))
    assert np.std(noises) == pytest.approx(1e-3, rel=0.02)  # §4.6: variance 1e-6 m^2
    assert np.mean(noises) == pytest.approx(0.0, abs=1e-5)


@given(st.floats(1e-6, 1e-2))
def test_quantised_values_are_multiples_of_the_step_and_within_half_of_it(step):
    clean = recording(200)
    seen = sensors.quantise_position(clean, step)
    counts = seen.position / step
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-6)
    assert np.abs(seen.position - clean.position).max() <= 0.5 * step * (1 + 1e-9)


def test_torque_in_per_mille_of_rated_has_that_step():
    seen = sensors.quantise_force_per_mille(recording(), rated_force=592.0)
    counts = seen.force / 0.592
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-9)
    assert np.abs(seen.force - recording().force).max() <= 0.296 * (1 + 1e-9)
    assert np.diff(np.unique(np.round(counts))).min() == 1


def test_a_delayed_position_is_what_it_was_that_long_ago():
    clean = recording()
    late = sensors.delay_position(clean, 0.03)
    np.testing.assert_allclose(late.position[3:], clean.position[:-3], atol=1e-12)
    np.testing.assert_array_equal(late.position[:4], clean.position[0])
    between = sensors.delay_position(clean, 0.025)
    np.testing.assert_allclose(between.position[3:], 0.5 * (clean.position[:-3] + clean.position[1:-2]), atol=1e-12)


def test_a_frozen_position_stands_still_as_long_as_it_should_and_no_longer():
    clean = recording()
    frozen = sensors.freeze_position(clean, 5.0, 2.0)
    still = frozen.position == clean.position[500]
    assert still[500:700].all()
    np.testing.assert_array_equal(frozen.position[:500], clean.position[:500])
    np.testing.assert_array_equal(frozen.position[700:], clean.position[700:])


@given(st.floats(0.0, 1.0), st.integers(0, 2**32))
def test_jittered_stamps_stay_in_order_and_values_stay_as_they_are(deviation, seed):
    clean = recording(300)
    seen = sensors.jitter_stamps(clean, deviation, rng(seed))
    assert (np.diff(seen.t) > 0).all()
    np.testing.assert_array_equal(seen.position, clean.position)


def test_jitter_has_the_deviation_it_says_where_there_is_room():
    moved = [sensors.jitter_stamps(recording(), 1e-3, rng(seed)).t - recording().t for seed in SEEDS]
    assert np.std(moved) == pytest.approx(1e-3, rel=0.02)


def test_spikes_are_as_many_and_as_large_as_they_say_and_fair():
    jumps = [sensors.add_spikes(recording(), 0.01, 0.05, rng(s)).position - recording().position for s in SEEDS]
    hit = np.abs(jumps) > 1e-9
    assert hit.mean() == pytest.approx(0.01, rel=0.15)
    np.testing.assert_allclose(np.abs(np.array(jumps)[hit]), 0.05)
    assert abs(np.mean(np.array(jumps)[hit])) < 0.01


@pytest.mark.parametrize("length", [1, 5, 20])
@pytest.mark.parametrize("rate", [0.01, 0.1, 0.4])
def test_dropouts_lose_the_fraction_they_say_in_runs_of_the_length_they_say(rate, length):
    kept, runs = [], []
    for seed in SEEDS:
        seen = sensors.drop_samples(recording(), rate, rng(seed), length)
        assert seen.t[0] == 0.0
        kept.append(len(seen) / 2000)
        gaps = np.round(np.diff(seen.t) / 0.01).astype(int) - 1
        runs += gaps[gaps > 0].tolist()
    assert 1 - np.mean(kept) == pytest.approx(rate, rel=0.15, abs=0.004)
    assert min(runs) >= length


def test_a_decimated_loop_keeps_instants_or_means_and_says_which():
    fast = recording(2000, 0.001)
    sampled, averaged = sensors.decimate(fast, 10), sensors.decimate(fast, 10, "mean")
    np.testing.assert_array_equal(sampled.force, fast.force[::10])
    np.testing.assert_allclose(averaged.force, fast.force.reshape(-1, 10).mean(axis=1))
    np.testing.assert_array_equal(averaged.position, fast.position[::10])
    assert (sampled.hold, averaged.hold) == (TorqueHold.UNKNOWN, TorqueHold.MEAN)
    assert sampled.sample_time == pytest.approx(0.01)
    assert len(sensors.decimate(recording(2005, 0.001), 10, "mean")) == 200


def test_parts_that_are_off_change_nothing_and_draw_nothing():
    generator = rng(1)
    seen = Sensors().apply(recording(), 74.0, None, generator)
    assert seen.sha256() == recording().sha256()
    assert generator.random() == rng(1).random()


def test_the_parts_stand_in_the_order_of_the_documentation():
    parts = Sensors(position_delay=0.02, position_noise=1e-3, position_resolution=1e-4, torque_noise=0.1)
    seen = parts.apply(recording(), 74.0, None, rng(3))
    by_hand, chance = sensors.delay_position(recording(), 0.02), rng(3)
    by_hand = sensors.quantise_position(sensors.add_position_noise(by_hand, 1e-3, chance), 1e-4)
    by_hand = sensors.add_force_noise(by_hand, 7.4, chance)
    assert seen.sha256() == by_hand.sha256()


def test_the_same_seed_gives_the_same_samples_and_another_seed_others():
    parts = Sensors(position_noise=1e-3, stamp_jitter=1e-4, dropout_rate=0.05, dropout_length=3)
    hashes = [parts.apply(recording(), 74.0, None, rng(seed)).sha256() for seed in (1, 1, 2)]
    assert hashes[0] == hashes[1] != hashes[2]


@pytest.mark.parametrize(
    ("parts", "words"),
    [
        (Sensors(position_noise=-1.0), "position noise is -1 m, but must be >= 0 m"),
        (Sensors(position_resolution=float("nan")), "position resolution is nan m"),
        (Sensors(spike_rate=-0.5), "spike rate is -0.5, but must be in 0 <= rate < 1"),
        (Sensors(dropout_rate=1.0), "dropout rate is 1, but must be in 0 <= rate < 1"),
        (Sensors(dropout_rate=0.1, dropout_length=0), "dropout length is 0 samples"),
        (Sensors(torque_per_mille=1.0), "torque_per_mille is 1, but must be 0 on an axis without rated force"),
    ],
)
def test_a_value_out_of_range_names_itself(parts, words):
    with pytest.raises(ParameterError, match=words):
        parts.apply(recording(), 74.0, None, rng(0))


def test_a_decimation_beyond_the_recording_is_refused():
    with pytest.raises(ParameterError, match="decimation factor is 0, but must be between 1 and the 5 samples"):
        sensors.decimate(recording(5), 0)


def test_sensors_of_a_recording_without_extra_channels_leave_none():
    bare = dataclasses.replace(recording(), velocity=None)
    assert sensors.drop_samples(bare, 0.1, rng(0)).channels() == ("t", "force", "position")
