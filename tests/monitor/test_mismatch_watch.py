"""When a diagnosis is due: once it has settled, again when it has grown, ever more rarely where nothing has a name."""

import itertools

from monitor.mismatch_watch import GONE, LONGEST, RETRY, MismatchWatch
from monitor.store_records import DiagnosisRecord
from monitor.windows import Window, WindowId

NAMED = {"verdict": "explained", "effects": [{"name": "rail_defect", "parameters": {}}]}
NAMELESS = {"verdict": "unexplained", "effects": []}


def diagnosis(result):
    return DiagnosisRecord(0, 0, 0, result["verdict"], result, [], 0, "1", 0.0)


def live(watch, windows, force=10.0, answer=None, holds=True):
    """Numbers of the windows with which a diagnosis was due; `answer` is what each of them says."""
    due = []
    for number in range(windows):
        if watch.note(Window(WindowId(1, number, 1), number, number), holds, force):
            due.append(number)
            if answer is not None:
                watch.take(diagnosis(answer))
    return due


def test_it_waits_until_the_condition_has_settled():
    assert live(MismatchWatch(), 10) == [2]


def test_what_has_no_name_is_asked_ever_more_rarely():
    due = live(MismatchWatch(), 3000, answer=NAMELESS)
    apart = [after - before for before, after in itertools.pairwise(due)]
    assert apart[:3] == [RETRY, 2 * RETRY, 4 * RETRY]
    assert max(apart) == apart[-1] == LONGEST


def test_what_has_a_name_is_asked_again_when_it_has_grown_by_half():
    watch = MismatchWatch()
    assert live(watch, 50, 10.0, NAMED) == [2]
    assert live(watch, 50, 14.0, NAMED) == []
    assert live(watch, 50, 16.0, NAMED) == [0]


def test_a_finding_of_before_a_restart_goes_on():
    watch = MismatchWatch()
    watch.restore(diagnosis(NAMED), [])
    assert live(watch, 50, 10.0) == []
    assert live(watch, 50, 16.0) == [0]


def test_another_mismatch_after_the_repair_is_diagnosed_anew():
    watch = MismatchWatch()
    live(watch, 20, 10.0, NAMED)
    live(watch, GONE - 1, holds=False)
    assert watch.latest is not None
    live(watch, 1, holds=False)
    assert watch.latest is None
    assert live(watch, 10, 5.0, NAMED) == [2]


def test_a_diagnosis_that_crashed_is_tried_again_later():
    watch = MismatchWatch()
    assert live(watch, 3) == [2]
    watch.fail()
    assert live(watch, 20) == [RETRY - 1, 2 * RETRY - 1, 3 * RETRY - 1, 4 * RETRY - 1, 5 * RETRY - 1]
