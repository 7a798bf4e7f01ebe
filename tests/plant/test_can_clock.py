"""The SYNC count as a clock: jitter does not reach the samples, drift is measured, jumps are counted."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plant.can_clock import Origin, SyncClock

MS = 1_000_000
START = 1_767_225_600 * 10**9
PERIOD = 10 * MS


def run(clock, arrivals, counter=True):
    ticks = [clock.tick(int(at), number % 240 + 1 if counter else None) for number, at in enumerate(arrivals)]
    return np.array([(tick.index, tick.t_ns, tick.segment) for tick in ticks if tick is not None]).T


@given(seed=st.integers(0, 2**32), counter=st.booleans())
def test_jitter_of_the_host_does_not_reach_the_stamps(seed, counter):
    jitter = np.random.default_rng(seed).exponential(0.5 * MS, 2000).astype(np.int64)
    clock = SyncClock(0.01)
    index, stamps, segment = run(clock, START + PERIOD * np.arange(2000) + jitter, counter)
    assert index.tolist() == list(range(2000))
    assert segment.max() == 0
    assert np.ptp(np.diff(stamps)) <= 2 * 200e-6 * PERIOD
    assert clock.counters.syncs_lost == clock.counters.steps == 0


@pytest.mark.parametrize("ppm", [-80, -20, 0, 50, 100])
def test_the_drift_of_the_masters_quartz_is_measured_and_followed(ppm):
    rng = np.random.default_rng(1)
    arrivals = START + np.rint(PERIOD * (1 + ppm * 1e-6) * np.arange(60_000)) + rng.exponential(0.3 * MS, 60_000)
    clock = SyncClock(0.01)
    _, stamps, segment = run(clock, arrivals)
    assert clock.counters.drift == pytest.approx(ppm * 1e-6, abs=3e-6)
    assert segment.max() == 0
    late = arrivals[6000:] - stamps[6000:]
    assert -10 * MS < late.min() < 10 * MS  # a sample in ten minutes, though the quartzes parted by up to 60 ms
    assert np.all(np.diff(stamps) > 0)


def test_a_step_of_the_hosts_clock_anchors_the_count_anew_once():
    arrivals = START + PERIOD * np.arange(2000)
    arrivals[1000:] += 500 * MS
    clock = SyncClock(0.01)
    index, stamps, segment = run(clock, arrivals)
    assert (clock.counters.steps, segment.max()) == (1, 1)
    assert clock.counters.syncs_lost == 0
    assert index.tolist() == list(range(2000))
    assert abs(stamps[-1] - arrivals[-1]) < MS


def test_a_silence_is_a_pause_and_loses_nothing():
    arrivals = START + PERIOD * np.arange(400)
    arrivals[200:] += 3600 * 10**9
    clock = SyncClock(0.01)
    index, stamps, segment = run(clock, arrivals)
    assert (clock.counters.pauses, clock.counters.syncs_lost, segment.max()) == (1, 0, 1)
    assert index.tolist() == list(range(400))
    np.testing.assert_array_equal(stamps, arrivals)


def test_without_a_counter_lost_syncs_show_by_arrival():
    arrivals = np.delete(START + PERIOD * np.arange(500), [250, 251, 252])
    clock = SyncClock(0.01)
    index, stamps, _ = run(clock, arrivals, counter=False)
    assert clock.counters.syncs_lost == 3
    assert index[-1] == 499
    np.testing.assert_array_equal(stamps[-100:], arrivals[-100:])


@pytest.mark.parametrize("seen", [0.001, 0.005, 0.02, 0.1])
def test_a_period_that_is_not_the_masters_is_noticed_after_two_seconds(seen):
    arrivals = START + np.rint(seen * 1e9 * np.arange(round(3.0 / seen))).astype(np.int64)
    clock = SyncClock(0.01)
    run(clock, arrivals)
    assert clock.misfit == f"SYNC comes every {seen:g} s, but [time] period is 0.01 s"


@given(seed=st.integers(0, 2**32))
def test_a_host_that_stalls_makes_no_wrong_period(seed):
    rng = np.random.default_rng(seed)
    arrivals = START + PERIOD * np.arange(400) + rng.exponential(2 * MS, 400).astype(np.int64)
    at = rng.integers(0, 399)
    arrivals[at:] = np.maximum(arrivals[at:], arrivals[at] + 300 * MS)  # then all at once
    clock = SyncClock(0.01)
    run(clock, arrivals)
    assert clock.judged
    assert clock.misfit is None


def test_a_repeated_sync_is_no_sample():
    clock = SyncClock(0.01)
    assert clock.tick(START, 7) is not None
    assert clock.tick(START + 5, 7) is None
    assert clock.counters.syncs_repeated == 1


def test_the_masters_time_is_taken_where_it_tells_another_one():
    clock = SyncClock(0.01, origin=Origin.TIME_OBJECT)
    clock.tell_time(START)
    assert clock.tick(5, 1).t_ns == START
    clock.tell_time(START + 11 * MS)  # a millisecond off: the count knows better
    assert clock.tick(6, 2).t_ns == START + PERIOD
    clock.tell_time(START + 10**12)
    assert clock.tick(7, 3).t_ns == START + 10**12
    assert clock.counters.steps == 1
