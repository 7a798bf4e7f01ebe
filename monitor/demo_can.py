"""The demo over CAN: a bus of datagrams that do not leave this computer, a drive on it, a bridge. Does I/O."""

from __future__ import annotations

import contextlib
import json
import random
from collections.abc import Iterator
from pathlib import Path

from monitor.demo_processes import SITE, Child, Place, endpoint, running
from plant.bridge_file import read_bridge
from plant.bus_can import carries_frames
from plant.errors import ReachError
from plant.scenario_file import read_scenario

BRIDGE = "bridge.toml"
GROUP = "239.74.163.2"  # administratively scoped; with hop_limit 0 it stays on this host
PORTS = (20_000, 40_000)  # multicast needs no free port, but two demos must not share a bus
WAIT = 30.0  # s for the bridge to open its bus


@contextlib.contextmanager
def can_bridge(place: Place, port: int) -> Iterator[Child]:
    """The bridge, ended on leaving; it has opened its bus when this returns.

    Raises:
        ReachError: the bus cannot be had; says why.
    """
    _write_bridge(place, port)
    settings = read_bridge(place.folder / BRIDGE)
    if not carries_frames(settings.can.interface, settings.can.channel, settings.options):
        raise ReachError(
            f"datagrams to {GROUP} do not come back to this computer: the demo's CAN bus needs IP multicast "
            "(a network with a default route, or: ip route add 239.0.0.0/8 dev lo); leave --can out"
        )
    child = Child("bridge", ["bridge", "--config", BRIDGE], place.folder)
    with running(child):
        _wait_for(child)
        yield child


def _wait_for(child: Child) -> None:
    import time

    deadline = time.monotonic() + WAIT
    while " bus " not in child.log.read_text(errors="replace"):
        child.check()
        if time.monotonic() > deadline:
            raise ReachError(f"the bridge of the demo does not open its bus (log: {child.log})")
        time.sleep(0.05)


@contextlib.contextmanager
def can_machine(place: Place) -> Iterator[Child]:
    """The simulated drive on the bus, ended on leaving."""
    scenario = place.scenario
    path = Path(scenario).resolve()
    arguments = ["simulate", "--scenario", str(path) if path.is_file() else scenario, "--can", BRIDGE]
    arguments += ["--seed", str(place.seed), "--speed", repr(place.speed)]
    with running(Child("machine", arguments, place.folder)) as child:
        yield child


def _write_bridge(place: Place, port: int) -> None:
    """A bridge file for the demo's axis."""
    scenario = read_scenario(place.scenario)
    axis, period = scenario.axis, scenario.burst(0).recording.period
    channels = 'pdo = [{ objects = ["6041:16", "6064:32", "6077:16"] }]'
    if scenario.burst(0).recording.temperature is not None:
        channels = channels[:-1] + ', { objects = ["2033:16:temperature"] }]'
    resolution = axis.sensor.position_resolution or 1e-6
    rated = "" if axis.drive.rated_force is not None else "rated_torque = 8.0\n"
    (place.folder / BRIDGE).write_text(
        f"""\
# written by tribowatch demo --can
name = "can-demo"
site = "{SITE}"

[zenoh]
connect = {json.dumps([endpoint(port)])}

[can]
interface = "udp_multicast"
channel = "{GROUP}"
options = {{ port = {random.SystemRandom().randrange(*PORTS)}, hop_limit = 0 }}
silence = 60.0

[time]
period = {period!r}
origin = "time_object"

[[axis]]
file = "{axis.name}.toml"
node = 1
counts_per_unit = {1.0 / resolution!r}
{rated}{channels}
""",
        encoding="utf-8",
    )
