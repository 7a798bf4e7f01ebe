"""The demo on the screen: a live table on a terminal, plain lines into a pipe or a log."""

from __future__ import annotations

import sys
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

from monitor.cli.alerts import describe
from monitor.cli.output import emit_json, make_table, screen, show_interval, show_number, sparkline
from monitor.demo import where_next

if TYPE_CHECKING:
    from rich.console import Group
    from rich.live import Live

    from monitor.demo import Heard
    from monitor.demo_run import DemoSettings

BORDERS = {"high": "red", "medium": "yellow", "low": "cyan"}
OTHERS = 68  # columns that the numbers of a row take
LINE_EVERY = 2.0  # s between two lines where there is no terminal


class Screen:
    """Shows the demo; with `as_json` everything goes to stderr and stdout gets one object at the end."""

    def __init__(self, settings: DemoSettings, as_json: bool) -> None:
        """Nothing is shown before `with`."""
        self._settings, self._as_json = settings, as_json
        self._console = screen(stderr=as_json)
        self._live: Live | None = None
        self._next_line = 0.0
        self._told: set[str] = set()

    def __enter__(self) -> Self:
        """Take the terminal, if there is one."""
        if self._console.is_terminal:
            from rich.live import Live

            self._live = Live(console=self._console, refresh_per_second=4, transient=False)
            self._live.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """Give the terminal back."""
        if self._live is not None:
            self._live.stop()

    def say(self, text: str) -> None:
        """One line of progress."""
        self._console.print(text)
        self._flush()

    def show(self, heard: Heard, elapsed: float, samples_per_second: float) -> None:
        """The state now."""
        if self._live is not None:
            self._live.update(self._picture(heard, elapsed, samples_per_second))
            return
        new = [alert for name, alert in heard.alerts.items() if name not in self._told]
        if elapsed >= self._next_line or new:
            self._next_line = elapsed + LINE_EVERY
            self._console.print(heard.line(samples_per_second))
        for alert in new:
            self._told.add(alert["id"])
            self._console.print(describe(alert))
        self._flush()

    def conclude(self, result: dict[str, Any]) -> None:
        """Say how it ended and where to look next."""
        if self._as_json:
            emit_json(result)
            return
        figures = result["figures"]
        how = {
            "alert": "stopped at the alert (--until-alert)",
            "duration": "stopped after the time that was asked for (--duration)",
            "end": "the scenario is over",
            "interrupt": "stopped by ^C",
        }[result["stopped_by"]]
        alert = figures["seconds_to_alert"]
        when = f"; first alert after {alert:.1f} s" if alert is not None else ""
        self._console.print(
            f"\ndemo: {how}. {result['windows']['total']} windows of {figures['event_days']:.0f} days in "
            f"{figures['seconds']:.1f} s, {figures['samples_per_second']:.0f} samples/s{when}."
        )
        self._console.print("Where to look next:")
        for command, purpose in where_next(result["axis"], result["state_dir"]):
            self._console.print(f"  {_program()}{command.removeprefix('tribowatch')}   # {purpose}", soft_wrap=True)
        self._flush()

    def _flush(self) -> None:
        self._console.file.flush()

    def _picture(self, heard: Heard, elapsed: float, samples_per_second: float) -> Group:
        """Everything on one screen."""
        from rich.console import Group
        from rich.panel import Panel
        from rich.text import Text

        page = [Text.assemble(("page  ", "dim"), (heard.page, "underline"))] if heard.page else []
        head = Text.assemble(
            ("demo", "bold"),
            f"  {heard.axis}  {heard.date}, day {heard.days:.0f}  ",
            (f"{heard.windows} windows  {samples_per_second:.0f} samples/s  {elapsed:.0f} s", "dim"),
        )
        parts: list[Any] = [head, *page, Text(heard.phase), make_table(COLUMNS, _rows(heard, self._console.width))]
        parts += [Panel(describe(alert), border_style=BORDERS[alert["priority"]]) for alert in heard.alerts.values()]
        end = "stops at the alert" if self._settings.until_alert else "^C stops"
        parts.append(
            Text(f"one second here is up to {self._settings.speed / 86400:.3g} days of the machine; {end}", "dim")
        )
        return Group(*parts)


COLUMNS = ("parameter", ">value", "95 % interval", "unit", "trend")


def _rows(heard: Heard, width: int) -> list[tuple[str, ...]]:
    """One row per parameter; the trend fills the width."""
    if heard.latest is None:
        return []
    return [
        (
            name.replace("_", " "),
            show_number(found["value"]),
            show_interval(found["ci95"]),
            found["unit"],
            sparkline(list(heard.trend.get(name, ())), min(40, max(8, width - OTHERS))),
        )
        for name, found in heard.latest["parameters"].items()
    ]


def _program() -> str:
    """How this program was called, so that what we print can be pasted."""
    import shutil
    from pathlib import Path

    if shutil.which("tribowatch"):
        return "tribowatch"
    beside = Path(sys.executable).with_name("tribowatch")
    if not beside.exists():
        return f"{sys.executable} -m monitor"
    try:
        return str(beside.relative_to(Path.cwd()))
    except ValueError:
        return str(beside)
