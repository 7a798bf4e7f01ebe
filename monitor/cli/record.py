"""`tribowatch record`: live streams into files."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from monitor.cli.options import ENDPOINT, AsJson, Endpoints, StreamPrefix, StreamSite
from plant.errors import InputError

if TYPE_CHECKING:
    from plant.record_zenoh import Recorded


def record_command(
    out: Annotated[Path, typer.Option(help="Folder of the recordings; made if need be.")],
    axis: Annotated[
        list[str] | None, typer.Option(help="Name of an axis; may be repeated. Default: all.", show_default=False)
    ] = None,
    kind: Annotated[str, typer.Option("--format", help="csv, csv.gz or parquet (extra 'parquet').")] = "csv.gz",
    roll_minutes: Annotated[float, typer.Option(help="Begin a new file after so many minutes of event time.")] = 60.0,
    roll_megabytes: Annotated[float, typer.Option(help="Begin a new file after so much payload. [MB]")] = 64.0,
    duration: Annotated[float | None, typer.Option(help="Stop after so many seconds.", show_default=False)] = None,
    connect: Endpoints = None,
    site: StreamSite = "plant-1",
    prefix: StreamPrefix = "tribowatch",
    as_json: AsJson = False,
) -> None:
    """Record live streams to files that replay, identify and diagnose read back, to the sample."""
    if duration is not None and not duration > 0:
        raise InputError(f"--duration is {duration:g} s, but must be > 0 s")
    import threading

    from monitor.cli.output import note
    from plant.record_files import RollRule
    from plant.record_zenoh import Recorded, record
    from plant.zenoh_session import open_session

    rule = RollRule(kind, roll_megabytes, roll_minutes)
    latest = Recorded()
    interrupted = False

    def ready() -> None:
        note(f"recording {prefix}/{site}/{','.join(axis or ['*'])}/samples into {out}; ^C stops")

    with open_session("client", connect=tuple(connect or [ENDPOINT])) as session, _progress(duration) as tell:

        def hear(result: Recorded) -> None:
            nonlocal latest
            latest = result
            tell(result)

        try:
            latest = record(
                session, site, out, rule, axes=axis or (), prefix=prefix, duration=duration,
                stop=threading.Event(), ready=ready, progress=hear,
            )  # fmt: skip
        except KeyboardInterrupt:
            interrupted = True
    _show(latest, as_json)
    if interrupted:
        raise typer.Exit(130)


@contextmanager
def _progress(duration: float | None) -> Iterator[Callable[[Recorded], None]]:
    """A bar on stderr: time against --duration, samples so far; nothing where stderr is no terminal."""
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    from monitor.cli.output import screen

    console = screen(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, disable=not console.is_terminal, transient=True) as bar:
        task = bar.add_task("recording", total=duration)

        def tell(result: Recorded) -> None:
            lost = sum(one.missing for one in result.axes.values())
            words = f"{result.samples} samples of {len(result.axes)} axes, {lost} missing"
            bar.update(task, completed=result.seconds, description=words)

        yield tell


def _show(result: Recorded, as_json: bool) -> None:
    """Say what was written."""
    from monitor.cli.output import emit_json, make_table, screen

    if as_json:
        axes = {name: dataclasses.asdict(one) for name, one in result.axes.items()}
        emit_json(
            {
                "seconds": round(result.seconds, 3),
                "samples": result.samples,
                "dropped": result.dropped,
                "refused": dict(result.refused),
                "axes": axes,
            }
        )
        return
    out = screen()
    refused = ", ".join(f"{reason} {count}" for reason, count in result.refused.items()) or "none"
    out.print(
        f"{result.samples} samples of {len(result.axes)} axes in {result.seconds:.1f} s; blocks refused: {refused}; "
        f"dropped: {result.dropped}."
    )
    rows = [
        (name, f"{one.samples}", f"{one.missing}", f"{one.gaps}", f"{one.duplicates}", "\n".join(one.files) or "none")
        for name, one in result.axes.items()
    ]
    if rows:
        out.print(make_table(("axis", ">samples", ">missing", ">gaps", ">twice", "files"), rows))
