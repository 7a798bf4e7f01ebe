"""`tribowatch alerts evidence|replay-evidence`: what an alert rests on, as one file, and whether it says so again."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from monitor.cli.options import AsJson, ConfigFile, StateDir, open_history
from plant.errors import InputError


def evidence_command(
    number: Annotated[
        int | None, typer.Argument(help="Number of the evidence; without it, all are listed.", show_default=False)
    ] = None,
    axis: Annotated[str | None, typer.Option("--axis", help="List only that of this axis.", show_default=False)] = None,
    export: Annotated[
        Path | None, typer.Option("--export", help="Write it to this file (zip), to send it.", show_default=False)
    ] = None,
    config: ConfigFile = None,
    state_dir: StateDir = None,
    as_json: AsJson = False,
) -> None:
    """List the evidence kept of alerts, or say what one holds; --export writes it as a single file."""
    if export is not None and number is None:
        raise InputError("--export needs the number of the evidence: tribowatch alerts evidence NUMBER --export FILE")
    with open_history(config, state_dir) as reader:
        if number is None:
            _list(reader.evidence_list(axis), as_json)
            return
        blob = reader.evidence(number)
    from monitor.cli.output import emit_json, screen
    from monitor.evidence import contents

    told = contents(blob)
    if export is not None:
        try:
            export.write_bytes(blob)
        except OSError as error:
            raise InputError(f"{export}: cannot be written: {error.strerror}") from None
    if as_json:
        emit_json({"number": number, "export": str(export) if export else None, **told})
        return
    if export is not None:
        screen().print(f"{export}: {len(blob)} bytes")
    screen().print(told["readme"])


def replay_evidence_command(
    file: Annotated[Path, typer.Argument(help="What alerts evidence --export wrote.")], as_json: AsJson = False
) -> None:
    """Identify and judge the window of FILE again, and say whether the same comes out."""
    try:
        blob = file.read_bytes()
    except OSError as error:
        raise InputError(f"{file}: cannot be read: {error.strerror}") from None
    from monitor.cli.output import emit_json, screen
    from monitor.evidence import unpack
    from monitor.evidence_replay import replay

    told = replay(unpack(blob))
    if as_json:
        emit_json(told)
        return
    screen().print(_words(told))


def _words(told: dict[str, Any]) -> str:
    if told["same"] is None:
        return f"{told['alert']}: {told['why']}"
    if not told["same"]:
        return f"{told['alert']}: NOT the same: " + "; ".join(told["differences"])
    largest = told["largest_parameter_difference"]
    exact = "bit for bit" if told["bit_for_bit"] else f"parameters within {largest:.1e}" if largest else "the same"
    return f"{told['alert']}: the same verdict ({', '.join(told['holding']['now']) or 'nothing'}), {exact}"


def _list(found: list[dict[str, Any]], as_json: bool) -> None:
    from monitor.cli.output import emit_json, make_table, screen, show_time

    if as_json:
        emit_json({"evidence": found})
        return
    rows = [
        (str(one["number"]), one["axis"], one["kind"], show_time(one["at_ns"]), one["sha256"][:12]) for one in found
    ]
    columns = (">number", "axis", "of", "event time (UTC)", "sha256")
    screen().print(make_table(columns, rows) if rows else "No evidence is kept yet.")
