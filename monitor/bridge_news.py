"""What is new in the status of a bridge, in words: one line per change, none for what goes on as before. Pure."""

from __future__ import annotations

from typing import Any

Status = dict[str, Any]


def news(before: Status | None, now: Status) -> list[str]:
    """Lines that say what has changed from one status to the next."""
    lines = _bus(before, now)
    for axis, counted in now["axes"].items():
        lines += [f"{axis}: {line}" for line in _axis(before["axes"][axis] if before else None, counted)]
    return lines


def _bus(before: Status | None, now: Status) -> list[str]:
    lines = []
    bus, was = now["bus"], before["bus"] if before else None
    if was is None or bus["state"] != was["state"]:
        said = f": {bus['last_error']}" if bus["state"] == "lost" and bus["last_error"] else ""
        lines.append(f"bus {bus['interface']} {bus['channel']} is {bus['state']}{said}")
    for key, words in (
        ("errors", "error frames"),
        ("bus_off", "bus-off: a node was taken off the bus; on Linux: ip link set DEV type can restart-ms 100"),
        ("wrong_length", "frames with another length than the layout's"),
    ):
        more = now["frames"][key] - (before["frames"][key] if before else 0)
        if more:
            lines.append(f"{more} {words}")
    new = [key for key in now["frames"]["unknown_ids"] if before is None or key not in before["frames"]["unknown_ids"]]
    if new:
        lines.append(f"ids that no layout names: {', '.join(new)}")
    lost = now["clock"]["syncs_lost"] - (before["clock"]["syncs_lost"] if before else 0)
    if lost:
        lines.append(f"{lost} SYNCs lost")
    if now["clock"]["steps"] > (before["clock"]["steps"] if before else 0) and now["clock"]["offset"]:
        lines.append(f"clock anchored anew: the SYNC count was off by {now['clock']['offset']:.3g} s")
    return lines


def _axis(before: Status | None, now: Status) -> list[str]:
    lines = []
    if now["refused"] and (before is None or before["refused"] != now["refused"]):
        lines.append(f"nothing is sent: {now['refused']}")
    if before is not None and before["refused"] and not now["refused"]:
        lines.append("samples are sent again: what the drive sends fits the layout now")
    if now["suspicion"] and (before is None or not before["suspicion"]):
        lines.append(now["suspicion"])
    for key, words in (("state", "drive is in state"), ("nmt", "node is")):
        if now[key] is not None and (before is None or before[key] != now[key]):
            lines.append(f"{words} {now[key]!r}")
    for key, words in (("lost", "samples lost"), ("boot_ups", "boot-up: the node has started anew")):
        if more := now[key] - (before[key] if before else 0):
            lines.append(f"{more} {words}")
    if more := now["emergencies"] - (before["emergencies"] if before else 0):
        lines.append(f"{more} emergency messages" + (f", {now['last_emergency']}" if now["last_emergency"] else ""))
    return lines
