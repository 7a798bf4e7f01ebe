"""Independent pieces of work side by side: compiled code lets other threads run.

Answers never depend on how many threads there are: every piece is computed as it would be alone, and handed back in
order. Pieces within a piece are done where they are.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from typing import TypeVar

from threadpoolctl import ThreadpoolController

Item = TypeVar("Item")
Answer = TypeVar("Answer")

_allowed: ContextVar[int] = ContextVar("threads", default=1)
_here = threading.local()


def usable_cores() -> int:
    """Processors this process may run on."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def at_most(threads: int) -> Iterator[None]:
    """Within, `side_by_side` uses so many threads, and linear algebra none besides.

    Its matrices are small: threads of its own wait for each other and take twice the time on a busy computer, and their
    number changes the last bits of a sum.
    """
    before = _allowed.set(threads)
    try:
        with _algebra().limit(limits=1, user_api="blas"):
            yield
    finally:
        _allowed.reset(before)


def allowed() -> int:
    """Pieces that run at once here; 1 within a piece."""
    return 1 if getattr(_here, "busy", False) else _allowed.get()


def side_by_side(work: Callable[[Item], Answer], items: Iterable[Item]) -> Iterator[Answer]:
    """`work` on each of `items`, in their order. What has not begun when the caller stops asking is never done."""
    todo = list(items)
    threads = allowed()
    if threads < 2 or len(todo) < 2:
        yield from map(work, todo)
        return

    def alone(item: Item) -> Answer:
        _here.busy = True
        return work(item)

    pool = _pool(threads, os.getpid())
    running = [pool.submit(alone, item) for item in todo]
    try:
        for one in running:
            yield one.result()
    finally:
        for one in running:
            one.cancel()


@cache
def _algebra() -> ThreadpoolController:
    """The libraries of linear algebra that NumPy and SciPy have loaded."""
    return ThreadpoolController()


@cache
def _pool(threads: int, process: int) -> ThreadPoolExecutor:  # noqa: ARG001
    """So many threads, kept for the next time; a forked process has none of its parent's."""
    return ThreadPoolExecutor(threads, thread_name_prefix="side-by-side")
