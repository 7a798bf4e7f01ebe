"""`tribowatch axes check`: does a recording, or the live stream, agree with its axis file?"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from monitor.cli.axes_init import Judged, judged_by, judged_to_dict, show_judged
from monitor.cli.options import ENDPOINT, AsJson, Endpoints, StreamPrefix, StreamSite
from plant.errors import InputError, ReachError

if TYPE_CHECKING:
    from plant.axis import Axis
    from plant.recording import Recording


def axes_check_command(
    axis: Annotated[Path, typer.Option(help="The axis file (TOML).")],
    recordings: Annotated[
        list[Path] | None, typer.Argument(metavar="[RECORDING...]", help="Default: all that the axis file lists.")
    ] = None,
    stream: Annotated[bool, typer.Option("--stream", help="Check the live stream instead.")] = False,
    seconds: Annotated[float, typer.Option(help="How many seconds to listen to the stream.")] = 20.0,
    connect: Endpoints = None,
    site: StreamSite = "plant-1",
    prefix: StreamPrefix = "tribowatch",
    as_json: AsJson = False,
) -> None:
    """Check sign, unit and scale of recordings or of the live stream, and whether the motion is good enough."""
    from identify.audit import worst
    from plant.axis_file import read_axis

    if stream and recordings:
        raise InputError("give recordings or --stream, not both")
    described = read_axis(axis)
    if stream:
        samples, refused = _listen(described, seconds, connect or [ENDPOINT], site, prefix)
        checked = [samples]
    else:
        checked, refused = _read(recordings or [], described, axis), {}
    judged = [judged_by(one, described) for one in checked]
    if as_json:
        from monitor.cli.output import emit_json

        results = [
            {"source": one.source, "samples": len(one), **judged_to_dict(verdict)}
            for one, verdict in zip(checked, judged, strict=True)
        ]
        overall = worst(finding for verdict in judged for finding in verdict.findings)
        emit_json({"axis": described.name, "audit": overall, "recordings": results, "refused_blocks": refused})
        return
    _show(checked, judged, refused)


def _read(paths: list[Path], axis: Axis, axis_path: Path) -> list[Recording]:
    """The recordings named, or all that the axis file lists."""
    from monitor.cli.output import with_remarks
    from plant.recording_files import read_recording, read_recording_entry

    if paths:
        return with_remarks([read_recording(path, axis) for path in paths])
    if not axis.recordings:
        raise InputError(f"{axis_path}: no [[recording]] is listed; give one, or --stream")
    return with_remarks([read_recording_entry(entry, axis) for entry in axis.recordings])


def _listen(axis: Axis, seconds: float, connect: list[str], site: str, prefix: str) -> tuple[Recording, dict[str, int]]:
    """What the stream sends within `seconds`."""
    from monitor.cli.output import note
    from monitor.listen_zenoh import as_recording, listen
    from plant.zenoh_session import open_session

    if not seconds > 0:
        raise InputError(f"--seconds is {seconds:g}, but must be > 0 s")
    with open_session("client", connect=tuple(connect)) as session:
        note(f"listening to {axis.name} for {seconds:g} s")
        heard = listen(session, site, axis.name, seconds, prefix=prefix)
    samples = as_recording(heard, axis)
    if samples is None:
        refused = ", ".join(f"{count} blocks refused: {reason}" for reason, count in heard.refused.items())
        key = f"{prefix}/{site}/{axis.name}/samples"
        raise ReachError(f"nothing to check of {key} within {seconds:g} s: {refused or 'no block came'}")
    return samples, dict(heard.refused)


def _show(checked: list[Recording], judged: list[Judged], refused: dict[str, Any]) -> None:
    """Print each recording's findings and verdict."""
    from monitor.cli.output import screen

    out = screen()
    for one, verdict in zip(checked, judged, strict=True):
        out.print(f"{one.source}: {len(one)} samples")
        show_judged(verdict)
    for reason, count in refused.items():
        out.print(f"{count} blocks refused: {reason}")
