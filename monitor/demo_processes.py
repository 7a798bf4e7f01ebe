"""The two processes of the demo: a daemon with a configuration of its own, and a simulated machine. Does I/O.

Both are on a leash (`monitor/leash.py`): when this process ends, in whatever way, they end too.
"""

from __future__ import annotations

import contextlib
import fcntl
import shutil
import socket
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from monitor.errors import AlreadyRunningError
from monitor.leash import start_leashed, stop_leashed
from plant.axis_file import write_axis
from plant.errors import InputError, ReachError
from plant.scenario_file import read_scenario

SITE = "demo"
CONFIG, MARK, PREVIOUS, DATABASE = "tribowatch.toml", ".tribowatch-demo", "previous", "tribowatch.db"
PAGE_PORT = 8447  # of `[page] listen` unless the configuration says otherwise
AHEAD = 4  # bursts without an answer: two days; enough for every worker, and page and terminal show the same date
TAIL = 3  # lines of a log that say why a process ended


@dataclass(frozen=True, slots=True)
class Place:
    """Where the demo lives and what it plays.

    Attributes:
        folder: configuration, database and logs.
        scenario: name or file.
        seed: of the scenario's chance and of the searches.
        speed: event seconds per second. [1]
    """

    folder: Path
    scenario: str
    seed: int
    speed: float

    @contextlib.contextmanager
    def owned(self) -> Iterator[None]:
        """Hold the folder: one demo each.

        Raises:
            InputError: the folder cannot be written, or holds a history that is not a demo's.
            AlreadyRunningError: another demo holds it.
        """
        folder, mark = self.folder, self.folder / MARK
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if (folder / DATABASE).exists() and not mark.exists():
                raise InputError(f"{folder} holds the history of a real daemon; give the demo another --state-dir")
            handle = mark.open("a")
        except OSError as error:
            raise _cannot_write(error, folder) from None
        with handle:
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                raise AlreadyRunningError(f"{folder}: another demo runs here; give this one a --state-dir") from None
            yield


class Child:
    """A leashed `tribowatch` command with its log; ended on leaving."""

    def __init__(self, name: str, arguments: list[str], folder: Path) -> None:
        """Start it."""
        self.name, self.log = name, folder / f"{name}.log"
        with self.log.open("wb") as log:
            self._process = self._start(arguments, log, folder)

    @staticmethod
    def _start(arguments: list[str], log: IO[bytes], folder: Path) -> subprocess.Popen[bytes]:
        return start_leashed(arguments, log, folder)

    @property
    def ended(self) -> int | None:
        """Exit code, None while it runs."""
        return self._process.poll()

    @property
    def pid(self) -> int:
        """Its process id."""
        return self._process.pid

    def stop(self) -> int:
        """End it and wait."""
        return stop_leashed(self._process)

    def check(self) -> None:
        """Complain if it has ended with an error.

        Raises:
            ReachError: with the last words of its log.
        """
        if self.ended not in (None, 0):
            lines = self.log.read_text(errors="replace").strip().splitlines()[-TAIL:]
            said = " / ".join(lines) or "it said nothing"
            raise ReachError(f"the {self.name} of the demo ended with code {self.ended}: {said} (log: {self.log})")


def prepare_folder(place: Place, port: int, page: int) -> Path:
    """Write axis file and configuration; an earlier demo's history moves to `previous/`. Gives the configuration.

    Raises:
        InputError: the folder cannot be written.
    """
    folder = place.folder
    try:
        _set_aside(folder)
        axis = read_scenario(place.scenario).axis
        write_axis(axis, folder / f"{axis.name}.toml")
        config = folder / CONFIG
        config.write_text(_configuration(axis.name, port, page, place.seed), encoding="utf-8")
    except OSError as error:
        raise _cannot_write(error, folder) from None
    return config


def _cannot_write(error: OSError, folder: Path) -> InputError:
    where = error.filename or folder
    return InputError(f"{where}: cannot be written ({error.strerror}); give the demo another --state-dir")


def free_port() -> int:
    """A TCP port of the loopback interface that nobody uses now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def page_port() -> int:
    """The page's usual port where nobody uses it, else 0: any free one."""
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", PAGE_PORT))
        except OSError:
            return 0
    return PAGE_PORT


def endpoint(port: int) -> str:
    """Where the daemon of the demo listens."""
    return f"tcp/127.0.0.1:{port}"


@contextlib.contextmanager
def daemon(config: Path) -> Iterator[Child]:
    """The daemon, ended on leaving."""
    with running(Child("daemon", ["run", "--config", config.name], config.parent)) as child:
        yield child


@contextlib.contextmanager
def machine(place: Place, port: int) -> Iterator[Child]:
    """The simulated machine that publishes the scenario, ended on leaving."""
    scenario = place.scenario
    path = Path(scenario).resolve()
    arguments = ["simulate", "--publish", "--scenario", str(path) if path.is_file() else scenario]
    arguments += ["--connect", endpoint(port), "--site", SITE, "--seed", str(place.seed)]
    arguments += ["--speed", repr(place.speed), "--ahead", str(AHEAD)]
    with running(Child("machine", arguments, place.folder)) as child:
        yield child


@contextlib.contextmanager
def running(child: Child) -> Iterator[Child]:
    """Stop `child` on leaving."""
    try:
        yield child
    finally:
        child.stop()


def _set_aside(folder: Path) -> None:
    """Move an earlier history out of the way: the scenario starts anew, and time does not run backwards."""
    shutil.rmtree(folder / PREVIOUS, ignore_errors=True)
    old = [path for path in folder.iterdir() if path.name.startswith(DATABASE) or path.suffix in (".log", ".url")]
    if old:
        (folder / PREVIOUS).mkdir()
    for path in old:
        path.rename(folder / PREVIOUS / path.name)


def _configuration(axis: str, port: int, page: int, seed: int) -> str:
    """What the daemon of the demo is told; everything else is default."""
    return f"""\
# written by tribowatch demo
site = "{SITE}"
state_dir = "."
seed = {seed}

[zenoh]
listen = ["{endpoint(port)}"]

[page]
listen = "127.0.0.1:{page}"

[[axis]]
file = "{axis}.toml"
"""
