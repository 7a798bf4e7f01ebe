"""Alerts that belong together: one fault seen on many axes, or many alerts of one axis. Pure."""

from __future__ import annotations

import collections
from typing import Any

from monitor.times import UNITS

MANY = 3  # axes with the same kind of alert, from which on one cause is likelier than a coincidence
TOGETHER_NS = 10 * UNITS["min"]  # between one such alert and the next
ORDER = ("high", "medium", "low")


def groups_of(alerts: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Group alerts: first those of one kind that rose on `MANY` axes at about the same time, the rest by axis.

    Returns:
        Per group what it is about in words, its most urgent priority, and the ids of its alerts, the most urgent group
        first.
    """
    groups, taken = [], set()
    by_kind = collections.defaultdict(list)
    for one in alerts:
        by_kind[one["kind"]].append(one)
    for kind, members in by_kind.items():
        for run in _runs(sorted(members, key=lambda one: int(one["since_ns"]))):
            axes = sorted({one["axis"] for one in run})
            if len(axes) >= MANY:
                groups.append(_group(f"{kind} on {len(axes)} axes at the same time", axes, run))
                taken |= {one["id"] for one in run}
    by_axis = collections.defaultdict(list)
    for one in alerts:
        if one["id"] not in taken:
            by_axis[one["axis"]].append(one)
    groups += [_group(axis, [axis], members) for axis, members in by_axis.items()]
    return sorted(groups, key=lambda one: ORDER.index(one["priority"]))


def _runs(members: list[dict[str, Any]]) -> list[list[dict[str, Any]]]:
    runs: list[list[dict[str, Any]]] = []
    for one in members:
        if runs and int(one["since_ns"]) - int(runs[-1][-1]["since_ns"]) <= TOGETHER_NS:
            runs[-1].append(one)
        else:
            runs.append([one])
    return runs


def _group(about: str, axes: list[str], members: list[dict[str, Any]]) -> dict[str, Any]:
    priority = min((one["priority"] for one in members), key=ORDER.index)
    return {"about": about, "priority": priority, "axes": axes, "alerts": [one["id"] for one in members]}
