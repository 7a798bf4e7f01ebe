"""What `tribowatch doctor --bridge` looks at: the bridge file, the bus, the daemon, the bridge at work. Does I/O."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from monitor.doctor import LINK_TIMEOUT, Check, Outcome
from plant.errors import InputError, TribowatchError

if TYPE_CHECKING:
    import zenoh

    from plant.bridge_settings import BridgeSettings

LISTEN = 2.0  # s: twice the pause between two statuses, and many SYNCs


def check_bridge(path: Path) -> Iterator[Check]:
    """Check the file, then listen to the bus as the bridge would, then to the bridge."""
    from plant.bridge_file import read_bridge

    try:
        settings = read_bridge(path)
    except InputError as error:
        yield Check("bridge file", Outcome.BAD_INPUT, str(error))
        return
    words = "; ".join(settings.remarks) or f"{len(settings.layouts)} axes on {settings.can.interface}"
    yield Check("bridge file", Outcome.WARNING if settings.remarks else Outcome.OK, words)
    yield check_bus(settings)
    yield from check_bridge_links(settings)


def check_bus(settings: BridgeSettings) -> Check:
    """Whether the bus can be opened, and which of the listed frames come."""
    from plant.bus_can import BusReader

    can = settings.can
    if can.interface == "virtual":
        return Check("bus", Outcome.WARNING, "a virtual bus lives within one process: nothing to be heard from here")
    try:
        with BusReader(can.interface, can.channel, bitrate=can.bitrate, options=settings.options) as reader:
            time.sleep(LISTEN)
            keys = {frame[1] for frame in reader.take()}
    except InputError as error:
        return Check("bus", Outcome.BAD_INPUT, str(error))
    except TribowatchError as error:
        return Check("bus", Outcome.OUT_OF_REACH, str(error))
    silent = [one.axis for one in settings.layouts if not all(frame.key in keys for frame in one.frames)]
    heard = f"{can.interface} {can.channel}: {len(keys)} ids within {LISTEN:g} s"
    if silent:
        return Check("bus", Outcome.WARNING, f"{heard}; frames are missing of {', '.join(silent)}")
    return Check("bus", Outcome.OK, f"{heard}, all frames of {len(settings.layouts)} axes")


def check_bridge_links(settings: BridgeSettings) -> Iterator[Check]:
    """Whether the daemon is there, and what the bridge says of itself."""
    from plant.zenoh_session import open_session

    try:
        session = open_session("client", connect=settings.zenoh.connect, timeout=LINK_TIMEOUT)
    except TribowatchError as error:
        yield Check("bridge to daemon", Outcome.OUT_OF_REACH, str(error))
        return
    with session:
        yield Check("bridge to daemon", Outcome.OK, f"connected to {', '.join(settings.zenoh.connect)}")
        name, status = f"bridge {settings.name}", _status(session, settings)
        if status is None:
            words = "no status within some seconds: start tribowatch bridge --config FILE"
            yield Check(name, Outcome.OUT_OF_REACH, words)
            return
        try:
            yield _told(name, status)
        except (AttributeError, TypeError, ValueError):
            yield Check(name, Outcome.WARNING, "its status cannot be read: is it of another version?")


def _status(session: zenoh.Session, settings: BridgeSettings) -> dict[str, Any] | None:
    """The next status of the bridge, None where none comes."""
    from plant.keys import bridge_key

    heard, there = [], threading.Event()

    def hear(sample: zenoh.Sample) -> None:
        heard.append(sample.payload.to_bytes())
        there.set()

    with session.declare_subscriber(bridge_key(settings.site, settings.name, settings.zenoh.prefix), hear):
        there.wait(LISTEN + settings.block.status)
    try:
        status = json.loads(heard[-1]) if heard else None
    except ValueError:
        return None
    return status if isinstance(status, dict) and isinstance(status.get("axes"), dict) else None


def _told(name: str, status: dict[str, Any]) -> Check:
    """What the bridge says of itself."""
    refused = [f"{axis}: {one['refused']}" for axis, one in status["axes"].items() if one.get("refused")]
    if refused:
        return Check(name, Outcome.WARNING, "; ".join(refused))
    sent = sum(int(one.get("sent", 0)) for one in status["axes"].values())
    lost = sum(int(one.get("lost", 0)) for one in status["axes"].values())
    state = status.get("bus", {}).get("state")
    words = f"at work for {status.get('seconds', 0):.0f} s, bus {state}, {sent} samples sent, {lost} lost"
    return Check(name, Outcome.OK if state == "active" and not lost else Outcome.WARNING, words)
