"""Scenarios: files checked to the last key, bursts that repeat, and time-lapse streams that say what the bursts say."""

from __future__ import annotations

import dataclasses
import datetime as dt
import threading
from pathlib import Path

import numpy as np
import pytest

from plant.axis import TorqueHold
from plant.axis_file import read_axis, write_axis
from plant.errors import InputError, ParameterError
from plant.recording_files import read_recording, write_recording
from plant.scenario import join, unix_ns
from plant.scenario_file import names, parse_scenario, read_scenario
from plant.simulator import burst_blocks, bursts_per_second_as_speed, publish_scenario
from plant.wire import Block, decode_block, encode_block

SMALL = """
name = "small"
[axis]
preset = "paper-bump"
[excitation]
form = "sine"
amplitude = 2.1
frequency = 0.2
[bursts]
start = 2026-01-05T06:00:00+01:00
samples = 300
interval_hours = 8.0
days = 3.0
"""


def small(extra: str = ""):
    return parse_scenario(SMALL + extra, "small.toml", Path())


class Sink:
    """Keeps what it is given, numbered like a publisher's stream."""

    def __init__(self) -> None:
        self.epoch, self.next_seq = 7, 0
        self.blocks: list[Block] = []

    def put(self, block: Block) -> None:
        self.blocks.append(decode_block(encode_block(block), "application/cbor"))
        self.next_seq = block.seq + len(block)


@pytest.mark.parametrize("name", names())
def test_each_scenario_of_the_package_moves_enough_within_its_travel_from_first_to_last_burst(name):
    scenario = read_scenario(name)
    low, high = scenario.axis.mechanics.travel
    for number in np.linspace(0, len(scenario) - 1, 9).astype(int):
        burst = scenario.burst(int(number))
        assert np.ptp(burst.recording.position) > 0.1
        assert low < burst.recording.position.min() < burst.recording.position.max() < high
        assert np.isfinite(burst.recording.position).all()


def test_the_package_brings_the_scenarios_that_the_manual_names():
    assert set(names()) >= {"wear", "lubricant_loss", "healthy", "rail_defect", "jam"}


def test_the_wear_scenario_is_healthy_for_thirty_days_and_ends_a_quarter_to_two_fifths_higher():
    scenario = read_scenario("wear")
    coulomb = np.array([scenario.ageing.condition(scenario.moment(day * 86400.0)).coulomb for day in range(180)])
    assert np.abs(coulomb[:30] - 1).max() < 0.05
    assert np.polyfit(np.arange(30), coulomb[:30], 1)[0] * 30 < 0.02
    assert 1.25 < coulomb[-10:].mean() < 1.4
    assert len([n for n in range(len(scenario)) if scenario.bursts.time(n) < 30 * 86400]) >= 30


def test_a_burst_is_the_same_whenever_it_is_asked_for():
    scenario = read_scenario("wear")
    for number, burst in zip(range(3), scenario, strict=False):
        assert burst.recording.sha256() == read_scenario("wear").burst(number).recording.sha256()


def test_another_seed_gives_other_samples_and_another_friction():
    scenario = read_scenario("wear")
    other = dataclasses.replace(scenario, seed=scenario.seed + 1)
    assert other.burst(0).recording.sha256() != scenario.burst(0).recording.sha256()
    assert other.burst(0).friction != scenario.burst(0).friction


def test_bursts_begin_at_their_hours_and_end_before_the_last_day():
    scenario = small()
    assert len(scenario) == 9
    begins = [burst.begin_ns for burst in scenario]
    assert begins[0] == 1767589200 * 10**9  # 2026-01-05T05:00:00Z
    np.testing.assert_array_equal(np.diff(begins), 8 * 3600 * 10**9)
    assert scenario.moment(scenario.bursts.time(1)).time_of_day == 14 * 3600  # of its own zone


def test_unix_time_is_exact_to_the_microsecond():
    moment = dt.datetime(2026, 7, 1, 12, 0, 0, 123457, tzinfo=dt.UTC)
    assert unix_ns(moment) == 1782907200123457000


def test_a_burst_that_does_not_exist_is_refused():
    with pytest.raises(ParameterError, match=r"burst is 9, but must be in 0\.\.8"):
        small().burst(9)


def test_a_payload_pulls_a_vertical_axis_down():
    load = '[[ageing]]\nkind = "load"\nmass = 1.5\n'
    bare, heavy = small().burst(0), small(load).burst(0)
    assert heavy.condition.load == 1.5
    assert heavy.recording.position[-1] < bare.recording.position[-1]


def test_reported_channels_are_those_asked_for():
    sensors = "[sensors]\nreport_velocity = true\nreport_temperature = true\nreport_load = true\n"
    recording = small(sensors).burst(0).recording
    assert recording.channels() == ("t", "force", "position", "velocity", "temperature", "load")
    np.testing.assert_array_equal(recording.temperature, 20.0)
    assert small().burst(0).recording.channels() == ("t", "force", "position")


def closed(extra: str = "", torque: str = "sample"):
    motion = f'[motion]\nform = "sine"\ncentre = 1.0\namplitude = 0.2\nfrequency = 0.2\ntorque = "{torque}"\n'
    begin, end = SMALL.index("[excitation]"), SMALL.index("[bursts]")
    return parse_scenario(SMALL[:begin] + motion + extra + SMALL[end:], "closed.toml", Path())


def test_a_closed_loop_follows_its_reference_and_says_what_its_torque_means():
    burst = closed().burst(0)
    expected = 1.0 - 0.2 * np.cos(2 * np.pi * 0.2 * burst.recording.t)
    assert np.abs(burst.recording.position - expected).max() < 2e-3
    assert burst.recording.loop == "closed"
    assert closed().axis.stream.hold == burst.recording.hold == TorqueHold.UNKNOWN
    assert closed(torque="mean").axis.stream.hold == closed(torque="mean").burst(0).recording.hold == TorqueHold.MEAN
    every_tick = closed("[motion.cascade]\nloop_time = 0.01\nvelocity_gain = 1500.0\nintegral_time = 0.1\n")
    assert every_tick.axis.stream.hold == TorqueHold.HOLD


def test_the_controller_does_not_know_the_payload():
    load = '[[ageing]]\nkind = "load"\nmass = 3.0\n'
    rise = closed(load).burst(0).recording.force - closed().burst(0).recording.force
    acceleration = 0.2 * (0.4 * np.pi) ** 2 * np.cos(0.4 * np.pi * 0.01 * np.arange(100, 300))
    assert rise[100:].mean() == pytest.approx(3.0 * (9.81 + acceleration.mean()), rel=0.01)


def test_effects_of_the_file_and_of_age_act():
    defect = "[effects.rail_defect]\namplitude = 40.0\ncentre = 1.1\nwidth = 0.02\n"
    assert small(defect).burst(0).recording.position.max() < small().burst(0).recording.position.max() - 1e-3
    scenario = read_scenario("rail_defect")
    before, after = scenario.burst(50), scenario.burst(300)
    assert before.condition.effects == ()
    assert after.condition.effects[0][1]["amplitude"] == 60.0
    healthy = dataclasses.replace(
        scenario, ageing=dataclasses.replace(scenario.ageing, stages=scenario.ageing.stages[1:])
    )
    assert healthy.burst(300).friction == after.friction
    assert np.abs(healthy.burst(300).recording.position - after.recording.position).max() > 5e-3


def test_a_fault_of_the_sensors_lasts_its_days_and_leaves_the_friction_alone():
    scenario = read_scenario("bad_sensor")
    healthy = dataclasses.replace(scenario, faults=())
    for day, fault in (
        (19, None),
        (21, "frozen"),
        (25, None),
        (31, "spikes"),
        (41, "lost"),
        (51, "jitter"),
        (59, None),
    ):
        seen, well = scenario.burst(4 * day), healthy.burst(4 * day)
        assert seen.friction == well.friction
        same_length = len(seen.recording) == len(well.recording)
        found = {
            "lost": not same_length,
            "frozen": bool((np.diff(seen.recording.position[600:890]) == 0).all()),
            "spikes": same_length and int((np.abs(np.diff(seen.recording.position)) > 0.03).sum()) > 5,
            "jitter": same_length and not np.array_equal(seen.recording.t, well.recording.t),
        }
        assert [name for name, there in found.items() if there] == ([fault] if fault else [])


def test_joined_bursts_keep_their_gaps():
    scenario = small()
    joined = join([scenario.burst(2), scenario.burst(3)])
    assert len(joined) == 600
    assert joined.t[0] == 0.0
    assert joined.t[300] == 8 * 3600.0
    with pytest.raises(ParameterError, match="bursts is 0"):
        join([])


def test_a_written_burst_is_read_back_by_its_written_axis(tmp_path):
    scenario = read_scenario("wear")
    write_axis(scenario.axis, tmp_path / "axis.toml")
    axis = read_axis(tmp_path / "axis.toml")
    burst = scenario.burst(5)
    write_recording(burst.recording, tmp_path / "burst.csv", axis)
    again = read_recording(tmp_path / "burst.csv", axis)
    np.testing.assert_allclose(again.force, burst.recording.force, rtol=1e-12)
    np.testing.assert_array_equal(again.position, burst.recording.position)
    assert axis.sensor.position_resolution == scenario.sensors.position_resolution
    assert axis.drive.force_resolution == pytest.approx(1e-3 * axis.drive.rated_force)


def test_a_scenario_names_its_axis_file_relative_to_itself(tmp_path):
    write_axis(small().axis, tmp_path / "axis.toml")
    text = SMALL.replace('preset = "paper-bump"', 'file = "axis.toml"')
    law = "[friction]\ncoulomb_force = 90\nstatic_force = 150\nstribeck_velocity = 0.1\nviscous_coefficient = 180\n"
    (tmp_path / "own.toml").write_text(text + law)
    assert read_scenario(tmp_path / "own.toml").burst(0).recording.sha256() == small().burst(0).recording.sha256()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("amplitude", "amplitud", r"small.toml \[excitation\]: unknown key 'amplitud'; did you mean 'amplitude'\?"),
        ('"sine"', '"sinus"', r"\[excitation\] form: unknown 'sinus'; did you mean 'sine'\?"),
        ('form = "sine"', "", r"\[excitation\] form is None, but must be one of sine, square"),
        ("[bursts]", "[burst]", r"small.toml: unknown key 'burst'; did you mean 'bursts'\?"),
        ("[axis]\npreset", "[bursts2]\npreset", r"unknown key 'bursts2'"),
        ("amplitude = 2.1", "amplitude = -2.1", r"\[excitation\]: sine: amplitude is -2.1 N\*m, but must be >= 0"),
        ("frequency = 0.2", "", r"\[excitation\]: key 'frequency' is missing"),
        ("frequency = 0.2", 'frequency = "0.2"', "frequency is '0.2', but must be a finite number"),
        ("samples = 300", "samples = 300.5", "samples is 300.5, but must be an integer"),
        ("samples = 300", "samples = 1", r"bursts: samples is 1 samples, but must be >= 2"),
        ("days = 3.0", "days = 0", r"bursts: days is 0 d, but must be > 0 d"),
        ("T06:00:00+01:00", "T06:00:00", r"start is .* but must be a time with zone"),
        ("paper-bump", "paper-bumb", r"\[axis\] preset: unknown 'paper-bumb'; did you mean 'paper-bump'\?"),
        ('preset = "paper-bump"', "", r"\[axis\]: give preset = "),
        ('name = "small"', "name = 3", "name is 3, but must be a text in quotes"),
        ('name = "small"', "name = ", "small.toml: not valid TOML"),
        ('name = "small"', "seed = -1", "seed is -1, but must be an integer >= 0"),
        ('preset = "paper-bump"', 'preset = "paper-bump"\nname = "a b"', r"axis name 'a b' is not allowed"),
        ('preset = "paper-bump"', 'file = "no.toml"', "no.toml: no such axis file"),
    ],
)
def test_a_wrong_file_is_refused_in_one_line_that_says_what_to_mend(old, new, words):
    assert old in SMALL
    with pytest.raises(InputError, match=words) as error:
        parse_scenario(SMALL.replace(old, new), "small.toml", Path())
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("extra", "words"),
    [
        ('[[ageing]]\nkind = "ware"', r"\[\[ageing\]\] 1 kind: unknown 'ware'; did you mean 'wear'\?"),
        ('[[ageing]]\nkind = "wear"\nper_km = 1', r"\[\[ageing\]\] 1: unknown key 'per_km'; did you mean"),
        ('[[ageing]]\nkind = "relubrication"\ndays = ["x"]', r"days\[0\] is 'x', but must be a finite number"),
        ('[[ageing]]\nkind = "relubrication"\ndays = 5', "days is 5, but must be a list of values"),
        ("[ageing]\nkind = 1", r"ageing must be written \[\[ageing\]\]"),
        ("[motion]\nform = 'sine'", r"give a table \[excitation\] .* or \[motion\] .* one of them"),
        ("[effects.rail_defekt]\na = 1", r"\[effects\]: unknown 'rail_defekt'; did you mean 'rail_defect'\?"),
        ("[effects.rail_defect]\namplitude = 1", r"\[effects\]: rail_defect needs centre \[m\]"),
        ("[effects.rail_defect]\namplitude = 'x'", r"\[effects.rail_defect\]: must be a table of numbers"),
        ("[effects.end_stop]\nposition = 1\nstiffness = -1", r"end_stop.stiffness is -1 N/m, but must be from 0"),
        ("[effects]\nx = 1", r"\[effects\]: unknown 'x'"),
        (
            "[effects.rail_defect]\namplitude = 1\ncentre = 1\nwidth = 0.1\n[[ageing]]\nkind = 'rail_defect'\n"
            "newtons_per_day = 1\ncentre = 1\nwidth = 0.1",
            "rail_defect can be there only once",
        ),
        ("[[fault]]\nreport_load = true", r"\[\[fault\]\] 1: unknown key 'report_load'"),
        ("[[fault]]\nspike_rat = 0.1", r"unknown key 'spike_rat'; did you mean 'spike_rate'\?"),
        ("[fault]\nspike_rate = 0.1", r"fault must be written \[\[fault\]\]"),
        ("[sensors]\nreport_load = 1", "report_load is 1, but must be true or false"),
        ("[friction]\ncoulomb_force = -5.0", r"\[friction\]: coulomb_force is -5 N, but must be >= 0 N"),
    ],
)
def test_a_wrong_table_is_refused_by_its_number_and_key(extra, words):
    with pytest.raises(InputError, match=words):
        small(extra)


@pytest.mark.parametrize(
    ("extra", "words"),
    [
        (
            "[motion.cascade]\nloop_time = 0.003\n",
            "sample_time is 0.01 s, but must be a multiple of .* loop_time = 0.003",
        ),
        ("[motion.cascade]\nposition_gain = 0.0\n", r"\[motion.cascade\]: cascade: position_gain is 0 1/s"),
        ("[motion.cascade]\ngain = 1.0\n", r"\[motion.cascade\]: unknown key 'gain'; did you mean"),
        ("jerk = 1.0\n", r"\[motion\]: unknown key 'jerk'"),
    ],
)
def test_a_wrong_motion_is_refused(extra, words):
    with pytest.raises(InputError, match=words):
        closed(extra)


def test_an_unknown_name_lists_those_there_are():
    with pytest.raises(InputError, match=r"nowhere: no such scenario file; .* wear"):
        read_scenario("nowhere")


def test_blocks_of_a_burst_say_what_the_burst_says_in_the_machines_own_units():
    scenario = read_scenario("wear")
    burst = scenario.burst(3)
    blocks = list(burst_blocks(burst, "axis-0001", scenario.axis.mechanics.gain, epoch=4, seq=6000))
    assert [block.seq for block in blocks] == [6000, 6500, 7000, 7500]
    torque = np.concatenate([block.torque for block in blocks])
    np.testing.assert_allclose(torque * scenario.axis.mechanics.gain, burst.recording.force, rtol=1e-15)
    stamps = np.concatenate([block.t_ns for block in blocks])
    assert stamps[0] == burst.begin_ns
    np.testing.assert_array_equal(np.diff(stamps), 10_000_000)


def test_a_published_scenario_arrives_complete_in_order_and_numbered_without_a_gap():
    sink, seen = Sink(), []
    scenario = small()
    sent = publish_scenario(scenario, sink, first=2, last=5, on_burst=lambda burst: seen.append(burst.number))
    assert (sent.bursts, sent.samples, sent.epoch, sent.interrupted) == (3, 900, 7, False)
    assert seen == [2, 3, 4]
    position = np.concatenate([block.position for block in sink.blocks])
    expected = np.concatenate([scenario.burst(number).recording.position for number in (2, 3, 4)])
    np.testing.assert_array_equal(position, expected)
    assert [block.seq for block in sink.blocks] == [0, 300, 600]
    publish_scenario(scenario, sink, first=5, last=6)
    assert sink.blocks[-1].seq == 900


def test_publishing_keeps_the_pace_it_is_given_and_never_runs_ahead():
    scenario = small()
    speed = bursts_per_second_as_speed(scenario, 20.0)
    assert speed == 20 * 8 * 3600
    sent = publish_scenario(scenario, Sink(), speed=speed)
    assert sent.seconds >= 8 / 20


def test_publishing_stops_when_it_is_told():
    stop = threading.Event()
    sent = publish_scenario(small(), Sink(), speed=1e6, stop=stop, on_burst=lambda _: stop.set())
    assert sent.interrupted
    assert sent.bursts == 1


def test_a_pace_of_nothing_is_refused():
    with pytest.raises(ParameterError, match="speed is 0"):
        publish_scenario(small(), Sink(), speed=0.0)
    with pytest.raises(ParameterError, match="bursts per second is -1"):
        bursts_per_second_as_speed(small(), -1.0)
