"""Genetic search and polish of eq. (4) over one free run, judged by rates on the problems of the search bench."""

import numpy as np
import pytest

from identify.criterion import FREE
from identify.errors import InputError
from identify.identification import identify_friction
from identify.output_error import nothing_left, output_error_search
from identify.paper_method import to_unknowns
from identify.polish import polish_all
from tests.benchmarks.search_study import SUCCESS, criterion, draw
from tests.identify.studies.machines import FRICTION, Setting, draw_case

PROBLEMS = 40


@pytest.fixture(scope="module")
def searched():
    ends = []
    for number in range(PROBLEMS):
        case = draw(number)
        problem = case.problem()
        found = output_error_search(problem, np.random.default_rng(number))
        best = polish_all(problem, to_unknowns(problem, case.truth[None]), FREE, 60, 1e-4).x
        values = criterion(problem, np.concatenate([found.x[None], best]))
        ends.append((values[0] / values[1], found, problem))
    return ends


def test_it_comes_within_one_percent_of_the_optimum(searched):
    assert sum(ratio <= SUCCESS for ratio, _, _ in searched) >= PROBLEMS - 1  # 200 of 200 in the bench


def test_it_needs_a_few_hundred_candidate_runs(searched):
    assert np.median([found.evaluations for _, found, _ in searched]) < 600


def test_it_stays_in_the_box_and_holds_what_is_known(searched):
    for _, found, problem in searched:
        low, high = problem.bounds
        assert ((found.x >= low) & (found.x <= high)).all()
        assert (found.x[4:] == 0).all()


def test_white_errors_are_told_from_what_a_wrong_optimum_leaves(searched):
    _, found, problem = searched[0]
    assert nothing_left(problem, found.x)
    wrong = found.x.copy()
    wrong[0] *= 1.03
    assert not nothing_left(problem, wrong)


def test_a_clean_machine_is_identified_by_either_criterion():
    errors = {"observer": [], "output_error": []}
    for seed in range(5):
        case = draw_case(seed, Setting("sine", noise=1e-4, dirt=0.0))
        for name, found in errors.items():
            result = identify_friction(case.recording, case.axis, seed=seed, criterion=name)
            found.append([abs(result.parameters[key].value / case.truth[key] - 1) for key in FRICTION])
    assert np.median(errors["output_error"], axis=0)[[0, 1, 3]].max() < 0.01
    assert np.median(errors["observer"], axis=0)[[0, 1, 3]].max() < 0.01


def test_an_unknown_criterion_is_named():
    case = draw_case(0, Setting("sine"))
    with pytest.raises(InputError, match=r"criterion 'least'.*observer, output_error"):
        identify_friction(case.recording, case.axis, criterion="least")
