"""Ask the command for a diagnosis, in a process that gets a copy of the case folder and nothing else.

The copy lies in a temporary folder that leads nowhere near the labels; neither arguments nor environment name them, and
their folder has no permissions while the diagnosis runs (which stops everybody but root).
"""

from __future__ import annotations

import contextlib
import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

ROOT = Path(__file__).parents[2]
COMMAND = ("-m", "monitor", "diagnose", "--axis", "axis.toml", "--threads", "1", "--json")
RIVALS = ("-W", "ignore", "-m", "tests.blind.rivals", ".")
POLL = 0.05  # s
PATIENCE = 10.0  # times the limit of CPU, by the clock
PASSED = ("PATH", "HOME", "LANG", "NUMBA_CACHE_DIR", "OMP_NUM_THREADS")


@contextlib.contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Take all permissions from `folder` meanwhile."""
    mode = folder.stat().st_mode & 0o777
    folder.chmod(0o000)
    try:
        yield
    finally:
        folder.chmod(mode)


def ask(case: Path, limit: float) -> dict:
    """The answer of the command to a case: exit code (None: stopped at `limit` [s] of CPU), JSON, what it cost. [s]"""
    done = _alone(case, COMMAND, limit)
    return {**done, "answer": done.pop("printed")}


def ask_rivals(case: Path, limit: float) -> dict:
    """What the rival methods say about a case, from a process that is as blind."""
    done = _alone(case, RIVALS, limit)
    return {**done, "rivals": done.pop("printed")}


def _alone(case: Path, command: Sequence[str], limit: float) -> dict:
    """Run a command of Python in a copy of the case folder and nothing else; its exit, its JSON, and what it cost."""
    environment = {name: os.environ[name] for name in PASSED if name in os.environ}
    environment["PYTHONPATH"] = str(ROOT)
    with tempfile.TemporaryDirectory(prefix="blind-") as lonely:
        folder = Path(lonely) / "case"
        shutil.copytree(case, folder)
        out, err = Path(lonely) / "out", Path(lonely) / "err"
        start = time.monotonic()
        with out.open("w") as said, err.open("w") as told:
            child = subprocess.Popen([sys.executable, *command], cwd=folder, env=environment, stdout=said, stderr=told)
            code, usage = _ended(child, limit)
        seconds = time.monotonic() - start
        printed = None
        if code == 0:
            with contextlib.suppress(json.JSONDecodeError):
                printed = json.loads(out.read_text())
        reason = (
            err.read_text()[-2000:]
            if code is not None
            else f"stopped after {limit:g} s of CPU or {PATIENCE * limit:g} s"
        )
    cpu = usage.ru_utime + usage.ru_stime
    return {"exit": code, "printed": printed, "stderr": reason, "seconds": seconds, "cpu": cpu}


def _ended(child: subprocess.Popen[bytes], limit: float) -> tuple[int | None, resource.struct_rusage]:
    """Exit code and cost of a child of ours; None where it had to be stopped.

    The limit is one of CPU, so that a busy computer stops nobody; ten times as long by the clock ends it anyway.
    """
    stopped, until = False, time.monotonic() + PATIENCE * limit
    while True:
        pid, status, usage = os.wait4(child.pid, os.WNOHANG)
        if pid:
            child.returncode = os.waitstatus_to_exitcode(status)
            return None if stopped else child.returncode, usage
        if not stopped and (time.monotonic() > until or _spent(child.pid) > limit):
            child.kill()
            stopped = True
        time.sleep(POLL)


def _spent(pid: int) -> float:
    """CPU that a process has taken, where the system says so. [s]"""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
