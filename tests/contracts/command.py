"""Run the command as a user would, in a process of its own."""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

AXIS = """\
name = "axis-0001"
[mechanics]
M = 20.0
J = 0.012
Rc = 0.045
Rm = 0.0143
travel = [0.0, 2.0]
[drive]
rated_torque = 8.0
[stream]
sample_time = 0.01
torque = "held over the sample"
"""


def tribowatch(*arguments, cwd=ROOT, timeout=120, **environment):
    """Run `tribowatch ARGUMENTS` to its end; gives the completed process with text output."""
    return subprocess.run(
        [sys.executable, "-m", "monitor", *map(str, arguments)],
        capture_output=True,
        text=True,
        cwd=cwd,
        timeout=timeout,
        stdin=subprocess.DEVNULL,
        env=os.environ | environment | {"PYTHONPATH": str(ROOT)},
    )


def complaint(done, code: int) -> str:
    """The one clear line on stderr of a command that failed with `code` and left stdout empty."""
    assert done.returncode == code, (done.returncode, done.stdout, done.stderr)
    assert done.stdout == ""
    lines = done.stderr.splitlines()
    assert len(lines) == 1, done.stderr
    assert "Traceback" not in done.stderr
    return lines[0]


def write(path: Path, text: str) -> Path:
    """Write `text` to `path`, making its folder."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return path


def write_configuration(folder: Path, extra: str = "", listen: str = "", axis: str = AXIS) -> Path:
    """A configuration with one axis in `folder`; listens on a unix socket unless told otherwise."""
    write(folder / "axis.toml", axis)
    listen = listen or f"unixsock-stream/{folder / 'z.sock'}"
    text = f'site = "test"\nstate_dir = "var"\n{extra}\n[zenoh]\nlisten = ["{listen}"]\n[[axis]]\nfile = "axis.toml"\n'
    return write(folder / "tribowatch.toml", text)
