"""`tribowatch alerts kpi`: how good the alarms are, by the figures of ISA-18.2."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from monitor.cli.options import AsJson, ConfigFile, StateDir, open_history


def kpi_command(
    axis: Annotated[str | None, typer.Argument(help="Only of this axis.", show_default=False)] = None,
    since: Annotated[str, typer.Option(help="This far back from the latest sample, like 30d.")] = "30d",
    config: ConfigFile = None,
    state_dir: StateDir = None,
    as_json: AsJson = False,
) -> None:
    """Say how often alarms rose, which chatter, stand too long or come most often, and how fast they were seen."""
    from monitor.times import parse_duration

    with open_history(config, state_dir) as reader:
        found = reader.alarm_figures(axis, since_ns=parse_duration(since))
    from monitor.cli.output import emit_json, make_table, screen

    if as_json:
        emit_json(found)
        return
    out = screen()
    out.print(f"{axis or 'All axes'}, {found['from'][:16]} to {found['to'][:16]} UTC ({found['days']:.3g} days)")
    out.print(make_table(("figure", ">value", "target (ISA-18.2)"), _rows(found)))
    for title, name in (("Bad actors", "bad_actors"), ("Chattering", "chattering"), ("Standing too long", "stale")):
        if found[name]:
            listed = ", ".join(f"{one['axis']} {one['kind']}{_amount(one)}" for one in found[name])
            out.print(f"{title}: {listed}")


def _amount(one: dict[str, Any]) -> str:
    return f" ({one['raised']}x)" if "raised" in one else f" ({one['days']:.3g} days)"


def _rows(found: dict[str, Any]) -> list[tuple[str, str, str]]:
    targets, waits = found["targets"], found["hours_to_acknowledge"]
    mixed = ", ".join(f"{name} {share:.0%}" for name, share in found["priorities"].items())
    wanted = ", ".join(f"{name} {share:.0%}" for name, share in targets["priorities"].items())
    return [
        ("raised", str(found["raised"]), ""),
        ("raised per day", f"{found['per_day']:.3g}", f"at most {targets['per_day']:g}"),
        ("most in ten minutes", str(found["peak_per_ten_minutes"]), f"at most {targets['peak_per_ten_minutes']}"),
        ("time in flood", f"{found['flood_share']:.2%}", f"at most {targets['flood_share']:.0%}"),
        ("share of the ten most frequent", f"{found['top_share']:.0%}", f"at most {targets['top_share']:.0%}"),
        ("chattering", str(len(found["chattering"])), str(targets["chattering"])),
        ("standing now", str(found["standing"]), ""),
        ("standing longer than a day", str(len(found["stale"])), f"at most {targets['stale']}"),
        ("by priority", mixed, wanted),
        ("hours to acknowledgement, median", f"{waits['median']:.3g}" if waits else "none yet", ""),
        ("never acknowledged", str(found["never_acknowledged"]), ""),
        ("put aside", ", ".join(f"{name} {n}" for name, n in found["put_aside"].items()) or "0", ""),
    ]
