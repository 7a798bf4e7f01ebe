"""What the demo has heard so far, and what it says about it. Values in, words out; no I/O."""

from __future__ import annotations

from collections import Counter, deque
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any

KEPT = 1000  # values per parameter for the trend
QUIET = 3  # statuses, about seconds
WATCHED = ("wear", "lubrication", "jam")  # kinds that mean the machine has changed


@dataclass(slots=True)
class Heard:
    """Messages of the daemon, boiled down.

    Attributes:
        axis: the axis of the demo.
        start_ns: event time of the first window. [ns]
        now_ns: event time of the latest window that was answered. [ns]
        verdicts: windows by verdict. [1]
        latest: the latest parameters message that was identified.
        trend: values by parameter, oldest first.
        status: the latest status message.
        quiet: statuses in a row that told nothing new, with no window waiting. [1]
        alerts: latest alert by its id, in the order they were raised.
        transitions: of the alerts, in order.
        first_alert_s: wall clock from the start of the demo to the first alert that the machine has changed. [s]
        page: where the daemon shows it in a browser.
    """

    axis: str
    start_ns: int | None = None
    now_ns: int | None = None
    verdicts: Counter[str] = field(default_factory=Counter)
    latest: dict[str, Any] | None = None
    trend: dict[str, deque[float]] = field(default_factory=dict)
    status: dict[str, Any] = field(default_factory=dict)
    quiet: int = 0
    alerts: dict[str, dict[str, Any]] = field(default_factory=dict)
    transitions: list[dict[str, Any]] = field(default_factory=list)
    first_alert_s: float | None = None
    page: str | None = None

    def hear(self, what: str, message: dict[str, Any], elapsed: float) -> None:
        """Take one message of kind `what`, `elapsed` seconds after the start."""
        match what:
            case "parameters":
                self._hear_parameters(message)
            case "status":
                self._hear_status(message)
            case "alerts":
                self._hear_alert(message, elapsed)

    def _hear_parameters(self, message: dict[str, Any]) -> None:
        self.verdicts[message["verdict"]] += 1
        window = message["window"]
        self.start_ns = self.start_ns or window["start_ns"]
        self.now_ns = max(self.now_ns or 0, window["end_ns"])
        if message["verdict"] != "identified":
            return
        self.latest = message
        for name, found in message["parameters"].items():
            self.trend.setdefault(name, deque(maxlen=KEPT)).append(found["value"])

    def _hear_alert(self, message: dict[str, Any], elapsed: float) -> None:
        alert = message["alert"]
        self.alerts[alert["id"]] = alert
        self.transitions.append({"kind": message["kind"], **message["transition"]})
        if alert["kind"] in WATCHED and self.first_alert_s is None:
            self.first_alert_s = elapsed

    @property
    def changed(self) -> dict[str, Any] | None:
        """The latest alert that the machine has changed."""
        found = [alert for alert in self.alerts.values() if alert["kind"] in WATCHED]
        return found[-1] if found else None

    @property
    def windows(self) -> int:
        """Windows answered so far."""
        return self.verdicts.total()

    @property
    def date(self) -> str:
        """The machine's own date."""
        if self.now_ns is None:
            return "not yet started"
        return f"{datetime.fromtimestamp(self.now_ns // 10**9, UTC):%Y-%m-%d}"

    @property
    def days(self) -> float:
        """Event time since the start. [d]"""
        if self.now_ns is None or self.start_ns is None:
            return 0.0
        return (self.now_ns - self.start_ns) / 86400e9

    @property
    def phase(self) -> str:
        """What the daemon is doing, in words."""
        baseline = self.status.get("baseline")
        if not baseline:
            return "waiting for the first samples"
        if not baseline["complete"]:
            return f"learning what is normal: {baseline['windows']} of {baseline['needed']} windows"
        return f"watching against a baseline of {baseline['windows']} windows"

    def _hear_status(self, message: dict[str, Any]) -> None:
        same = all(message[name] == self.status.get(name) for name in ("samples", "missing"))
        self.quiet = self.quiet + 1 if same and message["pending_windows"] == 0 else 0
        self.status = message

    @property
    def finished(self) -> bool:
        """Whether nothing more came for some statuses, and every window has its answer."""
        return self.quiet >= QUIET

    def line(self, samples_per_second: float) -> str:
        """The state in one line, for a log or a pipe."""
        friction = ""
        if self.latest is not None:
            found = self.latest["parameters"]["coulomb_force"]
            low, high = found["ci95"] or (float("nan"), float("nan"))
            friction = f"  Coulomb force {found['value']:.2f} {found['unit']} [{low:.2f}, {high:.2f}]"
        return (
            f"{self.date}  day {self.days:3.0f}  {self.windows:4d} windows{friction}"
            f"  {samples_per_second:.0f} samples/s  {self.phase}"
        )

    def summary(self) -> dict[str, Any]:
        """The JSON at the end, without what only the caller knows."""
        return {
            "axis": self.axis,
            "parameters": self.latest["parameters"] if self.latest else {},
            "parameters_at": self.latest["window"]["end_time"] if self.latest else None,
            "alerts": list(self.alerts.values()),
            "transitions": self.transitions,
        }


def where_next(axis: str, state_dir: str) -> list[tuple[str, str]]:
    """Commands worth typing after the demo, with what they show."""
    return [
        (f"tribowatch run --config {state_dir}/tribowatch.toml", "the daemon and its page again, on this history"),
        (f"tribowatch alerts --state-dir {state_dir}", "every alert with its evidence and what to do"),
        (f"tribowatch history {axis} --state-dir {state_dir}", "the trend of every parameter"),
        (f"tribowatch history {axis} --state-dir {state_dir} --parameter coulomb_force --csv", "for your own tools"),
        (f"tribowatch axes --state-dir {state_dir}", "all axes at a glance"),
    ]
