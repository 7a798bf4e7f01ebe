"""The last polish: what it may take over from a weaker observer, and what not."""

import dataclasses

import numpy as np
import pytest

from identify.mismatch.clock import clock
from identify.mismatch.compare import Fit
from identify.mismatch.diagnosis import diagnose
from identify.mismatch.extended import ExtendedProblem
from identify.mismatch.finish import clocks_apart, lost
from identify.mismatch.residual import setting_of
from identify.mismatch.ways import guises
from identify.preprocess import prepare
from identify.search import SearchResult
from plant.axis_file import read_axis
from plant.effects import find
from plant.recording_files import read_recording_entry
from tests.identify.studies.real_machines import data_folder
from tests.identify.test_mismatch import recorded


def test_a_fit_without_what_was_named_is_no_better_fit_of_it(tmp_path):
    _, axis, recordings = recorded(tmp_path, seed=5403, excitation="multisine", duration=8.0)
    problem = ExtendedProblem(prepare(recordings[0], axis), axis)
    ways = guises({"dead_time": find("dead_time")}, setting_of(problem, np.zeros(problem.size)))
    problem = problem.including((ways[0],))
    low, high = problem.bounds
    named = Fit(problem, SearchResult(0.5 * (low + high), 0.0, np.zeros(4), np.zeros(2), 0))
    slot = problem.slot(ways[0])
    for share, gone in ((0.0, True), (0.1, False), (1.0, True)):
        x = named.x.copy()
        x[slot] = low[slot] + share * (high - low)[slot]
        assert lost(named, Fit(problem, dataclasses.replace(named.found, x=x))) == gone


def test_what_a_time_is_told_from_may_be_clocks_that_are_apart(tmp_path):
    """A quarter of a sample at most."""
    _, axis, recordings = recorded(tmp_path, seed=5403, excitation="multisine", duration=8.0)
    problem = ExtendedProblem(prepare(recordings[0], axis), axis).including((clock(0.01, held=False),))
    x = np.zeros(problem.size)
    x[problem.slot(problem.guises[0])] = -0.2
    fitted = Fit(problem, SearchResult(x, 0.0, np.zeros(4), np.zeros(2), 0))
    assert clocks_apart(fitted) == pytest.approx(0.002)


@pytest.mark.slow
@pytest.mark.skipif(
    not (data_folder() / "emps" / "emps_train.csv.gz").exists(),
    reason=f"recordings are not in {data_folder()}; set TRIBOWATCH_DATA",
)
def test_every_named_number_of_emps_has_a_size_and_an_interval_with_a_width():
    axis = read_axis(data_folder() / "emps" / "axis.toml")
    answer = diagnose([read_recording_entry(entry, axis) for entry in axis.recordings], axis)
    assert answer.effects
    for effect in answer.effects:
        for quantity in effect.parameters.values():
            assert quantity.value != 0.0
            assert quantity.ci95 is None or quantity.ci95[0] < quantity.value < quantity.ci95[1]
    assert answer.force_error["extended"].held_out < answer.force_error["baseline"].held_out
