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
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
COMMAND = ("-m", "monitor", "diagnose", "--axis", "axis.toml", "--json")
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
    """The answer of the command to a case: exit code (None: stopped at `limit` [s]), JSON, seconds, seconds of CPU."""
    environment = {name: os.environ[name] for name in PASSED if name in os.environ}
    environment["PYTHONPATH"] = str(ROOT)
    with tempfile.TemporaryDirectory(prefix="blind-") as lonely:
        folder = Path(lonely) / "case"
        shutil.copytree(case, folder)
        before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
        code, out, err = _run(folder, environment, limit)
        seconds, after = time.monotonic() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime  # of all children: exact with one job
    answer = None
    if code == 0:
        with contextlib.suppress(json.JSONDecodeError):
            answer = json.loads(out)
    return {"exit": code, "answer": answer, "stderr": err[-2000:], "seconds": seconds, "cpu": cpu}


def _run(folder: Path, environment: dict[str, str], limit: float) -> tuple[int | None, str, str]:
    try:
        done = subprocess.run(
            [sys.executable, *COMMAND], cwd=folder, env=environment, timeout=limit, capture_output=True, text=True,
            check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return None, "", f"stopped after {limit:g} s"
    return done.returncode, done.stdout, done.stderr
