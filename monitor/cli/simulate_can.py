"""`tribowatch simulate --can`: the machine as a drive on a CAN bus."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from plant.scenario import Burst, Scenario


def play(
    machine: Scenario, chosen: range, speed: float, bridge: Path, step: Callable[[Burst], object]
) -> dict[str, Any]:
    """Play the `chosen` bursts on the bus of the `bridge` file; `step` is told each."""
    from plant.bridge_file import read_bridge
    from plant.drive_can import play_scenario

    settings = read_bridge(bridge)
    played = play_scenario(machine, settings, speed=speed, first=chosen.start, last=chosen.stop, on_burst=step)
    return {"bus": f"{settings.can.interface} {settings.can.channel}", "speed": speed, **dataclasses.asdict(played)}
