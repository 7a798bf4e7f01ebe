"""`tribowatch identify`: friction from one recording."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from monitor.cli.options import AsJson
from monitor.cli.working import Working
from plant.errors import InputError

if TYPE_CHECKING:
    from identify.result import FrictionCurve, IdentificationResult
    from plant.axis import Axis
    from plant.recording import Recording


def identify_command(
    axis: Annotated[Path, typer.Option(help="The axis file (TOML).")],
    recording: Annotated[
        Path | None, typer.Argument(help="Recording to use; default: the first one the axis file lists.")
    ] = None,
    window: Annotated[
        str | None, typer.Option(metavar="START:SAMPLES", help="Use these samples only, e.g. 0:2000.")
    ] = None,
    method: Annotated[str, typer.Option(help="ga+polish, or paper (the paper's own answer, no intervals).")] = (
        "ga+polish"
    ),
    criterion: Annotated[
        str, typer.Option(help="What ga+polish minimises: observer, or output_error (eq. (4) of the paper, free run).")
    ] = "observer",
    seed: Annotated[int, typer.Option(min=0, help="Seed of the search; the same seed gives the same answer.")] = 0,
    report: Annotated[
        Path | None, typer.Option(help="Write the answer with its figures as one HTML page.", show_default=False)
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Identify friction from one recording and print the parameters with units and 95 % intervals."""
    from identify.identification import identify_friction
    from monitor.cli.output import emit_json, screen
    from monitor.report_file import check_folder, write_identification
    from plant.axis_file import read_axis

    described = read_axis(axis)
    if report is not None:
        check_folder(report)
    data = cut_window(read_first(recording, described, axis), window)
    with Working("identifying", silent=as_json):
        result = identify_friction(data, described, seed=seed, method=method, criterion=criterion)
    if report is not None:
        write_identification(report, result, described, data)
    if as_json:
        emit_json(result.to_dict())
    else:
        show_result(result, described, data)
        if report is not None:
            screen().print(f"report: {report}")


def read_first(path: Path | None, axis: Axis, axis_path: Path) -> Recording:
    """The recording at `path`, or the first one the axis file lists.

    Raises:
        InputError: neither is there.
    """
    from monitor.cli.output import with_remarks
    from plant.recording_files import read_recording, read_recording_entry

    if path is not None:
        return with_remarks([read_recording(path, axis)])[0]
    if not axis.recordings:
        raise InputError(f"{axis_path}: no [[recording]] is listed; give one: tribowatch identify RECORDING --axis ...")
    return with_remarks([read_recording_entry(axis.recordings[0], axis)])[0]


def cut_window(recording: Recording, window: str | None) -> Recording:
    """The samples that START:SAMPLES names.

    Raises:
        InputError: not two whole numbers, or outside the recording.
    """
    if window is None:
        return recording
    try:
        start, samples = (int(word) for word in window.split(":"))
    except ValueError:
        raise InputError(f"--window {window}: give START:SAMPLES as whole numbers, e.g. 0:2000") from None
    if start < 0 or samples < 1 or start + samples > len(recording):
        raise InputError(f"--window {window}: outside the recording, which has {len(recording)} samples")
    return recording.window(start, samples)


def show_result(result: IdentificationResult, axis: Axis, recording: Recording) -> None:
    """Print the answer for people."""
    from monitor.cli.output import make_table, screen, show_interval, show_number

    out = screen()
    out.print(
        f"{result.axis}: {result.verdict.value}, {result.samples} samples from {result.start:g} s to {result.end:g} s"
        f" of {recording.source or 'the recording'}"
    )
    if result.reason:
        out.print(result.reason)
    if not result.parameters:
        return
    rows = [
        (
            name.replace("_", " "),
            show_number(parameter.value),
            show_interval(parameter.ci95),
            parameter.unit,
            "at its bound" if parameter.at_bound else "",
        )
        for name, parameter in result.parameters.items()
    ]
    out.print(make_table(("parameter", ">value", "95 % interval", "unit", ""), rows))
    if result.curve is not None:
        out.print(make_table(*_curve_rows(result.curve, axis)))
    out.print(_footer(result))


def _curve_rows(curve: FrictionCurve, axis: Axis) -> tuple[tuple[str, ...], list[tuple[str, str, str]]]:
    """Friction at a few speeds the recording visited, as columns and rows of a table."""
    from monitor.cli.output import show_number

    speeds = [curve.fastest * share for share in (0.05, 0.1, 0.25, 0.5, 1.0)]
    force, half = curve.at(speeds)
    rows = [
        (show_number(v, 3), show_number(float(f)), f"± {show_number(float(h), 2)}")
        for v, f, h in zip(speeds, force, half, strict=True)
    ]
    return (f">speed [{axis.position_unit}/s]", f">friction [{axis.force_unit}]", "95 %"), rows


def _footer(result: IdentificationResult) -> str:
    """Criterion, cost and what was done to the data, in one line."""
    from monitor.cli.output import show_number

    words = [f"criterion {show_number(result.criterion, 3)}"]
    if result.held_out_criterion is not None:
        words.append(f"held out {show_number(result.held_out_criterion, 3)}")
    words.append(f"method {result.method}, {result.evaluations} simulations, seed {result.seed}")
    return "; ".join([*words, *result.preprocessing])
