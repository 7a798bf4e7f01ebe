"""`python -m monitor.leash ARGUMENTS`: the command `tribowatch ARGUMENTS`, on a leash held by the parent process.

The parent keeps the other end of standard input open. When it closes, because the parent ended in whatever way (also
kill -9), the command gets SIGTERM, and is ended hard if it has not stopped by itself after the grace.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import IO

GRACE = 8.0  # s; the daemon promises to drain within 5


def start_leashed(arguments: list[str], log: IO[bytes], folder: Path) -> subprocess.Popen[bytes]:
    """Start `tribowatch ARGUMENTS` in `folder`; stdout and stderr go to `log`. ^C in our terminal does not reach it."""
    return subprocess.Popen(
        [sys.executable, "-m", "monitor.leash", *arguments],
        stdin=subprocess.PIPE,
        stdout=log,
        stderr=subprocess.STDOUT,
        cwd=folder,
        start_new_session=True,
    )


def stop_leashed(child: subprocess.Popen[bytes]) -> int:
    """Let go of the leash and wait; gives the exit code. Harmless when the child is gone already."""
    if child.stdin is not None:
        child.stdin.close()
    try:
        return child.wait(GRACE + 4.0)
    except subprocess.TimeoutExpired:
        child.kill()
        return child.wait()


def _follow_parent() -> None:
    """Wait until the parent lets go, then stop this process."""
    while os.read(0, 4096):
        pass
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(GRACE)
    os._exit(143)


def _run() -> None:
    threading.Thread(target=_follow_parent, name="leash", daemon=True).start()
    from monitor.cli import main

    main(sys.argv[1:])


if __name__ == "__main__":
    _run()
