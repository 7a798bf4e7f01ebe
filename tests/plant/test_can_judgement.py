"""A refusal of the bridge stands until the drive may have changed, and falls when what it sends fits the layout."""

import struct

import numpy as np
import pytest

from plant.can_assembly import Assembler
from plant.can_axis import GapRule
from plant.can_batch import DATA
from plant.can_judgement import RETRY
from plant.can_layout import AxisLayout, Frame, Signal
from tests.plant.can_examples import MS, START, collect, cycles, drive, sync

RIGHT = range(400, 700)


def wrong(numbers, node=1, period=10 * MS):
    """A mapping in another order: the position first."""
    for number in numbers:
        payload = struct.pack("<iHh", 1_000_000 + 777 * number, 0x0627, 5)
        yield from [sync(START + number * period, number % 240 + 1), (DATA, 0x180 + node, START, payload)]


def heartbeat(state):
    return DATA, 0x701, START, bytes([state])


@pytest.mark.parametrize("change", [[heartbeat(0)], [heartbeat(127), heartbeat(5)], [heartbeat(0), heartbeat(5)]])
def test_a_drive_that_starts_anew_with_the_right_mapping_is_taken(change):
    assembler = Assembler([drive()])
    frames = [*wrong(range(400)), *change, *cycles(RIGHT)]
    seq, stamps, channels = collect(assembler, frames, 20)["axis-1"]
    counters = assembler.axes["axis-1"].counters
    assert assembler.refused("axis-1") is None
    assert 290 <= len(seq) <= 300
    assert counters.refused_samples + len(seq) == counters.samples == 700
    assert seq[0] == counters.refused_samples  # the daemon reports as many as missing
    assert stamps[-1] == START + 699 * 10 * MS
    np.testing.assert_allclose(channels["position"], 1e-6 * (1000 + np.arange(700 - len(seq), 700)))


def test_a_drive_that_starts_anew_with_the_same_wrong_mapping_stays_refused():
    assembler = Assembler([drive()])
    frames = [*wrong(range(400)), heartbeat(0), heartbeat(5), *wrong(range(400, 800))]
    assert collect(assembler, frames, 20) == {}
    assert "statuswords" in assembler.refused("axis-1")
    assert assembler.axes["axis-1"].counters.refused_samples == 800


def test_a_drive_that_was_off_is_looked_at_again():
    assembler = Assembler([drive()])
    off = [sync(START + number * 10 * MS, number % 240 + 1) for number in range(400, 1500)]
    seq, *_ = collect(assembler, [*wrong(range(400)), *off, *cycles(range(1500, 1800))], 20)["axis-1"]
    assert 290 <= len(seq) <= 300
    assert assembler.refused("axis-1") is None


def test_a_mapping_that_was_changed_without_a_word_is_noticed_by_its_statuswords():
    retry = round(RETRY / 0.01)
    assembler = Assembler([drive()])
    seq, *_ = collect(assembler, [*wrong(range(400)), *cycles(range(400, 1200 + retry))], 100)["axis-1"]
    assert len(seq) >= 600
    assert assembler.refused("axis-1") is None


def test_a_width_is_not_believed_again_because_the_axis_stands():
    """The lower half of a position that wraps looks right at rest: only a new start of the drive lifts that refusal."""
    signals = (Signal("position", 16, 16, signed=True), Signal("torque", 32, 16, signed=True))
    layout = AxisLayout("axis-1", (Frame(0x181, 6, signals, "TPDO1"),), 1)
    frames = []
    for number in range(300 + round(2 * RETRY / 0.01)):
        position = (number * 2500) % 65536 - 32768 if number < 300 else 5
        payload = struct.pack("<Hhh", 0x0627, position, 5)
        frames += [sync(START + number * 10 * MS, number % 240 + 1), (DATA, 0x181, START, payload)]
    assembler = Assembler([layout], gaps=GapRule())
    assert collect(assembler, frames, 100) == {}
    assert "turns over at 16 bits" in assembler.refused("axis-1")


def test_a_master_with_the_right_period_after_a_pause_is_believed():
    assembler = Assembler([drive()])
    fast = cycles(range(3000), period=MS)
    later = START + 3000 * MS + 5000 * MS
    slow = cycles(range(600), start=later)
    seq, *_ = collect(assembler, [*fast, *slow], 90)["axis-1"]
    assert assembler.refused("axis-1") is None
    assert len(seq) >= 500


def test_right_samples_are_never_held_back_by_a_boot_up():
    assembler = Assembler([drive()])
    frames = [*cycles(range(300)), heartbeat(0), heartbeat(5), *cycles(range(300, 600))]
    seq, *_ = collect(assembler, frames, 20)["axis-1"]
    assert len(seq) == 600
