"""`tribowatch diagnose`: which physics does the model leave out?"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from monitor.cli.options import AsJson
from monitor.cli.working import Working
from plant.errors import InputError

if TYPE_CHECKING:
    from identify.mismatch.result import Diagnosis
    from plant.axis import Axis
    from plant.recording import Recording


def diagnose_command(
    axis: Annotated[Path, typer.Option(help="The axis file (TOML).")],
    recordings: Annotated[
        list[Path] | None, typer.Argument(metavar="[RECORDING]...", help="Default: all that the axis file lists.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the search; the same seed gives the same answer.")] = 0,
    report: Annotated[
        Path | None,
        typer.Option(help="Write the finding with its evidence as one HTML page.", show_default=False),
    ] = None,
    threads: Annotated[
        int | None,
        typer.Option(
            min=1,
            help="Processors to use at once; the answer does not depend on it. Default: all that are there.",
            show_default=False,
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Say whether the model leaves physics out: where it shows, its name and size, and what else it could be."""
    from identify.mismatch.diagnosis import diagnose
    from identify.threads import usable_cores
    from plant.axis_file import read_axis

    described = read_axis(axis)
    data = read_all(recordings or [], described, axis)
    if report is not None:
        from monitor.report_file import check_folder

        check_folder(report)
    with Working("diagnosing", silent=as_json) as progress:
        found = diagnose(data, described, seed=seed, progress=progress.hear, threads=threads or usable_cores())
    if report is not None:
        from monitor.report_file import write_report

        write_report(report, found, described, data)
    if as_json:
        from monitor.cli.output import emit_json

        emit_json(found.to_dict())
    else:
        show_diagnosis(found)
        if report is not None:
            from monitor.cli.output import screen

            screen().print(f"report: {report}")


def read_all(paths: list[Path], axis: Axis, axis_path: Path) -> list[Recording]:
    """The recordings named, or all that the axis file lists.

    Raises:
        InputError: there is none.
    """
    from monitor.cli.output import with_remarks
    from plant.recording_files import read_recording, read_recording_entry

    if paths:
        return with_remarks([read_recording(path, axis) for path in paths])
    if not axis.recordings:
        raise InputError(f"{axis_path}: no [[recording]] is listed; give one: tribowatch diagnose RECORDING --axis ...")
    return with_remarks([read_recording_entry(entry, axis) for entry in axis.recordings])


def show_diagnosis(found: Diagnosis) -> None:
    """Print the finding for people."""
    from monitor.cli.output import make_table, screen, show_interval, show_number

    out = screen()
    out.print(f"{found.axis}: {found.verdict.value.replace('_', ' ')}")
    out.print(found.explanation)
    rows = [
        (
            effect.name if index == 0 else "",
            f"{100 * effect.share:.0f} %" if index == 0 else "",
            name.replace("_", " "),
            show_number(quantity.value),
            show_interval(quantity.ci95),
            quantity.unit,
        )
        for effect in found.effects
        for index, (name, quantity) in enumerate(effect.parameters.items())
    ]
    if rows:
        out.print(make_table(("effect", ">share", "parameter", ">value", "95 % interval", "unit"), rows))
    if found.fit:
        out.print(
            make_table(
                ("squared error, 1 s ahead", ">fitted data", ">unseen data", ">force error, unseen"), _fit_rows(found)
            )
        )
    if found.location is not None:
        low, high = found.location.interval
        coordinate = found.location.coordinate.replace("_", " ")
        both = found.location.coordinate == "direction"
        out.print("where: both directions" if both else f"where: {coordinate} from {low:.4g} to {high:.4g}")
    if found.remaining_force is not None:
        out.print(f"force that stays unexplained: {found.remaining_force.value:.2g} {found.remaining_force.unit}")
    for change in found.changes:
        low, high = change.ci95
        out.print(
            f"changed since commissioning: {change.parameter.replace('_', ' ')} {change.before:.4g} -> "
            f"{change.after:.4g} {change.unit}, by {low:.3g} to {high:.3g}"
        )
    if found.detectable:
        hidden = [(name, f"{h.value:.3g}", h.unit, f"{h.force_rms:.2g}") for name, h in found.detectable.items()]
        out.print(make_table(("would have been seen", ">from", "unit", ">force, rms"), hidden))
    if found.next_experiment:
        out.print(f"to settle the rest: {found.next_experiment}")


def _fit_rows(found: Diagnosis) -> list[tuple[str, str, str, str]]:
    """Criterion on fitted and unseen data, and force error, of both models."""
    from monitor.cli.output import show_number

    rows = []
    for model, pair in found.fit.items():
        error = found.force_error[model].held_out
        shown = "–" if error is None else f"{error:.2f} %"
        rows.append((model, show_number(pair.train, 3), show_number(pair.held_out, 3), shown))
    return rows
