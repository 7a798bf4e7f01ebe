"""Which axis needs a person first: one number to sort by, one word to say why. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

PRIORITIES = {"high": 0, "medium": 1, "low": 2}
OPEN = ("unacknowledged", "returned_unacknowledged")
ASIDE = ("shelved", "suppressed", "out_of_service")
NEAR = 0.5  # share of the alarm threshold from which an axis is worth a look


@dataclass(frozen=True, slots=True)
class Urgency:
    """How soon somebody should look.

    Attributes:
        level: 0 first. The fleet is sorted by it.
        word: what to do about it, or how it is.
    """

    level: int
    word: str


def urgency(
    alarms: Iterable[Mapping[str, Any]], *, listed: bool, learned: bool, height: float | None, heard: bool
) -> Urgency:
    """How soon somebody should look at an axis.

    Args:
        alarms: those that are not normal, each with `state` and `priority`.
        listed: whether the configuration names it.
        learned: whether its baseline is complete.
        height: of the highest chart, as a share of its alarm threshold; None where nothing is watched yet. [1]
        heard: whether it has ever sent a sample.
    """
    known = list(alarms)
    standing = [PRIORITIES.get(one["priority"], 1) for one in known if one["state"] == "unacknowledged"]
    if standing:
        rank = min(standing)
        return Urgency(rank, ("act now", "look soon", "not watched")[rank])
    if any(one["state"] in OPEN for one in known):
        return Urgency(3, "came and went")
    if any(one["state"] == "acknowledged" for one in known):
        return Urgency(4, "acknowledged")
    if any(one["state"] in ASIDE for one in known):
        return Urgency(5, "set aside")
    if height is not None and height >= NEAR:
        return Urgency(6, "drifting")
    if not heard:
        return Urgency(7, "never heard")
    if not listed:
        return Urgency(9, "not listed")
    return Urgency(8, "well") if learned else Urgency(7, "learning")
