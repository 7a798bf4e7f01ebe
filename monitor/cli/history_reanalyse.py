"""`tribowatch history reanalyse`: identify stored windows again, here or on a cluster, and compare."""

from __future__ import annotations

import time
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

import typer

from monitor.cli.options import AsJson, ConfigFile, StateDir, history_url, read_configuration
from plant.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable
    from concurrent.futures import Executor

    from rich.progress import Progress, TaskID

    from monitor.workers import Workers

SAID_EVERY = 30.0  # s between lines of progress where stderr is no terminal


def reanalyse_command(
    into: Annotated[Path, typer.Option(help="Folder of the new answers, a state directory; made if absent.")],
    axes: Annotated[list[str] | None, typer.Argument(help="Names of axes. Default: all.", show_default=False)] = None,
    since: Annotated[
        str | None, typer.Option(help="This far back from each axis' latest sample: 1y, 30d.", show_default=False)
    ] = None,
    begin: Annotated[
        str | None, typer.Option("--from", help="From this time on (UTC), like 2026-03-01.", show_default=False)
    ] = None,
    end: Annotated[str | None, typer.Option("--to", help="Up to this time (UTC).", show_default=False)] = None,
    model: Annotated[
        Literal["then", "present"],
        typer.Option(help="Constants and effects: those in force when a window was taken, or those of today."),
    ] = "then",
    scheduler: Annotated[
        str | None,
        typer.Option(
            help="Dask scheduler, like tcp://host:8786. Default: the configuration's, else this machine.",
            show_default=False,
        ),
    ] = None,
    workers: Annotated[
        int, typer.Option(min=0, help="Processes; 0 = one per processor, with --scheduler all of the cluster's.")
    ] = 0,
    config: ConfigFile = None,
    state_dir: StateDir = None,
    as_json: AsJson = False,
) -> None:
    """Identify stored windows again with this program, and compare with what is stored, which stays as it is.

    Interrupted, the same command goes on where it ended. The new answers are read like any history: --state-dir INTO.
    """
    from monitor.logs import configure_logging
    from monitor.query_raw import RawReader
    from monitor.reanalysis import figures, reanalyse
    from monitor.service import own
    from monitor.store_reanalysis import Order, Target
    from monitor.times import parse_duration, parse_time

    if since and begin:
        raise InputError("--since and --from exclude each other: choose one")
    url, folder = history_url(config, state_dir)
    if into.resolve() == folder.resolve():
        raise InputError(f"--into {into}: this is where the history itself is; choose another folder")
    order = Order(
        url,
        tuple(axes or ()),
        since_ns=parse_duration(since) if since else None,
        from_ns=parse_time(begin) if begin else None,
        to_ns=parse_time(end) if end else None,
        present=model == "present",
    )
    configure_logging("warning", "console")
    begun = time.monotonic()
    with RawReader(url) as reader, own(into):
        start, processes = _crew(config, scheduler, workers)
        target = Target(into, order)
        try:
            with _Progress(processes) as progress:
                found = figures(reanalyse(reader, order, target, start, progress.tell))
        finally:
            target.close()
    found |= {"into": str(into), "model": model, "workers": processes, "fresh": progress.fresh}
    found["seconds"] = round(time.monotonic() - begun, 1)
    if as_json:
        from monitor.cli.output import emit_json

        emit_json(found)
    else:
        _show(found)


def _crew(
    config: Path | None, scheduler: str | None, workers: int
) -> tuple[Callable[[Callable[[], None]], Workers], int]:
    """How the workers are started, and how many processes they are."""
    import os
    from functools import partial

    from monitor.config_sections import IdentificationSection
    from monitor.workers import Workers, local_pool

    settings, identity = IdentificationSection(), None
    if config is not None:
        read = read_configuration(config)
        settings = read.identification
        identity = Path(read.security.identity) if read.security.identity else None
    address = scheduler or settings.cluster
    start_pool: Callable[[int], Executor] = local_pool
    processes = workers or os.cpu_count() or 1
    if address:
        from monitor.cluster_dask import DaskPool

        pool = DaskPool(address, identity)
        try:
            found = pool.reach()
        finally:
            pool.shutdown()
        processes = workers or found
        start_pool = partial(_on_cluster, address, identity)
    crew = partial(
        Workers, processes, retries=settings.retries, timeout=settings.timeout_seconds, start_pool=start_pool
    )
    return lambda wake: crew(wake=wake), processes


def _on_cluster(address: str, identity: Path | None, _workers: int) -> Executor:
    from monitor.cluster_dask import DaskPool

    return DaskPool(address, identity)


class _Progress:
    """How far it is and how long it will take, on stderr: a bar on a terminal, else a line now and then."""

    def __init__(self, processes: int) -> None:
        self._processes = processes
        self._begun = self._said = time.monotonic()
        self._bar: Progress | None = None
        self._task: TaskID | None = None
        self.fresh = 0

    def __enter__(self) -> Self:
        """Begin to show."""
        from monitor.cli.output import screen

        console = screen(stderr=True)
        if console.is_terminal:
            from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

            columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
            self._bar = Progress(*columns, console=console, transient=True)
            self._task = self._bar.add_task(f"identifying on {self._processes} processes", total=None)
            self._bar.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """Leave no trace; where it was interrupted, say that nothing is lost."""
        if self._bar is not None:
            self._bar.stop()
        if isinstance(error, KeyboardInterrupt):
            from monitor.cli.output import note

            note(f"interrupted after {self.fresh} windows; the same command goes on from here")

    def tell(self, done: int, total: int, fresh: int) -> None:
        """So many windows are done, of so many; so many of them in this run."""
        self.fresh = fresh
        if self._bar is not None and self._task is not None:
            self._bar.update(self._task, completed=done, total=total)
            return
        now = time.monotonic()
        if now - self._said < SAID_EVERY and done < total:
            return
        self._said = now
        from monitor.cli.output import note
        from monitor.times import span

        seconds = (now - self._begun) / max(fresh, 1) * (total - done)
        left = f", about {span(round(seconds * 1e9))} left" if fresh and done < total else ""
        note(f"{done} of {total} windows{left}")


def _show(found: dict[str, Any]) -> None:
    from monitor.cli.output import make_table, screen, show_number

    out = screen()
    columns = ("axis", ">windows", ">the same", ">within 1/1000", ">moved", ">other verdict", ">raw gone", ">failed")
    names = ("axis", "windows", "same", "close", "moved", "verdict", "raw_gone", "failed")
    out.print(make_table((*columns, ""), [(*(str(one[name]) for name in names), "") for one in found["axes"]]))
    differing = (one for axis in found["axes"] for one in axis["differing"] if one["likeness"] != "close")
    if (first := next(differing, None)) is not None:
        out.print(
            f"farthest value: {show_number(found['farthest'])} of its interval's length; first difference at "
            f"{first['end']}: {first['verdict']['then']} then, {first['verdict']['now']} now (--json lists them)"
        )
    out.print(
        f"{found['fresh']} windows identified now; all new answers: tribowatch history --state-dir {found['into']}"
    )
