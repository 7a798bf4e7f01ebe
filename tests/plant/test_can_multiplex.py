"""Multiplexed signals of a DBC: read where the multiplexers say that they are there, as cantools reads them."""

import struct

import cantools
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from plant.can_assembly import Assembler, Clock, TimeRule
from plant.can_axis import GapRule
from plant.can_batch import DATA
from plant.can_layout import decode_signal
from plant.dbc_cantools import dbc_layout
from tests.plant.can_examples import MS, START, collect, sync

HEAD = 'VERSION ""\nNS_ :\nBS_:\nBU_: A\n'
PLAIN = """BO_ 385 M: 8 A
 SG_ Which M : 0|4@1+ (1,0) [0|0] "" A
 SG_ Position m0 : 8|32@1- (1E-06,0) [0|0] "m" A
 SG_ Torque m1 : 8|16@1- (0.01,0) [0|0] "Nm" A
 SG_ Velocity m1 : 24|16@1- (0.001,0) [0|0] "m/s" A
 SG_ Status : 40|16@1+ (1,0) [0|0] "" A
"""
NESTED = """BO_ 385 M: 8 A
 SG_ Which M : 7|8@0+ (1,0) [0|0] "" A
 SG_ Inner m2M : 8|3@1+ (1,0) [0|0] "" A
 SG_ Position m1 : 16|32@1- (1E-06,0) [0|0] "m" A
 SG_ Torque m5 : 16|16@1- (0.01,0) [0|0] "Nm" A
 SG_ Velocity m3 : 32|16@1- (0.001,0) [0|0] "m/s" A

SG_MUL_VAL_ 385 Inner Which 2-2;
SG_MUL_VAL_ 385 Position Which 1-1, 7-9;
SG_MUL_VAL_ 385 Torque Inner 5-6;
SG_MUL_VAL_ 385 Velocity Which 3-3;
"""
SIGNALS = {"position": "M.Position", "torque": "M.Torque", "velocity": "M.Velocity"}


def layout_of(folder, text):
    path = folder / "plant.dbc"
    path.write_text(HEAD + text + "\n")
    return dbc_layout(path, "axis-1", SIGNALS, {})


@pytest.mark.parametrize("text", [PLAIN, NESTED], ids=["plain", "nested"])
def test_every_frame_is_read_as_cantools_reads_it(text, tmp_path):
    layout = layout_of(tmp_path, text)
    message = cantools.database.load_string(HEAD + text + "\n", "dbc").get_message_by_name("M")
    names = {channel: signal.partition(".")[2] for channel, signal in SIGNALS.items()}

    @settings(max_examples=300, deadline=None)
    @given(switch=st.integers(0, 10), rest=st.binary(min_size=7, max_size=7))
    def compare(switch, rest):
        payload = bytes([switch]) + rest
        bytes_ = np.frombuffer(payload, dtype=np.uint8).reshape(1, 8)
        ours = {
            signal.channel: decode_signal(signal, bytes_)[0]
            for frame in layout.frames
            if frame.carries(bytes_)[0]
            for signal in frame.signals
        }
        try:
            theirs = message.decode(payload, decode_choices=False, allow_truncated=True)
        except cantools.database.DecodeError:  # a page that the DBC does not name
            theirs = {}
        expected = {channel: theirs[name] for channel, name in names.items() if name in theirs}
        if theirs or not ours:
            assert ours == pytest.approx(expected)

    compare()


def frames(count, lost=(), period=10 * MS):
    """SYNC, the page with the position, the one with torque and velocity, and one that nobody reads."""
    for number in range(count):
        at = START + number * period
        yield sync(at, number % 240 + 1)
        if number not in lost:
            yield DATA, 0x181, at + MS, struct.pack("<BiHB", 0xF0, 1000 + number, 0x0627, 0)
        yield DATA, 0x181, at + 2 * MS, struct.pack("<BhhHB", 0x01, number % 100, 7, 0x0627, 0)
        yield DATA, 0x181, at + 3 * MS, struct.pack("<BiHB", 0x05, -1, 0, 0)


@pytest.mark.parametrize("rule", [TimeRule(), TimeRule(Clock.ARRIVAL)], ids=["sync", "arrival"])
@pytest.mark.parametrize("size", [None, 7])
def test_pages_of_one_id_make_one_sample(rule, size, tmp_path):
    assembler = Assembler([layout_of(tmp_path, PLAIN)], rule, GapRule(judge=False))
    seq, _, channels = collect(assembler, list(frames(300)), size)["axis-1"]
    count = 300 if rule.clock is Clock.SYNC else 299  # without SYNC the last one may not be complete yet
    assert seq.tolist() == list(range(count))
    np.testing.assert_allclose(channels["position"], 1e-6 * (1000 + np.arange(count)))
    np.testing.assert_allclose(channels["torque"], 0.01 * (np.arange(count) % 100))
    np.testing.assert_allclose(channels["velocity"], 0.007)
    assert assembler.axes["axis-1"].counters.duplicates == 0
    assert assembler.frames.used == 900


def test_a_page_that_is_lost_is_a_missing_sample(tmp_path):
    assembler = Assembler([layout_of(tmp_path, PLAIN)], gaps=GapRule(fill=0, judge=False))
    seq, _, channels = collect(assembler, list(frames(300, lost=(50, 51))), 40)["axis-1"]
    assert seq.tolist() == [*range(50), *range(52, 300)]
    assert assembler.axes["axis-1"].counters.lost == 2
    assert len(channels["torque"]) == 298
