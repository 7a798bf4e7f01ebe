"""Identification in worker processes: same answers everywhere, and one window's death is nobody else's."""

import dataclasses
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from identify.identification import identify_friction
from monitor.axis_run import travelling
from monitor.identify_window import Job, identify_window, recording_of
from monitor.samples import Samples, Window, WindowId
from monitor.workers import Workers, window_seed
from plant.presets import paper_axis
from tests.monitor.poison import HANGING, LETHAL, PoisonPool
from tests.scenarios.harness import ROOT, START_NS, STEP_NS, burst, wait_for

AXIS = travelling(dataclasses.replace(paper_axis(), name="axis-1"))


def job(first_seq=0, samples=400, **changes):
    torque, position = burst(AXIS, samples=samples)
    stamps = START_NS + np.arange(samples) * STEP_NS
    part = Samples(1, first_seq, stamps, torque, position, **changes)
    window = Window(WindowId(1, first_seq, samples), int(stamps[0]), int(stamps[-1]))
    return Job(first_seq, AXIS, window, part, window_seed(0, "axis-1", 1, first_seq), "ga+polish")


def answers(workers, number, timeout=90.0):
    got = []
    wait_for(lambda: got.extend(workers.collect()) or len(got) >= number, timeout, f"{number} answers")
    return {one.row: estimate for one, estimate in got}


@pytest.fixture
def pool():
    made = []

    def make(*arguments, **settings):
        made.append(Workers(*arguments, **settings))
        return made[-1]

    yield make
    for one in made:
        one.close()


def test_an_estimate_is_what_identify_says():
    one = job(samples=2000)
    estimate = identify_window(one)
    result = identify_friction(recording_of(one.samples, AXIS), AXIS, seed=one.seed)
    assert estimate.verdict == "identified"
    assert {p.name: p.value for p in estimate.parameters} == {n: p.value for n, p in result.parameters.items()}
    assert estimate.data_sha256 == recording_of(one.samples, AXIS).sha256()
    values, half = result.curve_at(estimate.curve.speeds)
    assert np.allclose(estimate.curve.values, values)
    assert np.allclose(np.array(estimate.curve.high) - np.array(estimate.curve.low), 2 * half)
    json.dumps(estimate.result, allow_nan=False)


def test_a_process_gives_the_same_answer_bit_by_bit(pool):
    here = identify_window(job(5))
    workers = pool(2)
    workers.submit(job(5))
    there = answers(workers, 1)[5]
    assert dataclasses.replace(there, seconds=0) == dataclasses.replace(here, seconds=0)


def test_torque_becomes_force_at_the_belt_and_force_stays():
    one = job()
    as_torque, as_force = (recording_of(dataclasses.replace(one.samples, is_force=f), AXIS) for f in (False, True))
    assert np.allclose(as_torque.force, one.samples.drive * AXIS.mechanics.gain)
    assert np.array_equal(as_force.force, one.samples.drive)


def test_unusable_samples_are_bad_data_with_a_reason():
    one = job()
    estimate = identify_window(
        dataclasses.replace(one, samples=dataclasses.replace(one.samples, position=np.full(400, np.nan)))
    )
    assert estimate.verdict == "bad_data"
    assert estimate.reason
    assert not estimate.informative
    json.dumps([estimate.result, estimate.conditions], allow_nan=False)


def test_conditions_are_kept_for_later_corrections():
    estimate = identify_window(job(temperature=np.full(400, 31.5), load=np.full(400, np.nan)))
    assert estimate.conditions["temperature"] == 31.5
    assert "load" not in estimate.conditions
    assert estimate.conditions["travel"] > 0


def test_a_seed_belongs_to_its_window():
    seeds = {window_seed(s, a, e, f) for s in (0, 1) for a in ("a", "b") for e in (1, 2) for f in (0, 500)}
    assert len(seeds) == 16
    assert window_seed(0, "a", 1, 0) == window_seed(0, "a", 1, 0)


def test_a_window_that_kills_its_worker_is_given_up_and_its_neighbours_are_answered(pool):
    workers = pool(2, retries=1, start_pool=PoisonPool)
    for first in (1, LETHAL, 2, 3):
        workers.submit(job(first))
    got = answers(workers, 4)
    assert got[LETHAL].verdict == "bad_data"
    assert "died or hung 2 times" in got[LETHAL].reason
    assert "crashed" not in "".join(got[first].reason or "" for first in (1, 2, 3))
    assert workers.restarts >= 2
    assert workers.busy == 0


def test_a_worker_that_hangs_is_replaced(pool):
    workers = pool(1, retries=0, timeout=20.0, start_pool=PoisonPool)
    workers.submit(job(1))  # loads the numerics
    answers(workers, 1)
    workers = pool(1, retries=0, timeout=3.0, start_pool=PoisonPool)
    workers.submit(job(HANGING))
    assert "hung" in answers(workers, 1)[HANGING].reason


def test_a_worker_killed_from_outside_costs_nothing_but_time(pool):
    workers = pool(1, retries=2)
    workers.submit(job(1))
    wait_for(lambda: workers._pool._processes, 30, "a worker process")
    os.kill(next(iter(workers._pool._processes)), signal.SIGKILL)
    assert "crashed" not in (answers(workers, 1)[1].reason or "")


def test_workers_end_when_the_daemon_is_killed():
    program = (
        "import sys\nfrom monitor.workers import Workers\nfrom tests.monitor.test_workers import job\n"
        "if __name__ == '__main__':\n"
        "    workers = Workers(1)\n    workers.submit(job(1))\n"
        "    while not workers.collect():\n        pass\n"
        "    print(next(iter(workers._pool._processes)), flush=True)\n    sys.stdin.read()\n"
    )
    parent = subprocess.Popen(
        [sys.executable, "-c", program], cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        env=os.environ | {"NUMBA_CACHE_DIR": str(ROOT / ".cache" / "numba")},
    )  # fmt: skip
    with parent:
        worker = int(parent.stdout.readline())
        assert _runs(worker)
        parent.kill()
        wait_for(lambda: not _runs(worker), 20, "the worker's end")


def _runs(pid):
    try:
        stat = Path(f"/proc/{pid}/stat").read_text()
    except OSError:
        return False
    return stat.rsplit(")", 1)[1].split()[0] not in ("Z", "X")


def test_waiting_never_blocks(pool):
    workers = pool(1)
    workers.submit(job(1))
    begun = time.monotonic()
    assert workers.collect() == []
    assert time.monotonic() - begun < 1.0
    answers(workers, 1)
