"""`tribowatch simulate`: a machine that ages, written to a recording or published in time-lapse."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from monitor.cli.options import ENDPOINT, AsJson, Endpoints, StreamPrefix, StreamSite
from plant.errors import InputError

if TYPE_CHECKING:
    from plant.scenario import Burst, Scenario

SECONDS = {"s": 1.0, "min": 60.0, "h": 3600.0, "d": 86400.0, "w": 604800.0}
DEFAULT_PACE = 5.0  # bursts per second when publishing: half a year at two bursts a day in 72 s


def simulate_command(
    scenario: Annotated[
        str | None,
        typer.Option(help="Scenario file, or the name of one that comes with tribowatch.", show_default=False),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Write a recording: .csv, .csv.gz, .parquet, .mat.", show_default=False)
    ] = None,
    publish: Annotated[bool, typer.Option("--publish", help="Publish the stream on Zenoh instead.")] = False,
    can: Annotated[
        Path | None,
        typer.Option(help="Play a CiA 402 drive on the bus of this bridge file instead.", show_default=False),
    ] = None,
    connect: Endpoints = None,
    site: StreamSite = "plant-1",
    prefix: StreamPrefix = "tribowatch",
    speed: Annotated[
        float | None, typer.Option(help="Time-lapse: event seconds per second, 1 = real time.", show_default=False)
    ] = None,
    bursts_per_second: Annotated[
        float | None,
        typer.Option(help=f"Time-lapse by bursts, instead of --speed (default {DEFAULT_PACE:g}).", show_default=False),
    ] = None,
    at: Annotated[str, typer.Option(help="Begin this long after the scenario's start, like 150d.")] = "0s",
    duration: Annotated[
        str | None,
        typer.Option(
            help="Event time from there, like 20s, 12h, 7d. Default: one burst for --out, all for --publish.",
            show_default=False,
        ),
    ] = None,
    ahead: Annotated[
        int | None,
        typer.Option(
            help="With --publish: wait while more bursts than this have no answer of the daemon yet.",
            show_default=False,
        ),
    ] = None,
    start: Annotated[
        str | None, typer.Option(help="Move the scenario's start (ISO 8601, UTC unless it says).", show_default=False)
    ] = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Replaces the scenario's seed.", show_default=False)] = None,
    write_axis: Annotated[
        Path | None, typer.Option(help="Also write the axis file of the scenario's machine.", show_default=False)
    ] = None,
    list_names: Annotated[bool, typer.Option("--list", help="List the scenarios that come with tribowatch.")] = False,
    as_json: AsJson = False,
) -> None:
    """Simulate an ageing machine: write one recording of it, publish its bursts in time-lapse, or play its drive."""
    if list_names:
        _show_list(as_json)
        return
    if scenario is None or [publish, out is not None, can is not None].count(True) != 1:
        raise InputError(
            "give --scenario FILE or NAME with one of --out RECORDING, --publish, --can BRIDGE (--list shows names)"
        )
    if ahead is not None and (ahead < 1 or not publish):
        raise InputError(f"--ahead is {ahead}, but must be 1 or more, and goes with --publish")
    machine = _load(scenario, seed, start)
    chosen = _choose(machine, at, duration, one_burst=out is not None)
    if write_axis is not None:
        from plant.axis_file import write_axis as write_axis_file

        write_axis_file(machine.axis, write_axis)
    if out is not None:
        result = _write(machine, chosen, out)
    elif can is not None:
        from monitor.cli.simulate_can import play

        with _progress(len(chosen), "playing") as step:
            result = play(machine, chosen, _speed(machine, speed, bursts_per_second), can, step)
    else:
        from monitor.cli.simulate_publish import publish as send
        from plant.keys import samples_key

        pace, key = _speed(machine, speed, bursts_per_second), samples_key(site, machine.axis.name, prefix)
        with _progress(len(chosen), f"publishing {key}") as step:
            result = send(machine, chosen, pace, connect or [ENDPOINT], site, prefix, ahead, step)
    _show(machine, chosen, result, as_json)


def seconds(text: str, option: str) -> float:
    """Read a duration like `20s`, `30min`, `12h`, `7d`, `2w`. [s]

    Raises:
        InputError: anything else.
    """
    match = re.fullmatch(r"\s*(\d+(?:\.\d*)?)\s*(s|min|h|d|w)\s*", text)
    if match is None:
        raise InputError(f"{option} is {text!r}, but must be a number with its unit: 20s, 30min, 12h, 7d or 2w")
    return float(match[1]) * SECONDS[match[2]]


def _load(name: str, seed: int | None, start: str | None) -> Scenario:
    """The scenario with the command line's seed and start."""
    from plant.scenario_file import read_scenario

    machine = read_scenario(name)
    if seed is not None:
        machine = dataclasses.replace(machine, seed=seed)
    if start is not None:
        try:
            moment = datetime.fromisoformat(start)
        except ValueError:
            raise InputError(f"--start is {start!r}, but must be a time like 2026-01-05T06:00:00Z") from None
        moment = moment if moment.tzinfo else moment.replace(tzinfo=UTC)
        machine = dataclasses.replace(machine, bursts=dataclasses.replace(machine.bursts, start=moment))
    return machine


def _choose(machine: Scenario, at: str, duration: str | None, one_burst: bool) -> range:
    """Numbers of the bursts that begin within the time asked for."""
    interval = machine.bursts.interval_hours * SECONDS["h"]
    begin = seconds(at, "--at")
    first = math.ceil(begin / interval - 1e-9)
    if duration is not None:
        last = math.ceil((begin + seconds(duration, "--duration")) / interval - 1e-9)
    else:
        last = first + 1 if one_burst else len(machine)
    chosen = range(first, min(last, len(machine)))
    if not chosen:
        raise InputError(
            f"no burst begins within --duration {duration or 'to the end'} after --at {at}: scenario {machine.name} "
            f"has one every {machine.bursts.interval_hours:g} h for {machine.bursts.days:g} days"
        )
    return chosen


def _speed(machine: Scenario, speed: float | None, bursts_per_second: float | None) -> float:
    """Pace of publishing. [event seconds per second]"""
    from plant.simulator import bursts_per_second_as_speed

    if speed is not None and bursts_per_second is not None:
        raise InputError("--speed and --bursts-per-second exclude each other: choose one")
    if speed is None:
        return bursts_per_second_as_speed(machine, DEFAULT_PACE if bursts_per_second is None else bursts_per_second)
    if not speed > 0:
        raise InputError(f"--speed is {speed:g}, but must be > 0 event seconds per second")
    return speed


def _write(machine: Scenario, chosen: range, out: Path) -> dict[str, Any]:
    """Simulate the bursts and write them as one recording."""
    from plant.recording_files import write_recording
    from plant.scenario import join

    with _progress(len(chosen), "simulating") as step:
        bursts = [step(machine.burst(number)) for number in chosen]
    recording = join(bursts)
    write_recording(recording, out, machine.axis)
    return {
        "out": str(out),
        "samples": len(recording),
        "sha256": recording.sha256(),
        "truth": {**dataclasses.asdict(bursts[0].friction), "temperature": bursts[0].condition.temperature},
    }


@contextmanager
def _progress(total: int, words: str) -> Iterator[Callable[[Burst], Burst]]:
    """A bar on stderr; the function it gives counts one burst and hands it back."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    from monitor.cli.output import screen

    console = screen(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, disable=not console.is_terminal, transient=True) as bar:
        task = bar.add_task(words, total=total)

        def step(burst: Burst) -> Burst:
            bar.advance(task)
            return burst

        yield step


def _show(machine: Scenario, chosen: range, result: dict[str, Any], as_json: bool) -> None:
    """Say what was done."""
    begin = machine.bursts.start + timedelta(seconds=machine.bursts.time(chosen.start))
    summary = {
        "scenario": machine.name,
        "axis": machine.axis.name,
        "seed": machine.seed,
        "first_burst": chosen.start,
        "bursts": len(chosen),
        "of_bursts": len(machine),
        "begin": begin,
        **result,
    }
    from monitor.cli.output import emit_json, screen

    if as_json:
        emit_json(summary)
        return
    out = screen()
    where = next(result[name] for name in ("out", "key", "bus") if name in result)
    bursts = "1 burst" if summary["bursts"] == 1 else f"{summary['bursts']} bursts"
    out.print(
        f"{where}: {bursts} of the {len(machine)} of scenario {machine.name}, {result['samples']} samples "
        f"of {machine.axis.name} from {begin:%Y-%m-%d %H:%M} on, seed {machine.seed}."
    )
    if "truth" in result:
        law = result["truth"]
        out.print(
            f"True friction: F_c {law['coulomb_force']:.4g}, F_s {law['static_force']:.4g} {machine.axis.force_unit}, "
            f"v_s {law['stribeck_velocity']:.4g} {machine.axis.position_unit}/s, F_v {law['viscous_coefficient']:.4g} "
            f"{machine.axis.force_unit}*s/{machine.axis.position_unit}, at {law['temperature']:.1f} degC."
        )


def _show_list(as_json: bool) -> None:
    """Name the scenarios that come with the package."""
    from monitor.cli.output import emit_json, make_table, screen
    from plant.scenario_file import names, read_scenario

    machines = [read_scenario(name) for name in names()]
    if as_json:
        rows = [{"name": m.name, "axis": m.axis.name, "bursts": len(m), "description": m.description} for m in machines]
        emit_json({"scenarios": rows})
        return
    table = [(m.name, m.axis.name, str(len(m)), m.description) for m in machines]
    screen().print(make_table(("scenario", "axis", ">bursts", "what happens"), table))
