from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context

import pytest

from identify import identify_many
from identify.errors import InputError
from identify.many import spread_seeds
from tests.identify.studies.machines import Setting, draw_case

CASES = [draw_case(seed, Setting("sine", samples=800)) for seed in range(4)]
RECORDINGS = [case.recording for case in CASES]
AXES = [case.axis for case in CASES]


@pytest.fixture(scope="module")
def alone():
    return [result.to_dict() for result in identify_many(RECORDINGS, AXES, seeds=3)]


@pytest.mark.parametrize(("workers", "chunk"), [(1, 1), (3, 1), (2, 3)])
def test_threads_give_the_same_answers_however_many(alone, workers, chunk):
    with ThreadPoolExecutor(workers) as pool:
        results = identify_many(RECORDINGS, AXES, executor=pool, seeds=3, chunk=chunk)
    assert [result.to_dict() for result in results] == alone


def test_processes_give_the_same_answers(alone):
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        results = identify_many(RECORDINGS, AXES, executor=pool, seeds=3, chunk=2)
    assert [result.to_dict() for result in results] == alone


def test_a_window_searches_alike_in_any_company(alone):
    assert [result.to_dict() for result in identify_many(RECORDINGS[:2], AXES[:2], seeds=3)] == alone[:2]
    assert len(set(spread_seeds(3, 1000))) == 1000


def test_options_and_starts_reach_each_window():
    results = identify_many(RECORDINGS[:2], AXES[:2], seeds=[7, 8], starts=[CASES[0].truth, None], method="paper")
    assert [result.seed for result in results] == [7, 8]
    assert {result.method for result in results} == {"paper"}


def test_lists_of_different_lengths_are_refused():
    with pytest.raises(InputError, match="2 axes for 4 recordings"):
        identify_many(RECORDINGS, AXES[:2])
    with pytest.raises(InputError, match="chunk is 0"):
        identify_many(RECORDINGS, AXES, chunk=0)
