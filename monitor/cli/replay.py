"""`tribowatch replay`: recordings sent through the very path of a live stream."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from monitor.cli.options import ENDPOINT, AsJson, Endpoints, StreamPrefix, StreamSite
from plant.errors import InputError, ReachError

if TYPE_CHECKING:
    from plant.axis import Axis
    from plant.recording import Recording
    from plant.replay import ReplayResult, Track


def replay_command(
    axis: Annotated[list[Path], typer.Option(help="The axis file (TOML); repeated, all axes are played at once.")],
    recordings: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="RECORDING...",
            help="Played one after another; default: the first one listed. With several axes: AXIS=RECORDING.",
        ),
    ] = None,
    speed: Annotated[str, typer.Option(help="Times real time; 0 or max: as fast as the daemon acknowledges.")] = "1",
    repeat: Annotated[int, typer.Option(help="How often the whole is played.")] = 1,
    connect: Endpoints = None,
    site: StreamSite = "plant-1",
    prefix: StreamPrefix = "tribowatch",
    start: Annotated[
        str | None,
        typer.Option(
            help="Time of the first sample (ISO 8601, UTC unless it says), or original: when it was recorded. "
            "Default: now.",
            show_default=False,
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Replay recordings into the daemon, raw samples with their own spacing, and wait until it has committed them."""
    from plant.replay import ReplaySettings, replay_tracks
    from plant.zenoh_session import open_session

    tracks = _tracks(axis, recordings or [])
    original = start == "original"
    start_ns = None if original else _start(start)
    settings = ReplaySettings(speed=_speed(speed), repeat=repeat, start_ns=start_ns, original=original, prefix=prefix)
    with open_session("client", connect=tuple(connect or [ENDPOINT])) as session, _progress() as tell:
        results = replay_tracks(tracks, session, site, settings, tell)
    _show(results, as_json)
    for result in results:
        _check(result, site)


def _check(result: ReplayResult, site: str) -> None:
    """Complain about what the daemon has not committed."""
    if result.missing:
        raise ReachError(
            f"the daemon reports {result.missing} samples of {result.axis} as missing: it was away for longer than the "
            "publisher's cache reaches back; replay them again"
        )
    if not result.acknowledged:
        raise ReachError(
            f"the daemon has committed {result.committed_seq + 1} of {result.samples} samples of {result.axis}: "
            f"is it running, is the axis listed under [[axis]] in its configuration, and is its site {site!r}?"
        )


def _tracks(axis_files: list[Path], recordings: list[str]) -> list[Track]:
    """What to play on which axis."""
    from monitor.cli.output import with_remarks
    from plant.axis_file import read_axis
    from plant.replay import Track

    axes = [read_axis(path) for path in axis_files]
    names = [axis.name for axis in axes]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise InputError(f"axis {twice!r} is given twice; a stream has one publisher")
    chosen: dict[str, list[Path]] = {name: [] for name in names}
    for word in recordings:
        name, _, path = word.partition("=")
        if len(names) == 1 and name not in names:
            name, path = names[0], word
        if not path or name not in names:
            raise InputError(
                f"{word!r} does not say of which axis: write AXIS=RECORDING, with one of {', '.join(names)}"
            )
        chosen[name].append(Path(path))
    tracks = []
    for axis, axis_file in zip(axes, axis_files, strict=True):
        tracks.append(Track(axis.name, tuple(with_remarks(_read(chosen[axis.name], axis, axis_file)))))
    return tracks


def _read(paths: list[Path], axis: Axis, axis_path: Path) -> list[Recording]:
    """The recordings to play."""
    from plant.recording_files import read_recording, read_recording_entry

    if paths:
        return [read_recording(path, axis) for path in paths]
    if not axis.recordings:
        raise InputError(f"{axis_path}: no [[recording]] is listed; give one: tribowatch replay RECORDING --axis ...")
    return [read_recording_entry(axis.recordings[0], axis)]


def _speed(text: str) -> float:
    """Read --speed; `max` is 0, as fast as possible."""
    if text == "max":
        return 0.0
    try:
        return float(text)
    except ValueError:
        raise InputError(f"--speed is {text!r}, but must be a number >= 0 (times real time), or max") from None


def _start(text: str | None) -> int | None:
    """Read --start. [ns of Unix time]"""
    if text is None:
        return None
    try:
        moment = datetime.fromisoformat(text)
    except ValueError:
        raise InputError(f"--start is {text!r}, but must be a time like 2026-01-05T06:00:00Z") from None
    moment = moment if moment.tzinfo else moment.replace(tzinfo=UTC)
    since = moment - datetime(1970, 1, 1, tzinfo=UTC)
    return (since.days * 86_400 + since.seconds) * 10**9 + since.microseconds * 1000


@contextmanager
def _progress() -> Iterator[Callable[[int, int, int], None]]:
    """Two bars on stderr, sent and acknowledged; nothing where stderr is no terminal."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    from monitor.cli.output import screen

    console = screen(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, disable=not console.is_terminal, transient=True) as bar:
        sending, hearing = bar.add_task("samples sent", total=None), bar.add_task("acknowledged", total=None)

        def tell(sent: int, acknowledged: int, total: int) -> None:
            bar.update(sending, completed=sent, total=total)
            bar.update(hearing, completed=acknowledged, total=total)

        yield tell


def _show(results: list[ReplayResult], as_json: bool) -> None:
    """Print what was sent and what has become of it; several axes as a list under `axes`."""
    if as_json:
        from monitor.cli.output import emit_json

        found = [dataclasses.asdict(result) | {"acknowledged": result.acknowledged} for result in results]
        emit_json(found[0] if len(found) == 1 else {"axes": found})
        return
    for result in results:
        _show_one(result)


def _show_one(result: ReplayResult) -> None:
    """One line about one axis."""
    from monitor.cli.output import screen

    rate = result.samples / result.seconds if result.seconds else 0.0
    skipped = f", {result.skipped} skipped for want of a usable time stamp" if result.skipped else ""
    screen().print(
        f"{result.axis}: {result.samples} samples in {result.blocks} blocks sent in {result.seconds:.1f} s "
        f"({rate:.0f} samples/s){skipped}; " + ("all committed." if result.acknowledged else "not all committed.")
    )
