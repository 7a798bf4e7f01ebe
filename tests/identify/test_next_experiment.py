"""The next experiment: simulated for each rival, within limits, and it settles what it says it settles."""

from pathlib import Path

import numpy as np
import pytest

from identify.mismatch.diagnosis import diagnose
from identify.mismatch.experiment import Experiment, in_words, propose, settling
from identify.mismatch.motions import Running, again, changes_of
from identify.mismatch.result import Verdict
from identify.mismatch.rivals import Rival
from identify.mismatch.separation import Model, Motion, apart_by, simulated
from identify.mismatch.words import LIMITS
from plant.axis_file import read_axis
from plant.recording_files import read_recording_entry
from tests.identify.studies.next_experiment import cases, perform, with_recording
from tests.reference.cases import write_case


@pytest.fixture(scope="module")
def tied(tmp_path_factory):
    """A dead time in a slow sine, which a lag explains as well: case, axis, recordings, diagnosis."""
    _, case = cases(2, 71_000)[1]
    axis = read_axis(write_case(case, tmp_path_factory.mktemp("tied")))
    recordings = [read_recording_entry(entry, axis) for entry in axis.recordings]
    return case, axis, recordings, diagnose(recordings, axis)


def test_a_tie_comes_with_an_experiment_in_words_and_numbers(tied):
    _, axis, _, found = tied
    assert {name for names in found.alternatives for name in names} == {"dead_time", "actuator_lag"}
    best = settling(found.experiments)
    assert best.separation >= 90.0
    assert all(one.separation < 90.0 for one in found.experiments[: found.experiments.index(best)])
    assert found.experiments[0].motion.words.startswith("the same motion again")
    assert best.motion.words in found.next_experiment
    assert "It should tell dead time from actuator lag (expected evidence " in found.next_experiment
    entry = found.to_dict()["experiments"][0]
    assert entry["needed"] == 90.0
    assert entry["sufficient"] is False
    limit = axis.drive.rated_force
    assert all(np.abs(one.motion.wanted).max() <= 1.3 * limit for one in found.experiments)


def test_the_true_machine_runs_it_and_the_tie_is_gone(tied):
    case, axis, recordings, found = tied
    columns = perform(case, settling(found.experiments).motion, np.random.default_rng(5))
    second = diagnose(with_recording(axis, recordings, columns), axis)
    assert second.verdict is Verdict.EXPLAINED
    assert second.alternatives == (("dead_time",),)
    assert second.next_experiment is None


def test_what_is_predicted_apart_is_what_two_fits_differ_by(tied):
    """No separation of a model from itself; of two, more the longer the motion."""
    from identify.mismatch.baseline import fit_baseline
    from identify.mismatch.data import gather

    _, axis, recordings, _ = tied
    samples = gather(recordings, axis).train
    model = Model.of(fit_baseline(samples, axis, 0))
    running = Running.of(samples, axis, closed=False)
    recording = simulated(model, again(running), 1e9, 0.0)
    assert apart_by(model, model, recording, axis) == pytest.approx(0.0, abs=1e-6)
    assert 0.2 < np.ptp(recording.position) / np.ptp(samples.position) < 5.0  # an open loop drifts
    assert propose([Rival(("a",), model.fit)], closed=False) == ()


@pytest.mark.parametrize("closed", [False, True])
def test_changes_are_small_and_begin_where_the_machine_runs(tied, closed):
    from identify.mismatch.data import gather

    _, axis, recordings, _ = tied
    running = Running.of(gather(recordings, axis).train, axis, closed)
    motions = list(changes_of(running))
    assert len({motion.words for motion in motions}) == len(motions) >= 6
    for motion in motions:
        assert np.isfinite(motion.wanted).all()
        assert 5.0 < motion.seconds < 41.0
        assert any(unit in motion.words for unit in (" m", " s", " N*m", " Hz", " kg"))
        if closed:
            assert np.abs(np.diff(motion.wanted)).max() < 0.1 * running.travel


def test_an_experiment_that_does_not_suffice_says_so():
    motion = Motion("the same strokes at up to 0.1 m/s, for 20 s", True, 0.01, np.zeros(2000))
    weak = Experiment(motion, ("actuator_lag",), ((("dead_time",), 30.0),))
    assert "3.0 times as long" in in_words(weak)
    hopeless = Experiment(motion, ("actuator_lag",), ((("dead_time",), 0.1),))
    assert in_words(hopeless).startswith("none of the small changes")
    assert settling([hopeless, weak]) is weak
    assert settling([]) is None
    partly = Experiment(motion, ("actuator_lag",), ((("dead_time",), 200.0), (("backlash",), 1.0)))
    assert "from dead time (expected evidence 200); not from backlash (1); 90" in in_words(partly)
    assert settling([weak, partly, hopeless]) is partly


def test_the_limits_of_the_report_stand_on_the_page_of_limits():
    page = (Path(__file__).parents[2] / "docs" / "what-it-cannot-see.md").read_text(encoding="utf-8")
    assert all(f"- {line}\n" in page for line in LIMITS)
