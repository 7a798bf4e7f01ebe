"""Something long is under way: what, how far, and how long it may still take; on stderr, where somebody looks."""

from __future__ import annotations

import time
from types import TracebackType
from typing import TYPE_CHECKING, Self

from monitor.cli.course import Course, in_words

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress, TaskID

    from identify.mismatch.progress import Doing


class Working:
    """A spinner with the time that has passed; what tells how far it is (`hear`) gets a bar and the time that is left.

    That time is a guess: what a search finds decides how many more follow.
    """

    def __init__(self, what: str, *, silent: bool = False) -> None:
        """Say `what` is done; `silent` where programs read."""
        self._what, self._silent = what, silent
        self._progress: Progress | None = None
        self._task: TaskID | None = None
        self._course = Course()
        self._began = self._step_began = 0.0

    def __enter__(self) -> Self:
        """Begin to show."""
        from monitor.cli.output import screen

        console = screen(stderr=True)
        self._began = self._step_began = time.monotonic()
        if not self._silent and console.is_terminal:
            self._show(console)
        return self

    def _show(self, console: Console) -> None:
        from rich.progress import BarColumn, Progress, RenderableColumn, SpinnerColumn, TextColumn, TimeElapsedColumn

        told = (SpinnerColumn(), TextColumn("{task.description}"), BarColumn(24), TimeElapsedColumn())
        self._progress = Progress(*told, RenderableColumn(_Left(self)), console=console, transient=True)
        self._task = self._progress.add_task(self._what, total=None)
        self._progress.start()

    @property
    def left(self) -> str:
        """How long it may still take, in words."""
        return in_words(self._course.left(self._step_began - self._began, time.monotonic() - self._step_began))

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """Leave no trace."""
        if self._progress is not None:
            self._progress.stop()

    def hear(self, doing: Doing) -> None:
        """What is being done now."""
        self._step_began = time.monotonic()
        self._course.hear(doing)
        if self._progress is not None and self._task is not None:
            done, total = self._course.behind, self._course.behind + self._course.ahead
            where = f" ({doing.done + 1} of {doing.of})" if doing.of > 1 else ""
            words = f"{self._what}: {doing.what.replace('_', ' ')}{where}"
            self._progress.update(self._task, description=words, completed=done, total=total)


class _Left:
    """The time that is left, as rich draws it anew each time."""

    def __init__(self, working: Working) -> None:
        self._working = working

    def __rich__(self) -> str:
        return self._working.left
