"""Something long is under way: what, and since when, on stderr; nothing where nobody looks."""

from __future__ import annotations

from types import TracebackType
from typing import TYPE_CHECKING, Self

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID


class Working:
    """A spinner with the time that has passed; how much is left, a search cannot know beforehand."""

    def __init__(self, what: str, *, silent: bool = False) -> None:
        """Say `what` is done; `silent` where programs read."""
        self._what, self._silent = what, silent
        self._progress: Progress | None = None
        self._task: TaskID | None = None

    def __enter__(self) -> Self:
        """Begin to show."""
        from monitor.cli.output import screen

        console = screen(stderr=True)
        if not self._silent and console.is_terminal:
            from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

            columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
            self._progress = Progress(*columns, console=console, transient=True)
            self._task = self._progress.add_task(self._what, total=None)
            self._progress.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """Leave no trace."""
        if self._progress is not None:
            self._progress.stop()

    def say(self, detail: str) -> None:
        """What is being tried now."""
        if self._progress is not None and self._task is not None:
            self._progress.update(self._task, description=f"{self._what}: {detail.replace('_', ' ')}")
