"""Zenoh's refusals in our log: its own log, which it can only write to stdout, is caught there and read.

A pipe takes the place of stdout, which the daemon does not use; what is no word of Zenoh's is passed on. Zenoh never
waits for us: what does not fit into the pipe is dropped.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import re
import threading
import time

import structlog
import zenoh

from monitor.refusals import WORDS, Refusal, Refusals

log = structlog.get_logger()
STDOUT = 1
ROOM = 1 << 20  # bytes in the pipe: some thousand lines
_PASSED = re.compile(rb"Using cached result: \w+ is authorized")  # most of all lines: every block that comes in
PAUSE = 0.2  # s between two looks: a look for every line would cost more than the lines


class RefusalLog:
    """Logs every link and message that Zenoh refuses. One per process, before its session is opened."""

    def __init__(self) -> None:
        """Take the place of stdout."""
        self._refusals, self._rest = Refusals(), b""
        self._stdout = os.dup(STDOUT)
        self._end, entrance = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
        fcntl.fcntl(entrance, fcntl.F_SETPIPE_SZ, ROOM)
        os.dup2(entrance, STDOUT)
        os.close(entrance)
        zenoh.init_log_from_env_or(WORDS)
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._listen, name="refusals", daemon=True)
        self._thread.start()

    def _listen(self) -> None:
        while not self._closing.wait(PAUSE):
            self._look()

    def _look(self) -> None:
        """Read what has come; never waits."""
        parts = [self._rest]
        with contextlib.suppress(BlockingIOError):
            while part := os.read(self._end, ROOM):
                parts.append(part)
        *lines, self._rest = b"".join(parts).split(b"\n")
        for line in lines:
            if b"ThreadId(" not in line:
                os.write(self._stdout, line + b"\n")
            elif not _PASSED.search(line):
                self._tell(self._refusals.read(line.decode(errors="replace"), time.monotonic()))

    @staticmethod
    def _tell(found: Refusal | None) -> None:
        if found is not None:
            log.warning(found.event, **found.fields)

    def close(self) -> None:
        """Give stdout back, tell what is still in the pipe."""
        self._closing.set()
        self._thread.join()
        os.dup2(self._stdout, STDOUT)
        self._look()
        os.close(self._stdout)
        os.close(self._end)
