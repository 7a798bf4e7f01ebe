"""From frames to samples: every frame ends in one counter, every sample is sent, filled or lost, to the sample."""

import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from plant.can_assembly import Assembler, Clock, TimeRule
from plant.can_axis import GapRule
from plant.can_batch import DATA, ERROR, REMOTE, batch
from plant.can_clock import Origin
from plant.cia402 import DEFAULT_TPDO1, time_of_day
from tests.plant.can_examples import MS, SCALING, START, collect, cycle, cycles, drive, pdo, sync

UNJUDGED = GapRule(judge=False)


def accounted(assembler):
    """Frames that ended in a counter."""
    count = assembler.frames
    ended = count.used + count.sync + count.status + count.unknown.total() + count.wrong_length.total()
    return ended + count.errors + count.remote


def test_every_sync_is_a_sample_with_the_time_of_the_sync():
    assembler = Assembler([drive(), drive("axis-2", 2)])
    found = collect(assembler, cycles(range(1000), nodes=(1, 2)))
    for number, name in ((1, "axis-1"), (2, "axis-2")):
        seq, stamps, channels = found[name]
        assert seq.tolist() == list(range(1000))
        np.testing.assert_array_equal(stamps, START + 10 * MS * np.arange(1000))
        np.testing.assert_allclose(channels["position"], 1e-6 * (1000 * number + np.arange(1000)), rtol=1e-12)
        np.testing.assert_allclose(channels["torque"], 0.008 * (np.arange(1000) % 100 - 50), rtol=1e-12)
        assert assembler.axes[name].counters.state == "operation enabled"
    assert accounted(assembler) == assembler.frames.frames == 3000


@settings(max_examples=40)
@given(
    dropped=st.sets(st.integers(0, 899), max_size=60),
    sizes=st.integers(1, 400),
    counter=st.booleans(),
)
def test_samples_do_not_depend_on_the_batches_and_all_are_accounted_for(dropped, sizes, counter):
    frames = [one for at, one in enumerate(cycles(range(300), nodes=(1, 2), counter=counter)) if at not in dropped]
    whole, parts = (
        Assembler([drive(), drive("axis-2", 2)], gaps=UNJUDGED),
        Assembler([drive(), drive("axis-2", 2)], gaps=UNJUDGED),
    )
    one, many = collect(whole, frames), collect(parts, frames, sizes)
    assert one.keys() == many.keys()
    for name in one:
        for ours, theirs in zip(one[name][:2], many[name][:2], strict=True):
            np.testing.assert_array_equal(ours, theirs)
        for channel in one[name][2]:
            np.testing.assert_array_equal(one[name][2][channel], many[name][2][channel])
        count = parts.axes[name].counters
        assert count.to_dict() == whole.axes[name].counters.to_dict()
        seq, stamps, _ = many[name]
        assert np.all(np.diff(stamps) > 0)
        assert len(seq) == count.samples + count.filled
        assert seq[-1] + 1 - len(seq) == count.lost
    assert accounted(parts) == len(frames)


def test_two_missing_answers_go_out_as_nan_and_three_are_a_gap_in_the_numbers():
    frames = [
        frame
        for number in range(400)
        for frame in cycle(number)
        if frame[1] == 0x80 or number not in (150, 200, 201, 300, 301, 302)
    ]
    assembler = Assembler([drive()])
    seq, stamps, channels = collect(assembler, frames, 100)["axis-1"]
    assert np.flatnonzero(np.isnan(channels["position"])).tolist() == [150, 200, 201]
    assert np.flatnonzero(np.diff(seq) != 1).tolist() == [299]
    assert seq[300] == 303
    np.testing.assert_array_equal(stamps, START + 10 * MS * seq)
    count = assembler.axes["axis-1"].counters
    assert (count.samples, count.filled, count.lost) == (394, 3, 3)


def test_lost_syncs_are_told_by_their_counter():
    frames = [frame for number in range(400) for frame in cycle(number) if number not in (240, 241, 242, 243)]
    assembler = Assembler([drive()])
    seq, stamps, _ = collect(assembler, frames, 77)["axis-1"]
    assert (assembler.clock.counters.syncs_lost, assembler.axes["axis-1"].counters.lost) == (4, 4)
    np.testing.assert_array_equal(stamps, START + 10 * MS * seq)


def test_a_drive_that_was_off_for_long_loses_nothing():
    frames = [
        frame for number in range(3000) for frame in cycle(number) if frame[1] == 0x80 or not 200 <= number < 2800
    ]
    assembler = Assembler([drive()])
    seq, stamps, _ = collect(assembler, frames, 500)["axis-1"]
    count = assembler.axes["axis-1"].counters
    assert (count.lost, count.absent, len(seq)) == (0, 2600, 400)
    assert np.all(np.diff(seq) == 1)
    assert np.diff(stamps).max() == 2601 * 10 * MS


def test_one_dead_drive_takes_nothing_from_the_other():
    frames = [
        frame for number in range(500) for frame in cycle(number, nodes=(1, 2)) if frame[1] != 0x182 or number < 250
    ]
    assembler = Assembler([drive(), drive("axis-2", 2)])
    found = collect(assembler, frames)
    assert (len(found["axis-1"][0]), len(found["axis-2"][0])) == (500, 250)


def test_foreign_short_long_remote_and_error_frames_are_counted_and_hurt_nobody():
    more = [
        (DATA, 0x181, START, b"1234567"),
        (DATA, 0x181, START, b"123456789"),
        (DATA, 0x181 | 1 << 29, START, b"12345678"),
        (DATA, 0x7DF, START, b"\x02\x01"),
        (REMOTE, 0x181, START, b""),
        (ERROR, 0x40, START, b""),
        (ERROR, 0x04, START, b""),
    ]
    assembler = Assembler([drive()])
    frames = cycles(range(200))
    seq, _, _ = collect(assembler, [*frames[:301], *more, *frames[301:]], 50)["axis-1"]
    count = assembler.frames.to_dict()
    assert len(seq) == 200
    assert (count["wrong_length"], count["errors"], count["bus_off"], count["remote"], count["unknown"]) == (
        2,
        2,
        1,
        1,
        2,
    )
    assert count["unknown_ids"] == {"0x00000181x": 1, "0x7DF": 1}
    assert {one["length"] for one in count["wrong_lengths"]} == {7, 9}
    assert accounted(assembler) == assembler.frames.frames


def test_frames_before_the_first_sync_are_counted():
    assembler = Assembler([drive()])
    frames = [pdo(START - MS, 1, 1), pdo(START - MS, 2, 1), *cycles(range(150))]
    assert len(collect(assembler, frames, 3)["axis-1"][0]) == 150
    assert assembler.frames.early == 2


def test_two_nodes_of_one_id_are_suspected():
    frames = [
        frame for number in range(200) for frame in (*cycle(number), pdo(START + number * 10 * MS + 5 * MS, 7, 7))
    ]
    assembler = Assembler([drive()])
    seq, _, channels = collect(assembler, frames)["axis-1"]
    count = assembler.axes["axis-1"].counters
    assert (len(seq), count.duplicates) == (200, 200)
    assert "two nodes" in count.suspicion
    assert 7e-6 not in channels["position"]


def test_heartbeats_boot_ups_and_a_storm_of_emergencies_are_counted():
    storm = [(DATA, 0x81, START, struct.pack("<HB5x", 0x8611, 1))] * 5000 + [(DATA, 0x81, START, b"\0" * 8)]
    beats = [(DATA, 0x701, START, bytes([state])) for state in (0, 127, 5)]
    assembler = Assembler([drive()])
    frames = cycles(range(200))
    found = collect(assembler, [*frames[:100], *storm, *beats, *frames[100:]])
    count = assembler.axes["axis-1"].counters.to_dict()
    assert len(found["axis-1"][0]) == 200
    assert (count["emergencies"], count["boot_ups"], count["nmt"]) == (5001, 1, "operational")
    assert count["last_emergency"] == "0x8611: position controller, following error"
    assert assembler.frames.status == 5004


def test_values_that_come_less_often_are_held():
    layout = drive(pdos=((0, DEFAULT_TPDO1), (0, ("2033:16:temperature",))))
    frames = []
    for number in range(300):
        frames += cycle(number)
        if number % 10 == 5:
            frames.append((DATA, 0x281, START + number * 10 * MS, struct.pack("<h", 200 + number)))
    _, _, channels = collect(Assembler([layout]), frames, 33)["axis-1"]
    assert np.isnan(channels["temperature"][:5]).all()
    expected = 0.1 * (200 + 5 + 10 * ((np.arange(5, 300) - 5) // 10))
    np.testing.assert_allclose(channels["temperature"][5:], expected)


@pytest.mark.parametrize("size", [None, 10])
def test_a_frame_of_another_length_than_the_layout_is_refused_with_what_would_fit(size):
    frames = []
    for number in range(200):
        frames += [sync(START + number * 10 * MS), (DATA, 0x181, START, struct.pack("<Hhh", 0x0627, number, 5))]
    assembler = Assembler([drive()])
    assert collect(assembler, frames, size) == {}
    said = assembler.refused("axis-1")
    assert "200 frames of 6 bytes, the layout has 8" in said
    assert "6041:16 + 6064:16 + 6077:16 would fit" in said


def test_a_mapping_in_another_order_is_refused_by_its_statuswords():
    frames = []
    for number in range(200):
        payload = struct.pack("<iHh", 1_000_000 + 777 * number, 0x0627, 5)  # position first
        frames += [sync(START + number * 10 * MS), (DATA, 0x181, START, payload)]
    assembler = Assembler([drive()])
    assert collect(assembler, frames, 20) == {}
    assert "statuswords are none that CiA 402 knows" in assembler.refused("axis-1")
    assert assembler.axes["axis-1"].counters.refused_samples == 200


def test_a_wrong_period_is_refused_before_anything_is_sent():
    frames = cycles(range(3000), period=MS)
    assembler = Assembler([drive()])
    assert collect(assembler, frames, 90) == {}
    assert "SYNC comes every 0.001 s, but [time] period is 0.01 s" in assembler.refused("axis-1")


@settings(max_examples=60)
@given(
    frames=st.lists(
        st.tuples(
            st.sampled_from([DATA, DATA, DATA, ERROR, REMOTE]),
            st.sampled_from([0x80, 0x100, 0x181, 0x182, 0x281, 0x81, 0x701, 0x7DF, 0x181 | 1 << 29]),
            st.integers(0, 2**61),
            st.binary(max_size=64),
        ),
        max_size=200,
    ),
    size=st.integers(1, 50),
    rule=st.sampled_from([TimeRule(), TimeRule(Clock.ARRIVAL), TimeRule(origin=Origin.TIME_OBJECT)]),
)
def test_whatever_is_on_the_bus_every_frame_is_counted_and_stamps_rise_within_a_piece(frames, size, rule):
    assembler = Assembler([drive(), drive("axis-2", 2)], rule, UNJUDGED)
    pieces = []
    for first in range(0, len(frames), size):
        pieces += assembler.take(batch(frames[first : first + size]))
    pieces += assembler.finish()
    assert accounted(assembler) == len(frames)
    for _, piece in pieces:
        assert np.all(np.diff(piece.t_ns) > 0)
        assert len(piece)


def test_without_sync_the_arrival_is_the_time_and_never_runs_backwards():
    stamps = START + 10 * MS * np.arange(200)
    stamps[100] = stamps[99] - 5 * MS
    frames = [pdo(int(at), number, 3) for number, at in enumerate(stamps)]
    for size in (None, 7):
        assembler = Assembler([drive()], TimeRule(Clock.ARRIVAL))
        _seq, found, channels = collect(assembler, frames, size)["axis-1"]
        assert np.all(np.diff(found) > 0)
        assert found[100] == found[99] + 1
        np.testing.assert_array_equal(np.delete(found, 100), np.delete(stamps, 100))
        assert channels["position"][-1] == pytest.approx(199e-6)


def test_the_time_of_the_master_dates_each_burst_however_fast_the_frames_come():
    frames = []
    for day in range(3):
        begin = START + day * 86_400 * 10**9
        frames.append((DATA, 0x100, START, time_of_day(begin)))
        frames += [(*one[:2], START + 1, *one[3:]) for number in range(200) for one in cycle(number + 201 * day)]
        frames.append(sync(START + 1, (200 + 201 * day) % 240 + 1))
    rule = TimeRule(origin=Origin.TIME_OBJECT)
    assembler = Assembler([drive()], rule)
    seq, stamps, _ = collect(assembler, frames, 100)["axis-1"]
    assert len(seq) == 600
    np.testing.assert_array_equal(
        stamps.reshape(3, 200) - START, 86_400 * 10**9 * np.arange(3)[:, None] + 10 * MS * np.arange(200)
    )
    assert assembler.axes["axis-1"].counters.lost == 0


def test_a_batch_keeps_long_and_short_frames():
    made = batch([(DATA, 1, 2, b"x" * 64), (DATA, 2, 3, b"")])
    assert made.data.shape == (2, 64)
    assert made.lengths.tolist() == [64, 0]
    assert len(batch([])) == 0


def test_position_at_a_rated_torque_of_another_drive_scales_with_it():
    assert SCALING.factor("torque") == pytest.approx(8e-3)
    assert SCALING.factor("position") == pytest.approx(1e-6)
