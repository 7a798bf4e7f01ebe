"""`tribowatch history`: how the friction of one axis changed, from the daemon's database."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from monitor.cli.options import AsCsv, AsJson, ConfigFile, DefaultGroup, StateDir, one_format, open_history

if TYPE_CHECKING:
    from monitor.queries import Reader

FIRST = ("coulomb_force", "static_force", "stribeck_velocity", "viscous_coefficient", "constant_force", "moving_mass")
DETAIL_ROWS = 12  # latest points shown when one parameter is asked for
CSV_HEADER = ("time", "parameter", "unit", "value", "ci95_low", "ci95_high", "min", "max", "answers")


history_app = typer.Typer(
    name="history",
    cls=DefaultGroup,
    help="How the friction of an axis changed, from the daemon's database; without a sub-command: show.",
)


def history_show_command(
    axis: Annotated[str, typer.Argument(help="Name of the axis.")],
    parameter: Annotated[
        str | None, typer.Option(help="Only this parameter, like coulomb_force.", show_default=False)
    ] = None,
    since: Annotated[
        str | None, typer.Option(help="This far back from the axis' latest sample: 7d, 12h, 90min.", show_default=False)
    ] = None,
    begin: Annotated[
        str | None, typer.Option("--from", help="From this time on (UTC), like 2026-03-01.", show_default=False)
    ] = None,
    end: Annotated[str | None, typer.Option("--to", help="Up to this time (UTC).", show_default=False)] = None,
    points: Annotated[int, typer.Option(help="At most so many points per parameter; more are summed up.")] = 500,
    export: Annotated[
        Path | None,
        typer.Option("--export", help="Write every answer, one by one, to this .csv or .parquet.", show_default=False),
    ] = None,
    config: ConfigFile = None,
    state_dir: StateDir = None,
    as_json: AsJson = False,
    as_csv: AsCsv = False,
) -> None:
    """Show the parameters of AXIS over time, with 95 % intervals, gaps and unusable windows."""
    one_format(as_json, as_csv)
    from monitor.times import parse_duration, parse_time

    asked: dict[str, Any] = {
        "parameter": parameter,
        "since_ns": parse_duration(since) if since else None,
        "from_ns": parse_time(begin) if begin else None,
        "to_ns": parse_time(end) if end else None,
    }
    with open_history(config, state_dir) as reader:
        if export is not None:
            _export(reader, axis, asked, export, as_json)
            return
        found = reader.history(axis, **asked, points=points)
    if as_json:
        from monitor.cli.output import emit_json

        emit_json(found)
    elif as_csv:
        from monitor.cli.output import emit_csv

        emit_csv(CSV_HEADER, csv_rows(found))
    else:
        _show(found, detail=parameter is not None)


def _export(reader: Reader, axis: str, asked: dict[str, Any], path: Path, as_json: bool) -> None:
    from monitor.cli.output import emit_json, screen
    from monitor.export_files import export

    rows = export(reader.answers(axis, **asked), path)
    if as_json:
        emit_json({"file": str(path), "rows": rows})
    else:
        screen().print(f"{path}: {rows} rows")


def csv_rows(found: dict[str, Any]) -> list[tuple[Any, ...]]:
    """One row per point, in the order of `CSV_HEADER`; nothing where there is no interval."""
    return [
        (
            point["t"],
            name,
            series["unit"],
            point["value"],
            *(point["ci95"] or ("", "")),
            point["min"],
            point["max"],
            point["answers"],
        )
        for name, series in found["series"].items()
        for point in series["points"]
    ]


def _show(found: dict[str, Any], detail: bool) -> None:
    """Print trends for people."""
    from monitor.cli.output import make_table, screen

    out = screen()
    names = sorted(found["series"], key=lambda name: FIRST.index(name) if name in FIRST else len(FIRST))
    series = {name: found["series"][name] for name in names if found["series"][name]["points"]}
    if not series:
        out.print(
            f"{found['axis']}: nothing was identified in this range; a window that has just come takes some seconds."
        )
    else:
        first = min(one["points"][0]["t"] for one in series.values())
        last = max(one["points"][-1]["t"] for one in series.values())
        answers = max(one["answers"] for one in series.values())
        out.print(f"{found['axis']}: {answers} windows identified, {first[:16]} to {last[:16]} UTC")
        columns = ("parameter", ">latest", "95 % interval", "unit", ">first", "trend")
        out.print(make_table(columns, [_trend(name, one) for name, one in series.items()]))
        if detail:
            for one in series.values():
                out.print(make_table(("time (UTC)", ">value", "95 % interval"), _details(one)))
    for event in found["events"]:
        anew = " (new baseline)" if event["new_baseline"] else ""
        out.print(f"{event['at'][:16]}Z  {event['kind']}: {event['text']}, by {event['author']}{anew}", highlight=False)
    others = {verdict: n for verdict, n in found["verdicts"].items() if verdict != "identified"}
    if others:
        out.print("Without an answer: " + ", ".join(f"{n} {verdict}" for verdict, n in others.items()))
    missing = sum(gap["missing"] for gap in found["gaps"])
    if missing:
        out.print(f"Gaps: {len(found['gaps'])} with {missing} samples that were never received (--json lists them)")


def _trend(name: str, series: dict[str, Any]) -> tuple[str, ...]:
    """One row of the overview."""
    from monitor.cli.output import show_interval, show_number, sparkline

    points = series["points"]
    return (
        name.replace("_", " "),
        show_number(points[-1]["value"]),
        show_interval(points[-1]["ci95"]),
        series["unit"],
        show_number(points[0]["value"]),
        sparkline([point["value"] for point in points]),
    )


def _details(series: dict[str, Any]) -> list[tuple[str, str, str]]:
    """The latest points of one parameter."""
    from monitor.cli.output import show_interval, show_number

    return [
        (point["t"][:19].replace("T", " "), show_number(point["value"]), show_interval(point["ci95"]))
        for point in series["points"][-DETAIL_ROWS:]
    ]
