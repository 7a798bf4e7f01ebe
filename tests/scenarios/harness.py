"""A real daemon in its own process, on a free port, and a simulated axis that streams to it."""

import dataclasses
import json
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import zenoh
import zenoh.ext

from plant import keys
from plant.axis_file import write_axis
from plant.presets import paper_axis, paper_friction, paper_torque
from plant.simulation import simulate
from plant.wire import Block
from plant.zenoh_session import open_session

ROOT = Path(__file__).resolve().parents[2]
SITE = "test-site"
START_NS = 1_767_225_600 * 10**9  # 2026-01-01
STEP_NS = 10_000_000


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def wait_for(condition, timeout, what):
    """Poll until `condition()` is true; its value. A deadline, not a delay."""
    end = time.monotonic() + timeout
    while time.monotonic() < end:
        if value := condition():
            return value
        time.sleep(0.02)
    raise AssertionError(f"not within {timeout} s: {what}")


class Plant:
    """A folder with configuration and axis files, and the daemon that runs on it.

    `module` is what is run: `monitor`, or a wrapper of it.
    """

    module = "monitor"

    def __init__(self, folder: Path, axes=("axis-1",), settings: str = "") -> None:
        self.folder, self.port = folder, free_port()
        self.endpoint = f"tcp/127.0.0.1:{self.port}"
        self.axis = dataclasses.replace(paper_axis(), name=axes[0])
        files = ""
        for name in axes:
            write_axis(dataclasses.replace(paper_axis(), name=name), folder / f"{name}.toml")
            files += f'[[axis]]\nfile = "{name}.toml"\n'
        page = "" if "[page]" in settings else '[page]\nlisten = ""\n'
        self.config = folder / "tribowatch.toml"
        self.config.write_text(f'site = "{SITE}"\n[zenoh]\nlisten = ["{self.endpoint}"]\n{settings}\n{page}{files}')
        self.url = f"sqlite:///{folder / 'var' / 'tribowatch.db'}"
        self.process = None
        self.starts = 0

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process is not None and self.process.poll() is None:
            self.process.kill()
            self.process.wait()

    @property
    def log(self) -> str:
        return (self.folder / f"daemon-{self.starts}.log").read_text()

    def start(self, timeout=60.0):
        """Start the daemon; return when it takes samples."""
        self.launch()
        wait_for(lambda: self._ready(), timeout, "daemon ready")
        return self

    def launch(self):
        self.starts += 1
        environment = os.environ | {"NUMBA_CACHE_DIR": str(ROOT / ".cache" / "numba")}
        with (self.folder / f"daemon-{self.starts}.log").open("wb") as log:
            self.process = subprocess.Popen(
                [sys.executable, "-m", self.module, "run", "--config", str(self.config)],
                stdout=log, stderr=subprocess.STDOUT, cwd=ROOT, env=environment, start_new_session=True,
            )  # fmt: skip

    def _ready(self):
        if self.process.poll() is not None:
            raise AssertionError(f"the daemon ended with {self.process.returncode}: {self.log}")
        return "watching" in self.log

    def try_another(self):
        """Start one more on the same configuration; its exit code and what it said."""
        environment = os.environ | {"NUMBA_CACHE_DIR": str(ROOT / ".cache" / "numba")}
        command = [sys.executable, "-m", "monitor", "run", "--config", str(self.config)]
        done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, env=environment, timeout=60)
        return done.returncode, done.stderr

    def kill(self):
        self.process.send_signal(signal.SIGKILL)
        self.process.wait(10)

    def terminate(self, number=signal.SIGTERM) -> float:
        """Ask it to stop; return the seconds it took."""
        begun = time.monotonic()
        self.process.send_signal(number)
        self.process.wait(30)
        return time.monotonic() - begun

    def session(self):
        return open_session("client", connect=[self.endpoint], timeout=20.0)


def burst(axis, growth=1.0, samples=2000, seed=0):
    """Torque [N·m] and position [m] of one test run of the paper, its friction times `growth`."""
    law = paper_friction()
    law = dataclasses.replace(law, coulomb_force=law.coulomb_force * growth, static_force=law.static_force * growth)
    torque = paper_torque(axis, samples=samples)
    position = simulate(axis, law, torque, sample_time=0.01).position
    noise = np.random.default_rng(seed).standard_normal(samples)
    return np.asarray(torque), np.round((position + 2e-5 * noise) / 1e-5) * 1e-5


def blocks_of(name, epoch, seq, start_ns, torque, position, size=100):
    """Cut a burst into blocks of the stream."""
    for first in range(0, len(torque), size):
        part = slice(first, first + size)
        stamps = start_ns + np.arange(first, first + len(torque[part])) * STEP_NS
        yield Block(name, epoch, seq + first, stamps, position[part], torque=torque[part], dt_ns=STEP_NS)


class Ear:
    """Hears what the daemon publishes of one axis."""

    def __init__(self, session, axis="axis-1"):
        self.heard = {what: [] for what in ("parameters", "model", "alerts", "status")}
        history = zenoh.ext.HistoryConfig(detect_late_publishers=True)  # a publisher's first words may come too early
        self._subscribers = [
            zenoh.ext.declare_advanced_subscriber(
                session, keys.output_key(SITE, axis, what), self._listener(what), history=history
            )
            for what in self.heard
        ]

    def _listener(self, what):
        return lambda sample: self.heard[what].append(json.loads(sample.payload.to_bytes()))

    def committed(self):
        """Last acknowledged sample, -1 before the first."""
        shown = [one["committed"]["seq"] for one in self.heard["status"] if one["committed"]]
        return max(shown, default=-1)

    def close(self):
        for subscriber in self._subscribers:
            subscriber.undeclare()
