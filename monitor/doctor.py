"""What `tribowatch doctor` looks at: installation, disk, clock, files, database, workers, links, matching. Does I/O.

Every check is one function that gives one `Check`; none raises for what it was asked to find out.
"""

from __future__ import annotations

import enum
import os
import shutil
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING

from monitor.doctor_workers import check_workers
from plant.errors import InputError, TribowatchError

if TYPE_CHECKING:
    from monitor.config import Config
    from plant.axis import Axis

LITTLE_DISK = 1 << 30  # bytes; a fleet of 20 axes writes about that much in a year of hourly windows
PROGRAM_WRITTEN = 1_760_000_000  # s since 1970: a clock before this is wrong
LINK_TIMEOUT = 1.5  # s
LIBRARIES = ("numpy", "scipy", "numba", "eclipse-zenoh", "sqlalchemy", "cbor2")


class Outcome(enum.StrEnum):
    """How a check went; `BAD_INPUT` and `OUT_OF_REACH` decide the exit code."""

    OK = "ok"
    WARNING = "warning"
    BAD_INPUT = "bad_input"
    OUT_OF_REACH = "out_of_reach"


@dataclass(frozen=True, slots=True)
class Check:
    """One thing looked at: what, how it went, the finding in words and numbers with what to do about it."""

    name: str
    outcome: Outcome
    finding: str


def examine(config: Config | None, bridge: Path | None = None) -> Iterator[Check]:
    """Run the checks one by one; those of a service need its configuration, those of a bridge its file."""
    yield check_python()
    yield check_kernels()
    yield check_clock()
    folder = config.state_dir if config else Path("var")
    yield check_disk(folder)
    if config is not None:
        yield from check_daemon(config)
    if bridge is not None:
        from monitor.doctor_bridge import check_bridge

        yield from check_bridge(bridge)


def check_daemon(config: Config) -> Iterator[Check]:
    """What a daemon needs, and whether it is at work."""
    from monitor.config import read_axes

    axes: dict[str, Axis] = {}
    try:
        axes = read_axes(config)
    except InputError as error:
        yield Check("axis files", Outcome.BAD_INPUT, str(error))
    else:
        yield Check("axis files", Outcome.OK if axes else Outcome.WARNING, _name_axes(axes))
    yield check_database(config.database_url)
    yield check_workers(config)
    yield from check_links(config, axes)


def check_python() -> Check:
    """Versions, so that a report of a fault carries them."""
    versions = ", ".join(f"{name} {metadata.version(name)}" for name in LIBRARIES)
    return Check(
        "installation", Outcome.OK, f"Python {sys.version.split()[0]}, {os.cpu_count()} processors; {versions}"
    )


def check_kernels() -> Check:
    """Whether compiled kernels can be kept, and how long the first call takes."""
    from monitor.warm import warm

    folder = os.environ.get("NUMBA_CACHE_DIR", "")
    seconds = warm()
    if folder and os.access(folder, os.W_OK):
        return Check("compiled kernels", Outcome.OK, f"ready in {seconds:.1f} s, kept in {folder}")
    finding = f"ready in {seconds:.1f} s, but {folder or 'the cache'} cannot be written; every start compiles anew"
    return Check("compiled kernels", Outcome.WARNING, finding)


def check_clock() -> Check:
    """The wall clock serves staleness and logs; samples carry their own time."""
    now = time.time()
    shown = time.strftime("%Y-%m-%d %H:%M:%SZ", time.gmtime(now))
    if now < PROGRAM_WRITTEN:
        return Check("clock", Outcome.WARNING, f"{shown} is in the past of this program; set the clock (NTP)")
    return Check("clock", Outcome.OK, f"{shown}, steps of {time.get_clock_info('time').resolution:.0e} s")


def check_disk(folder: Path) -> Check:
    """Room and permission for the state directory, or for making it."""
    there = folder
    while not there.exists():
        there = there.parent
    if not there.is_dir():
        return Check("disk", Outcome.OUT_OF_REACH, f"{there} is not a folder; set state_dir to one")
    if not os.access(there, os.W_OK):
        return Check("disk", Outcome.OUT_OF_REACH, f"{there} cannot be written by this user; change its owner")
    free = shutil.disk_usage(there).free
    words = f"{folder}: {free / 1e9:.1f} GB free" + ("" if folder.exists() else ", the folder will be made")
    return Check("disk", Outcome.OK if free > LITTLE_DISK else Outcome.WARNING, words)


def check_database(url: str) -> Check:
    """Whether the history can be read, and what is in it."""
    from monitor.queries import Reader

    def look() -> str:
        with Reader(url) as reader:
            axes = reader.axes()
        windows, waiting = sum(axis.windows for axis in axes), sum(axis.pending for axis in axes)
        return f"{len(axes)} axes, {windows} windows, {waiting} of them wait for an answer"

    return _attempt("database", look)


def check_links(config: Config, axes: dict[str, Axis]) -> Iterator[Check]:
    """Whether the daemon answers on its endpoints, is alive, and would take what a publisher sends."""
    from plant.zenoh_session import open_session

    endpoints = [endpoint.replace("0.0.0.0", "127.0.0.1") for endpoint in config.zenoh.listen]
    if not endpoints:
        yield Check("link", Outcome.WARNING, "the configuration listens on nothing; only [zenoh] connect is used")
        return
    try:
        session = open_session("client", connect=endpoints, timeout=LINK_TIMEOUT)
    except TribowatchError as error:
        yield Check("link", Outcome.OUT_OF_REACH, str(error))
        return
    with session:
        from monitor.link_zenoh import is_alive, is_matched

        yield Check("link", Outcome.OK, f"connected to {', '.join(endpoints)}")
        alive = is_alive(session, config.site, config.zenoh.prefix)
        words = "its liveliness token is there" if alive else "no liveliness token: is it another program's port?"
        yield Check("daemon", Outcome.OK if alive else Outcome.OUT_OF_REACH, words)
        for name in axes:
            matched = is_matched(session, config.site, name, config.zenoh.prefix)
            words = "the daemon takes its samples" if matched else "nobody takes its samples; check site and prefix"
            yield Check(f"stream {name}", Outcome.OK if matched else Outcome.WARNING, words)


def _attempt(name: str, look: Callable[[], str]) -> Check:
    """A check whose failure is an error with one clear line."""
    try:
        return Check(name, Outcome.OK, look())
    except InputError as error:
        return Check(name, Outcome.BAD_INPUT, str(error))
    except TribowatchError as error:
        return Check(name, Outcome.OUT_OF_REACH, str(error))


def _name_axes(axes: dict[str, Axis]) -> str:
    if not axes:
        return "no [[axis]] is listed; streams would be counted as unknown, none identified"
    names = list(axes)
    return f"{len(names)}: {', '.join(names[:5])}{', ...' if len(names) > 5 else ''}"
