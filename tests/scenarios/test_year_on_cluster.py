"""A year of history identified again on a Dask cluster: progress, speed-up, a worker killed in the midst of it."""

import contextlib
import json
import os
import re
import signal
import sqlite3
import subprocess
import sys
import time

import pytest

from monitor.workers import Workers
from tests.monitor.test_cluster import Cluster
from tests.monitor.test_pipeline import AXIS, Bench
from tests.scenarios.harness import ROOT, START_NS, blocks_of, burst, wait_for

pytest.importorskip("distributed", reason="comes with the cluster extra")
DAYS, SAMPLES, DAY_NS = 365, 1000, 86_400 * 10**9


def year(folder):
    """A history with a window a day of a healthy axis, identified on this machine."""
    workers = Workers(2)
    bench = Bench(folder, workers, window={"samples": SAMPLES, "hop": SAMPLES}, history={"keep_raw_windows": DAYS + 1})
    for day in range(DAYS):
        torque, position = burst(AXIS, samples=SAMPLES, seed=day)
        for block in blocks_of("axis-1", 1, SAMPLES * day, START_NS + day * DAY_NS, torque, position, size=SAMPLES):
            bench.put(block)
        bench.step(0.5)
    bench.finish()
    bench.store.close()
    workers.close()
    return folder


class Again:
    """`tribowatch history reanalyse` at work on a cluster."""

    def __init__(self, state, into, cluster):
        self.into, self.begun = into, time.monotonic()
        words = ["history", "reanalyse", "--into", str(into), "--state-dir", str(state), "--json"]
        self.process = subprocess.Popen(
            [sys.executable, "-m", "monitor", *words, "--scheduler", cluster.address], cwd=ROOT, text=True,
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=os.environ | {"OMP_NUM_THREADS": "1"},
        )  # fmt: skip

    def done(self):
        """Answers so far."""
        path = self.into / "tribowatch.db"
        try:
            with contextlib.closing(sqlite3.connect(f"file:{path}?mode=ro", uri=True)) as db:
                return db.execute("select count(*) from estimate").fetchone()[0]
        except sqlite3.OperationalError:  # not made yet
            return 0

    def end(self):
        """What it said: figures, lines of progress; and the seconds it took."""
        out, err = self.process.communicate(timeout=1200)
        assert self.process.returncode == 0, err
        return json.loads(out), err, time.monotonic() - self.begun


@pytest.mark.slow
def test_a_year_is_identified_again_on_a_cluster_that_loses_a_worker(tmp_path):
    for name in ("state", "dask"):
        (tmp_path / name).mkdir()
    state = year(tmp_path / "state")
    cluster = Cluster(tmp_path / "dask")
    try:
        both, _, two = Again(state, tmp_path / "two", cluster).end()
        run = Again(state, tmp_path / "killed", cluster)
        wait_for(lambda: run.done() >= DAYS // 4, 600, "a quarter of it")
        cluster.workers[0].send_signal(signal.SIGKILL)
        killed, said, _ = run.end()
        alone, _, one = Again(state, tmp_path / "one", cluster).end()
    finally:
        cluster.close()
    for found in (both, killed, alone):
        assert (found["windows"], found["same"], found["fresh"]) == (DAYS, DAYS, DAYS), "bit by bit as on this machine"
    assert re.search(rf"\d+ of {DAYS}", said), said
    print(f"\n{DAYS} windows: two workers {two:.1f} s, one {one:.1f} s ({one / two:.2f} times as long)")
