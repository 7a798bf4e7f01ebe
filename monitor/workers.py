"""Identification in worker processes that may die, hang or be killed without harm to anything but their own window."""

from __future__ import annotations

import collections
import concurrent.futures
import contextlib
import hashlib
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass

import structlog

from monitor.estimate import Estimate
from monitor.identify_window import Job, crashed, identify_window

log = structlog.get_logger()
AGAIN, SELDOM = 1.0, 30.0  # s between attempts to start what does not start: at first, in the end


def window_seed(seed: int, axis: str, epoch: int, first_seq: int) -> int:
    """Seed of one window's search: the same whatever the number of workers and the order of the windows."""
    text = f"{seed}/{axis}/{epoch}/{first_seq}"
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:4], "big")


def local_pool(workers: int, niceness: int = 0) -> ProcessPoolExecutor:
    """`workers` processes from a fork server that has the numerics loaded and shares nothing with this process.

    `niceness` lowers their priority. [1]
    """
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["monitor.identify_window"])
    return ProcessPoolExecutor(workers, mp_context=context, initializer=_settle_in, initargs=(niceness,))


def end_pool(pool: Executor) -> None:
    """Close `pool` at once, also where its processes hang."""
    for process in dict(getattr(pool, "_processes", None) or {}).values():
        with contextlib.suppress(OSError, ValueError):
            process.kill()
    pool.shutdown(wait=False, cancel_futures=True)


def _end_fork_server() -> None:
    """Kill the process that forks the workers, whatever it is loading; who waits for a worker of it is told so."""
    from multiprocessing import forkserver

    number = getattr(getattr(forkserver, "_forkserver", None), "_forkserver_pid", None)
    if isinstance(number, int):
        with contextlib.suppress(OSError):
            os.kill(number, signal.SIGKILL)


def _warm_up() -> None:
    """Occupies a worker for a moment, so that all of them are started."""
    time.sleep(0.1)


def _settle_in(niceness: int) -> None:
    """In a worker: leave ^C and SIGTERM to the daemon, and end when the daemon is gone, however it went."""
    os.nice(niceness)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    threading.Thread(target=_follow_parent, daemon=True).start()


def _follow_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(0)


@dataclass(slots=True)
class _Attempt:
    job: Job
    tries: int = 0
    since: float = 0.0


class Workers:
    """Runs jobs on an executor; rebuilds it when it breaks, and finds out which job broke it.

    After a break the jobs that were running are suspects: each runs alone, so that a window that kills its worker
    is found and given up after `retries`, and its neighbours get their answers.
    """

    def __init__(
        self,
        workers: int,
        *,
        retries: int = 2,
        timeout: float = 300.0,
        start_pool: Callable[[int], Executor] = local_pool,
        wake: Callable[[], None] = lambda: None,
    ) -> None:
        """Start the pool. `timeout` [s]: how long a job may run; `wake` is called from another thread when one ends."""
        self._start_pool, self._workers = start_pool, workers
        self._retries, self._timeout, self._wake = retries, timeout, wake
        self._capacity = 2 * workers
        self._running: dict[Future[Estimate], _Attempt] = {}
        self._suspects: collections.deque[_Attempt] = collections.deque()
        self._failed: list[tuple[Job, Estimate]] = []
        self.restarts = 0
        self._closed = False
        self._pool: Executor | None = start_pool(workers)  # here, so that who starts us hears what is wrong
        self._ready = self._begin()

    def _begin(self) -> threading.Event:
        """Start the pool, by a thread of its own: that takes seconds, and the caller has streams to serve."""
        self._begun, ready = time.monotonic(), threading.Event()
        threading.Thread(target=self._warm, args=(ready,), name="warm-up", daemon=True).start()
        return ready

    def _warm(self, ready: threading.Event) -> None:
        pause = AGAIN
        while not self._closed and not self._up():
            time.sleep(pause)
            pause = min(2 * pause, SELDOM)
        ready.set()
        self._wake()

    def _up(self) -> bool:
        """Whether there is a pool; one that broke while it started is found when it is given work."""
        try:
            pool = self._pool = self._pool or self._start_pool(self._workers)
            concurrent.futures.wait([pool.submit(_warm_up) for _ in range(self._workers)])
        except (BrokenProcessPool, RuntimeError, EOFError) as error:  # killed while it started, or closed
            self._complain(error)
            time.sleep(AGAIN)
        except OSError as error:  # no file handles left: what there is of it is of no use
            self._complain(error)
            self._kill()
            self._pool = None
        return self._pool is not None

    def _complain(self, error: Exception) -> None:
        if not self._closed:  # closed before they were up: nothing to tell
            log.warning("worker processes did not start", error=str(error))

    @property
    def free(self) -> int:
        """Jobs that may be submitted now."""
        if self._suspects or not self._ready.is_set():
            return 0
        return max(0, self._capacity - len(self._running))

    @property
    def busy(self) -> int:
        """Jobs without an answer."""
        return len(self._running) + len(self._suspects)

    def oldest(self) -> float:
        """How long the oldest job has run, or, where none can, how long the pool has been starting. [s]"""
        now = time.monotonic()
        if not self._ready.is_set():
            return now - self._begun
        return max((now - attempt.since for attempt in self._running.values()), default=0.0)

    def submit(self, job: Job) -> None:
        """Run `job`; its answer comes out of `collect`. Blocks while the pool starts: look at `free` first."""
        self._ready.wait()
        self._launch(_Attempt(job))

    def _launch(self, attempt: _Attempt) -> None:
        attempt.tries += 1
        attempt.since = time.monotonic()
        assert self._pool is not None
        try:
            future = self._pool.submit(identify_window, attempt.job)
        except (BrokenProcessPool, OSError):  # it broke between two looks; nobody is to blame for that
            attempt.tries -= 1
            self._suspects.append(attempt)
            self._restart()
            return
        self._running[future] = attempt
        future.add_done_callback(lambda _: self._wake())

    def collect(self) -> list[tuple[Job, Estimate]]:
        """Answers since the last call; never waits."""
        answers: list[tuple[Job, Estimate]] = []
        broken = False
        for future in [future for future in self._running if future.done()]:
            attempt = self._running.pop(future)
            error = future.exception()
            if error is None:
                answers.append((attempt.job, future.result()))
            elif isinstance(error, BrokenProcessPool):
                broken = True
                self._blame(attempt)
            else:
                answers.append((attempt.job, crashed(attempt.job, f"{type(error).__name__}: {error}")))
        if broken:
            self._restart()
        self._check_hung()
        if self._suspects and not self._running and self._ready.is_set():
            self._launch(self._suspects.popleft())
        answers += self._failed
        self._failed = []
        return answers

    def _blame(self, attempt: _Attempt) -> None:
        if attempt.tries > self._retries:
            reason = f"its worker process died or hung {attempt.tries} times"
            self._failed.append((attempt.job, crashed(attempt.job, reason)))
            log.error("window given up", axis=attempt.job.axis.name, window=str(attempt.job.window.id), reason=reason)
        else:
            self._suspects.append(attempt)

    def _restart(self) -> None:
        """A broken pool takes all its jobs along."""
        for attempt in self._running.values():
            self._blame(attempt)
        self._running.clear()
        self.restarts += 1
        log.warning("worker processes restarted", times=self.restarts, suspects=len(self._suspects))
        self._kill()
        self._pool = None
        self._ready = self._begin()

    def _check_hung(self) -> None:
        now = time.monotonic()
        if any(now - attempt.since > self._timeout for attempt in self._running.values()):
            self._restart()

    def _kill(self) -> None:
        if self._pool is not None:
            end_pool(self._pool)

    def close(self) -> None:
        """Stop at once, also while the pool starts; windows without an answer are done again after a restart."""
        self._closed = True
        if not self._ready.is_set():
            _end_fork_server()  # else the pool's lock is held until its processes have loaded everything
        self._kill()
