"""The demo from start to end: folder, daemon, ear, machine, and the loop that listens. Does I/O."""

from __future__ import annotations

import contextlib
import queue
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from monitor.config_page import ADDRESS_FILE
from monitor.demo import Heard
from monitor.demo_can import can_bridge, can_machine
from monitor.demo_processes import (
    DATABASE,
    SITE,
    Child,
    Place,
    daemon,
    endpoint,
    free_port,
    machine,
    page_port,
    prepare_folder,
)
from monitor.demo_zenoh import Ear
from monitor.errors import QueryError
from monitor.queries import Reader
from plant.scenario_file import read_scenario

START_TIMEOUT = 30.0  # s; the daemon loads its numerics first
REFRESH = 0.25  # s between two looks at the screen
RATE_MEMORY = 5.0  # s over which samples per second are averaged


@dataclass(frozen=True, slots=True)
class DemoSettings:
    """What was asked for; see the options of `tribowatch demo`."""

    folder: Path
    scenario: str
    seed: int
    speed: float
    until_alert: bool
    duration: float | None
    can: bool = False


class Viewer(Protocol):
    """Shows what was heard."""

    def say(self, text: str) -> None:
        """One line of progress."""

    def show(self, heard: Heard, elapsed: float, samples_per_second: float) -> None:
        """The state now; called a few times a second."""


def run_demo(settings: DemoSettings, viewer: Viewer) -> dict[str, Any]:
    """Run daemon and machine until the end that was asked for; gives the JSON of `tribowatch demo --json`.

    Raises:
        InputError: scenario or folder cannot be used.
        ReachError: the daemon did not start, or a process ended with an error.
    """
    scenario = read_scenario(settings.scenario)
    begun = time.monotonic()
    heard = Heard(scenario.axis.name)
    rate = Rate()
    stopped_by = "interrupt"
    place = Place(settings.folder, settings.scenario, settings.seed, settings.speed)
    with place.owned():
        port = free_port()
        config = prepare_folder(place, port, page_port())
        viewer.say(f"demo: starting the daemon on {endpoint(port)}, state in {settings.folder}")
        with (
            contextlib.suppress(KeyboardInterrupt),
            daemon(config) as service,
            _ear(service, endpoint(port), heard.axis) as ear,
            contextlib.ExitStack() as stack,
        ):
            if settings.can:
                viewer.say("demo: the drive is on a CAN bus of datagrams; a bridge takes its frames to Zenoh")
            heard.page = _page_of(service, settings.folder)
            viewer.say(f"demo: the page is at {heard.page}")
            bridge = stack.enter_context(can_bridge(place, port)) if settings.can else None
            source = stack.enter_context(can_machine(place) if settings.can else machine(place, port))
            viewer.say(f"demo: the machine starts: {scenario.description or scenario.name}")
            stopped_by = _listen(settings, viewer, heard, rate, ear, (service, source, bridge), begun)
    return {
        "scenario": scenario.name,
        "seed": settings.seed,
        "stopped_by": stopped_by,
        **heard.summary(),
        "windows": _windows(settings.folder, heard.axis),
        "figures": {
            "seconds": round(time.monotonic() - begun, 3),
            "seconds_to_alert": None if heard.first_alert_s is None else round(heard.first_alert_s, 3),
            "event_days": round(heard.days, 3),
            "samples": heard.status.get("samples", 0),
            "missing": heard.status.get("missing", 0),
            "samples_per_second": round(rate.mean, 1),
        },
        "page": heard.page,
        "state_dir": str(settings.folder),
        "config": str(config),
    }


class Rate:
    """Samples per second, over the last seconds and over all."""

    def __init__(self) -> None:
        """Nothing yet."""
        self._points: list[tuple[float, int]] = []
        self._first: tuple[float, int] | None = None

    def note(self, samples: int) -> None:
        """The count of samples now."""
        now = time.monotonic()
        self._first = self._first or (now, samples)
        self._points = [point for point in self._points if now - point[0] < RATE_MEMORY] + [(now, samples)]

    @property
    def recent(self) -> float:
        """Over the last seconds. [1/s]"""
        return self._slope(self._points[0]) if self._points else 0.0

    @property
    def mean(self) -> float:
        """Since the first sample. [1/s]"""
        return self._slope(self._first) if self._first else 0.0

    def _slope(self, begin: tuple[float, int]) -> float:
        end = self._points[-1]
        return (end[1] - begin[1]) / (end[0] - begin[0]) if end[0] > begin[0] else 0.0


def _windows(folder: Path, axis: str) -> dict[str, int]:
    """Windows by verdict, from the history: what is published may be lost on its way where the computer is busy."""
    with Reader(f"sqlite:///{folder / DATABASE}") as reader:
        try:
            verdicts = reader.axis(axis).verdicts
        except QueryError:  # ended before the first sample
            verdicts = {}
    return {"total": sum(verdicts.values()), **verdicts}


@contextlib.contextmanager
def _ear(service: Child, where: str, axis: str) -> Iterator[Ear]:
    """Connect to the daemon; if it has ended instead, say why."""
    from plant.errors import ReachError

    try:
        ear = Ear(where, SITE, axis, START_TIMEOUT)
    except ReachError:
        service.check()
        raise
    with ear:
        yield ear


def _page_of(service: Child, folder: Path) -> str | None:
    """Where the daemon serves its page; None where it has not said so in time."""
    until = time.monotonic() + START_TIMEOUT
    while time.monotonic() < until:
        service.check()
        with contextlib.suppress(OSError):
            return (folder / ADDRESS_FILE).read_text(encoding="utf-8").strip() or None
        time.sleep(0.05)
    return None


def _listen(
    settings: DemoSettings,
    viewer: Viewer,
    heard: Heard,
    rate: Rate,
    ear: Ear,
    children: tuple[Child, Child, Child | None],
    begun: float,
) -> str:
    """Hear and show until the end, at the latest when the machine is done and all is answered; says what ended it."""
    service, source, bridge = children
    while True:
        _hear_all(ear, heard, rate, begun)
        elapsed = time.monotonic() - begun
        viewer.show(heard, elapsed, rate.recent)
        service.check()
        source.check()
        if bridge is not None:
            bridge.check()
        if settings.until_alert and heard.changed is not None:
            return "alert"
        if settings.duration is not None and elapsed >= settings.duration:
            return "duration"
        if source.ended is None:
            heard.quiet = 0
        elif heard.finished:
            return "end"


def _hear_all(ear: Ear, heard: Heard, rate: Rate, begun: float) -> None:
    """Take everything that comes within one refresh."""
    until = time.monotonic() + REFRESH
    while (left := until - time.monotonic()) > 0:
        with contextlib.suppress(queue.Empty):
            what, message = ear.messages.get(timeout=left)
            heard.hear(what, message, time.monotonic() - begun)
            if what == "status":
                rate.note(message["samples"])
