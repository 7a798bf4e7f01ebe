"""Pieces of work side by side: in order, never within each other, stopped when nobody asks any more."""

import json
import threading
import time

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from identify.errors import InputError
from identify.mismatch.diagnosis import diagnose
from identify.threads import allowed, at_most, side_by_side, usable_cores
from plant.axis_file import read_axis
from plant.recording_files import read_recording_entry
from tests.reference.cases import CaseSpec, draw_case, write_case

TRAIN_SEED = 5501


def test_answers_come_in_the_order_of_the_questions():
    with at_most(3):
        assert list(side_by_side(lambda n: (time.sleep(0.01 * (5 - n)), n)[1], range(5))) == [0, 1, 2, 3, 4]


def test_two_pieces_run_at_once():
    met = threading.Barrier(2, timeout=10.0)
    with at_most(2):
        assert sorted(side_by_side(lambda _: met.wait(), range(2))) == [0, 1]


def test_one_thread_is_the_callers_own():
    with at_most(1):
        assert set(side_by_side(lambda _: threading.get_ident(), range(3))) == {threading.get_ident()}
    assert allowed() == 1


def test_linear_algebra_takes_no_threads_of_its_own():
    """With two busy processors a diagnosis took twice the time when it did."""

    def algebra() -> set[int]:
        return {library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}

    with threadpool_limits(2, "blas"):
        before = algebra()
        with at_most(2):
            assert algebra() == {1}
        assert algebra() == before


def test_a_piece_does_its_own_pieces_itself():
    def outer(_):
        mine = threading.get_ident()
        return mine != caller and set(side_by_side(lambda _: threading.get_ident(), range(4))) == {mine}

    caller = threading.get_ident()
    with at_most(2):
        assert all(side_by_side(outer, range(4)))


def test_what_goes_wrong_in_a_piece_reaches_the_caller_and_the_rest_is_not_begun():
    begun = []

    def work(n):
        begun.append(n)
        time.sleep(0.05)
        if n == 0:
            raise ValueError("the first")

    with at_most(2), pytest.raises(ValueError, match="the first"):
        list(side_by_side(work, range(50)))
    time.sleep(0.2)
    assert len(begun) < 10


def test_the_answer_of_a_diagnosis_does_not_depend_on_the_processors(tmp_path):
    spec = CaseSpec(seed=TRAIN_SEED, effects=("rail_defect",), duration=12.0)
    axis = read_axis(write_case(draw_case(spec), tmp_path))
    recordings = [read_recording_entry(entry, axis) for entry in axis.recordings]
    one, three = (json.dumps(diagnose(recordings, axis, threads=n).to_dict(), sort_keys=True) for n in (1, 3))
    assert one == three
    assert json.loads(one)["effects"], "a case that finds nothing would say nothing"


def test_no_thread_is_refused():
    with pytest.raises(InputError, match="threads is 0, but must be at least 1"):
        diagnose([], None, threads=0)
    assert usable_cores() >= 1
