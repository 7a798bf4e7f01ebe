"""The force error is what a textbook computes at the recorded rate, and what the authors of EMPS published."""

import dataclasses

import numpy as np
import pytest
from scipy.signal import butter, decimate, sosfiltfilt

from identify.mismatch.data import Judges, gather
from identify.mismatch.extended import ExtendedProblem
from identify.mismatch.force_error import force_errors, native
from identify.mismatch.inverse import unexplained
from plant import read_axis, read_recording
from plant.axis import TorqueHold
from tests.identify.studies.real_machines import data_folder
from tests.identify.test_mismatch import recorded


@pytest.fixture(scope="module", params=[1, 2], ids=["one recording", "two recordings"])
def fast(request, tmp_path_factory):
    """A machine at 1 kHz with nothing hidden: case, axis, recordings, evidence."""
    spec = {"excitation": "loop_scurve", "period": 0.001, "duration": 8.0, "recordings": request.param, "noise": 1e-5}
    case, axis, recordings = recorded(tmp_path_factory.mktemp("fast"), seed=5401, **spec)
    return case, axis, recordings, gather(recordings, axis)


def test_fast_recordings_are_split_as_the_evidence_but_not_averaged(fast):
    _, _, recordings, evidence = fast
    parts = native(recordings, fast[1], evidence)
    assert evidence.train.sample_time == pytest.approx(0.005)
    assert [part.sample_time for part in (*parts.train, *parts.held_out)] == pytest.approx([0.001] * 2)
    assert sum(map(len, (*parts.train, *parts.held_out))) == sum(map(len, recordings))
    if evidence.kind == "time":
        assert parts.held_out[0].t[0] == pytest.approx(evidence.held_out.t[0], abs=0.002)


@pytest.mark.parametrize("judges", [Judges.PART, Judges.OTHERS, Judges.TENTHS])
def test_fast_recordings_are_unseen_where_the_averaged_ones_are(fast, judges):
    """What was fitted of the last recording is no part of the unseen force error, at any rate."""
    _, axis, recordings, _ = fast
    evidence = gather(recordings, axis, judges)
    parts = native(recordings, axis, evidence)
    for averaged, own in ((evidence.train, parts.train), (evidence.held_out, parts.held_out)):
        assert sum(map(len, own)) == pytest.approx(5 * len(averaged), abs=10)
        assert own[0].t[0] == pytest.approx(averaged.t[0], abs=0.003)
        assert own[-1].t[-1] == pytest.approx(averaged.t[-1], abs=0.006)


def test_slow_recordings_are_taken_as_they_were_fitted(tmp_path):
    _, axis, recordings = recorded(tmp_path, seed=5402, excitation="multisine", duration=8.0)
    evidence = gather(recordings, axis)
    assert native(recordings, axis, evidence).train[0] is evidence.train


def test_the_force_error_is_that_of_a_textbook_inverse_model(fast):
    """m_e a + M g + friction of the true machine by numpy, position and residual through the same filter."""
    case, axis, recordings, evidence = fast
    plant = case.plant
    problem = ExtendedProblem(evidence.train, axis)
    names = ("coulomb_force", "static_force", "stribeck_velocity", "viscous_coefficient")
    x = problem.encode({name: getattr(plant, name) for name in names} | {"constant_force": 0.0})
    parts = native(recordings, axis, evidence)
    samples = parts.train[0]
    ours = unexplained(problem, x, samples)
    sections = butter(4, 100.0 / 500.0, output="sos")
    position = sosfiltfilt(sections, samples.position)
    velocity = np.gradient(position, 0.001)
    acceleration = np.append(np.diff(velocity), 0.0) / 0.001  # the force is held from this sample to the next
    velocity = np.append(0.5 * (velocity[1:] + velocity[:-1]), 0.0)
    speed = np.abs(velocity)
    bump = (plant.static_force - plant.coulomb_force) * np.exp(-speed / plant.stribeck_velocity)
    dry = np.sign(velocity) * (plant.coulomb_force + bump)
    model = plant.moving_mass * acceleration + plant.weight + dry + plant.viscous_coefficient * velocity
    lacking = sosfiltfilt(sections, samples.force - model)[ours.index]
    sliding = (sosfiltfilt(sections, (speed < 0.01).astype(float)) < 1e-3)[ours.index]  # at rest friction has no value
    assert np.mean(sliding) > 0.3
    assert np.linalg.norm((ours.lacking - lacking)[sliding]) < 0.2 * np.linalg.norm(lacking[sliding])
    kept, whole = decimate(ours.lacking, 5, zero_phase=True), decimate(ours.force, 5, zero_phase=True)
    expected = 100 * np.linalg.norm(kept) / np.linalg.norm(whole)
    assert force_errors(problem, x, parts).train == pytest.approx(expected, rel=1e-3)


@pytest.mark.skipif(
    not (data_folder() / "emps" / "emps_train.csv.gz").exists(),
    reason=f"recordings are not in {data_folder()}; set TRIBOWATCH_DATA",
)
def test_the_published_model_of_emps_has_its_published_force_error():
    """Janot, Gautier & Brunot 2019: 4.08 % on their file, 5.98 % on the pulses, forces taken at their samples."""
    axis = read_axis(data_folder() / "emps" / "axis.toml")
    recordings = [
        dataclasses.replace(read_recording(one.file, axis), hold=TorqueHold.LINEAR) for one in axis.recordings
    ]
    evidence = gather(recordings, axis)
    problem = ExtendedProblem(evidence.train, axis)
    friction = {"coulomb_force": 20.3935, "static_force": 20.3935, "stribeck_velocity": 0.02}
    rest = {"viscous_coefficient": 203.5034, "constant_force": -3.1648, "moving_mass": 95.1089}
    error = force_errors(problem, problem.encode(friction | rest), native(recordings, axis, evidence))
    assert error.train == pytest.approx(4.08, rel=0.03)
    assert error.held_out == pytest.approx(5.98, rel=0.03)
