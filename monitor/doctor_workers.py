"""What `tribowatch doctor` looks at: whether worker processes, here or on the cluster, start and identify."""

from __future__ import annotations

import time
from concurrent.futures import Executor
from typing import TYPE_CHECKING

from plant.errors import TribowatchError

if TYPE_CHECKING:
    from monitor.config import Config
    from monitor.doctor import Check

PATIENCE = 90.0  # s for a process to start, compile where nothing is compiled yet, and identify one recording


def check_workers(config: Config) -> Check:
    """Have one worker process identify a recording of ours, as the daemon's do with windows."""
    from monitor.doctor import Check, Outcome
    from monitor.workers import end_pool

    begun, where = time.monotonic(), "a worker process"
    try:
        pool, where = _pool(config)
        try:
            seconds = _work(pool)
        finally:
            end_pool(pool)
    except TribowatchError as error:
        return Check("workers", Outcome.OUT_OF_REACH, str(error))
    except Exception as error:  # whatever a process may die of
        reason = str(error) or f"no answer within {PATIENCE:g} s"
        return Check("workers", Outcome.OUT_OF_REACH, f"{where} did not identify a recording: {reason}; see the log")
    whole = time.monotonic() - begun
    return Check("workers", Outcome.OK, f"{where} identified a recording in {seconds:.1f} s, {whole:.1f} s with start")


def _pool(config: Config) -> tuple[Executor, str]:
    """One worker of the kind that the configuration chooses, and its name."""
    from monitor.service_parts import pool_of
    from monitor.workers import local_pool

    if not config.identification.cluster:
        return local_pool(1), "a worker process"
    from monitor.cluster_dask import DaskPool

    pool = pool_of(config)(1)
    assert isinstance(pool, DaskPool)
    return pool, f"one of {pool.reach()} workers of the cluster"


def _work(pool: Executor) -> float:
    from monitor.warm import warm

    return pool.submit(warm).result(PATIENCE)
