"""The audit: judged by its rates over 200 healthy machines and over a zoo of mistakes at the edge."""

import dataclasses
import os
from pathlib import Path

import numpy as np
import pytest

from identify.audit import audit_recording, worst
from identify.audit_fit import fit
from identify.suitability import suitability
from plant.axis import Axis, Drive, Mechanics, Orientation, RecordingEntry, Sensor
from plant.axis_file import read_axis
from plant.recording import Recording
from plant.recording_files import read_recording_entry
from tests.identify import healthy_axes
from tests.identify.mistakes import ZOO, vertical

DATA = Path(os.environ.get("TRIBOWATCH_DATA", Path(__file__).parents[3] / "shared" / "data"))
replace = dataclasses.replace


@pytest.fixture(scope="module")
def machines():
    return healthy_axes.healthy_axes(200, seed=1)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_no_healthy_machine_of_200_is_refused_and_hardly_one_is_warned_of(seed):
    verdicts = [worst(audit_recording(m.recording, m.axis)) for m in healthy_axes.healthy_axes(200, seed)]
    assert verdicts.count("refuse") == 0
    assert verdicts.count("warn") <= 4


@pytest.mark.parametrize("name", ZOO)
def test_each_mistake_at_the_edge_is_refused_and_called_by_its_name(machines, name):
    break_it, concerns, word, least = ZOO[name]
    concerned = [m for m in machines if concerns(m.axis)][:100]
    assert len(concerned) >= 30
    refused = named = 0
    for machine in concerned:
        findings = audit_recording(break_it(machine.recording, machine.axis), machine.axis)
        refusals = [finding for finding in findings if finding.severity == "refuse"]
        refused += bool(refusals)
        named += any(word in (finding.likely or "") for finding in refusals)
    assert refused >= least * len(concerned), f"{refused} of {len(concerned)} refused"
    if word:
        assert named >= 0.7 * refused, f"{named} of {refused} named"


def test_a_vertical_axis_tells_which_sign_is_wrong(machines):
    machine = next(m for m in machines if vertical(m.axis))
    for channel, words in (("force", "force has the wrong sign"), ("position", "position counts downwards")):
        turned = replace(machine.recording, **{channel: -getattr(machine.recording, channel)})
        (finding,) = [f for f in audit_recording(turned, machine.axis) if f.severity == "refuse" and f.check == "sign"]
        assert finding.likely == words
        assert f"negative scale of {channel}" in finding.text


def test_the_rough_fit_finds_mass_weight_and_friction_within_some_percent():
    errors = []
    for machine in healthy_axes.healthy_axes(60, seed=5):
        if vertical(machine.axis):
            result = fit(machine.recording)
            errors.append(result.constant / 9.81 / (result.mass + 1e-12))
    assert len(errors) >= 15
    assert abs(np.median(errors) - 1) < 0.05  # weight over mass is g, payload or not


def test_a_stretch_at_rest_is_not_judged_and_not_refused():
    axis = Axis("a", Mechanics(M=20.0))
    n = 1000
    rest = Recording(np.arange(n) * 0.01, np.full(n, 196.2), np.full(n, 0.5))
    findings = audit_recording(rest, axis)
    assert worst(findings) == "warn"
    assert any(finding.check == "motion" for finding in findings)


@pytest.mark.parametrize("n", [1, 2, 3, 10, 40])
def test_short_and_empty_recordings_are_judged_without_a_crash(n):
    axis = Axis("a", Mechanics(M=20.0), Drive(100.0, 0.1), Sensor(1e-5))
    for value in (0.0, np.nan, np.inf):
        recording = Recording(np.arange(n) * 0.01, np.full(n, value), np.full(n, value), velocity=np.full(n, value))
        assert audit_recording(recording, axis)
        assert not suitability(recording, axis).good


def of_check(check, recording, axis):
    return [finding for finding in audit_recording(recording, axis) if finding.check == check]


def test_unusable_samples_and_a_broken_clock_are_counted(machines):
    machine = machines[0]
    holes = machine.recording.force.copy()
    holes[100:150] = np.nan
    (finding,) = [
        f for f in audit_recording(replace(machine.recording, force=holes), machine.axis) if f.check == "samples"
    ]
    assert (finding.severity, finding.seen) == ("warn", "50 of 2000")
    t = machine.recording.t.copy()
    t[500:] += 60.0
    (finding,) = of_check("clock", replace(machine.recording, t=t), machine.axis)
    assert finding.severity == "ok"
    assert "1 gaps" in finding.seen


def test_a_delay_between_force_and_position_is_warned_of_with_its_size():
    caught, sizes = 0, []
    machines = healthy_axes.healthy_axes(60, seed=7)
    for machine in machines:
        late = replace(machine.recording, force=np.roll(machine.recording.force, 6))
        for finding in audit_recording(late, machine.axis):
            if finding.check == "delay" and finding.severity == "warn":
                caught += 1
                sizes.append(float(finding.seen.split()[0]))
                assert "the force comes" in finding.text
    assert caught >= 0.5 * len(machines)
    assert 40 <= np.median(sizes) <= 80


def test_a_velocity_in_other_units_and_a_temperature_in_kelvin_are_warned_of(machines):
    machine = next(m for m in machines if m.axis.is_rotary)
    rpm = replace(
        machine.recording, velocity=machine.recording.velocity * 60 / (2 * np.pi), temperature=np.full(2000, 300.0)
    )
    found = {finding.check: finding for finding in audit_recording(rpm, machine.axis)}
    assert found["velocity"].severity == "warn"
    assert "revolutions per minute" in found["velocity"].likely
    assert found["temperature"].likely == "kelvin"


def test_findings_are_sorted_by_gravity_and_become_json(machines):
    machine = machines[0]
    findings = audit_recording(replace(machine.recording, force=machine.recording.force * 1e3), machine.axis)
    order = [["refuse", "warn", "ok"].index(finding.severity) for finding in findings]
    assert order == sorted(order)
    assert set(findings[0].to_dict()) == {"severity", "check", "seen", "expected", "likely", "text"}


# --- good enough? ---------------------------------------------------------------------------------------------


def strokes(speeds, stroke=0.5, mass=10.0, friction=5.0, period=0.01):
    y, v = [], []
    for speed in speeds:
        for way in (1, -1):
            s = healthy_axes._stroke(stroke, speed, 4.0)
            y += list(s if way > 0 else stroke - s)
            v += list(way * np.gradient(s, period))
    y, v = np.array(y), np.array(v)
    rng = np.random.default_rng(1)
    force = mass * np.gradient(v, period) + friction * np.sign(v) + 2 * v + rng.normal(0, 0.1, len(v))
    return Recording(np.arange(len(y)) * period, force, y)


PLAIN = Axis("a", Mechanics(Orientation.HORIZONTAL, M=10.0, travel=(0.0, 1.0)))


def test_strokes_both_ways_at_several_speeds_are_good_enough():
    verdict = suitability(strokes([0.5, 0.15, 0.05]), PLAIN)
    assert verdict.good, verdict.text
    assert verdict.strokes == 6
    assert verdict.friction == pytest.approx(5.0 + 2 * 0.1, rel=0.2)
    assert "good enough: 6 strokes" in verdict.text
    assert verdict.motion is None


SHORT = strokes([0.5, 0.3, 0.15], stroke=0.05)
SLOWER = strokes([0.5, 0.15, 0.05])
NOISE = np.random.default_rng(1).normal(0, 50, len(SLOWER))


@pytest.mark.parametrize(
    ("recording", "word"),
    [
        (SHORT, "samples in motion"),
        (strokes([0.1]), "2 strokes"),
        (strokes([0.1] * 4), "a factor of"),
        (replace(SLOWER, position=0.01 * SLOWER.t), "one way"),
        (replace(SLOWER, position=np.zeros(len(SLOWER))), "does not move"),
        (replace(SLOWER, force=NOISE), "shows only"),
    ],
)
def test_what_is_missing_is_said_in_numbers_with_the_motion_that_would_do(recording, word):
    verdict = suitability(recording, PLAIN)
    assert not verdict.good
    assert word in verdict.text
    assert "Do this motion: 6 strokes of " in verdict.text


def test_the_motion_we_ask_for_is_itself_good_enough():
    import re

    asked = suitability(strokes([0.1] * 4), PLAIN).motion
    y, force = [], []
    for length, speed in re.findall(r"6 strokes of ([\d.]+) m at ([\d.]+) m/s", asked):
        for k in range(6):
            s = healthy_axes._stroke(float(length), float(speed), 4.0)
            way = 1 if k % 2 == 0 else -1
            v = way * np.gradient(s, 0.01)
            y += list(s if way > 0 else float(length) - s)
            force += list(10.0 * np.gradient(v, 0.01) + 5.0 * np.sign(v) + 2 * v)
    verdict = suitability(Recording(np.arange(len(y)) * 0.01, np.array(force), np.array(y)), PLAIN)
    assert verdict.good, verdict.text


# --- real machines --------------------------------------------------------------------------------------------


@pytest.mark.skipif(not (DATA / "emps").exists(), reason=f"no EMPS recordings under {DATA}: set TRIBOWATCH_DATA")
def test_the_real_ball_screw_is_healthy_and_its_mistakes_are_caught():
    axis = read_axis(DATA / "emps" / "axis.toml")
    for entry in axis.recordings:
        recording = read_recording_entry(entry, axis)
        assert worst(audit_recording(recording, axis)) == "ok"
        for channel, factor in (("force", -1), ("position", -1), ("force", 1e3), ("position", 1e3), ("t", 1e3)):
            wrong = replace(recording, **{channel: getattr(recording, channel) * factor})
            assert worst(audit_recording(wrong, axis)) == "refuse", (channel, factor)


@pytest.mark.skipif(
    not (DATA / "openarm_dm_joints").exists(), reason=f"no joint recordings under {DATA}: set TRIBOWATCH_DATA"
)
def test_a_real_joint_angle_that_wraps_is_refused():
    columns = {"t": "t_s", "torque": "torque_feedback_Nm", "position": "position_rad"}
    file = DATA / "openarm_dm_joints" / "openarm_20260425_085915.csv.gz"
    axis = Axis("joint", Mechanics(Orientation.ROTARY, J=0.0013, inertia_known=False))
    entry = RecordingEntry(file, columns, select={"motor": 5, "repeat": 1})
    finding = audit_recording(read_recording_entry(entry, axis), axis)[0]
    assert (finding.severity, finding.check) == ("refuse", "position jumps")
    unwrapped = replace(entry, columns=columns | {"position": "position_unwrapped_rad"})
    assert worst(audit_recording(read_recording_entry(unwrapped, axis), axis)) != "refuse"
