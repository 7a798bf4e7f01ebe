"""`tribowatch demo`: a machine ages in time-lapse, the daemon notices; live on the screen."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from monitor.cli.options import AsJson
from plant.errors import InputError

DEFAULT_SPEED = 172_800.0  # event seconds per second: two days, four test runs of the machine, each second


def demo_command(
    until_alert: Annotated[
        bool, typer.Option("--until-alert", help="Stop when the daemon has noticed that the machine changed.")
    ] = False,
    duration: Annotated[float | None, typer.Option(help="Stop after so many seconds.", show_default=False)] = None,
    speed: Annotated[float, typer.Option(help="Time-lapse: event seconds per second.")] = DEFAULT_SPEED,
    scenario: Annotated[
        str, typer.Option(help="What happens to the machine: a file, or a name of simulate --list.")
    ] = "wear",
    state_dir: Annotated[
        Path, typer.Option(help="Configuration, history and logs; an earlier demo's history moves to previous/.")
    ] = Path("var/demo"),
    seed: Annotated[int, typer.Option(min=0, help="Seed of the machine's chance and of the searches.")] = 1,
    can: Annotated[
        bool, typer.Option("--can", help="The machine is a CiA 402 drive on a (virtual) CAN bus; a bridge feeds Zenoh.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Watch a simulated axis wear in time-lapse: its stream goes over Zenoh to a daemon, the alert comes back."""
    if not speed > 0:
        raise InputError(f"--speed is {speed:g}, but must be > 0 event seconds per second")
    if duration is not None and not duration > 0:
        raise InputError(f"--duration is {duration:g} s, but must be > 0 s")
    from monitor.cli.demo_screen import Screen
    from monitor.demo_run import DemoSettings, run_demo

    settings = DemoSettings(state_dir, scenario, seed, speed, until_alert, duration, can)
    with Screen(settings, as_json) as screen:
        result = run_demo(settings, screen)
    screen.conclude(result)
    if result["stopped_by"] == "interrupt":
        raise typer.Exit(130)
