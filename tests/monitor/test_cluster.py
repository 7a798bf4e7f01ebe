"""The same answers from a Dask cluster: a real scheduler and real worker processes, one of them killed at work."""

import contextlib
import os
import signal
import subprocess
import sys
import time

import pytest

from identify.many import identify_many
from monitor.cluster_dask import DaskPool
from monitor.identify_window import identify_window, recording_of
from monitor.workers import Workers
from tests.monitor.test_workers import AXIS, answers, job
from tests.scenarios.harness import ROOT, free_port, wait_for

pytest.importorskip("distributed", reason="comes with the cluster extra")
ENVIRONMENT = os.environ | {"OMP_NUM_THREADS": "1", "DASK_DISTRIBUTED__WORKER__DAEMON": "false"}


class Cluster:
    """A scheduler and workers on loopback."""

    def __init__(self, folder):
        self.folder, self.address = folder, f"tcp://127.0.0.1:{free_port()}"
        self.scheduler = self._start("scheduler", "--port", self.address.rsplit(":", 1)[1], "--no-dashboard")
        self.workers = [self.add_worker() for _ in range(2)]
        wait_for(lambda: self.log("scheduler").count("Register worker") >= 2, 90, "two workers")

    def _start(self, *words):
        with (self.folder / f"{words[0]}.log").open("ab") as log:
            command = [sys.executable, "-m", "dask", words[0], *words[1:], "--host", "127.0.0.1"]
            return subprocess.Popen(command, stdout=log, stderr=log, cwd=ROOT, env=ENVIRONMENT)

    def add_worker(self):
        return self._start(
            "worker", self.address, "--nthreads", "1", "--no-nanny", "--no-dashboard",
            "--local-directory", str(self.folder),
        )  # fmt: skip

    def log(self, name):
        return (self.folder / f"{name}.log").read_text()

    def close(self):
        for process in (*self.workers, self.scheduler):
            with contextlib.suppress(ProcessLookupError):
                process.kill()
            process.wait(20)


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    made = Cluster(tmp_path_factory.mktemp("dask"))
    yield made
    made.close()


def test_the_cluster_gives_the_answers_of_this_process_and_survives_a_worker(cluster):
    jobs = [job(first_seq=500 * k) for k in range(6)]
    here = {one.row: identify_window(one) for one in jobs}
    workers = Workers(2, start_pool=lambda _: DaskPool(cluster.address))
    try:
        for one in jobs:
            workers.submit(one)
        cluster.workers[0].send_signal(signal.SIGKILL)  # whatever it was doing is done again elsewhere
        there = answers(workers, len(jobs), timeout=120)
    finally:
        workers.close()
    assert workers.restarts == 0, "a worker's death is the cluster's affair"
    for row, estimate in there.items():
        assert estimate.verdict == here[row].verdict
        assert [p.value for p in estimate.parameters] == [p.value for p in here[row].parameters]
        assert estimate.criterion == here[row].criterion


def test_many_windows_over_the_cluster_are_the_same_bit_by_bit(cluster):
    recordings = [recording_of(job(first_seq=500 * k).samples, AXIS) for k in range(4)]
    with DaskPool(cluster.address) as pool:
        there = identify_many(recordings, AXIS, executor=pool, seeds=7, chunk=2)
    assert [one.to_dict() for one in there] == [one.to_dict() for one in identify_many(recordings, AXIS, seeds=7)]


@pytest.mark.slow
def test_a_scheduler_that_comes_back_is_used_again(tmp_path):
    (tmp_path / "one").mkdir()
    cluster = Cluster(tmp_path / "one")
    port = cluster.address.rsplit(":", 1)[1]
    workers = Workers(2, start_pool=lambda _: DaskPool(cluster.address))
    try:
        workers.submit(job(first_seq=0))
        answers(workers, 1)
        cluster.close()
        workers.submit(job(first_seq=500))
        wait_for(lambda: workers.collect() or workers.restarts, 60, "the loss is noticed")
        (tmp_path / "two").mkdir()
        again = Cluster.__new__(Cluster)
        again.folder, again.address = tmp_path / "two", cluster.address
        again.scheduler = again._start("scheduler", "--port", port, "--no-dashboard")
        again.workers = [again.add_worker()]
        cluster = again
        assert 500 in answers(workers, 1, timeout=120)
    finally:
        workers.close()
        cluster.close()


def test_no_scheduler_is_said_and_the_daemon_goes_on(capfd):
    started = time.monotonic()
    workers = Workers(1, start_pool=lambda _: DaskPool(f"tcp://127.0.0.1:{free_port()}"))
    wait_for(lambda: workers.free, 60, "the attempt ends")
    workers.close()
    assert time.monotonic() - started < 60
    assert "no Dask scheduler" in "".join(capfd.readouterr())
