"""An answer of a re-analysis beside the one in the history: the same, or how far apart. Pure."""

from __future__ import annotations

import collections
import enum
import math
from dataclasses import dataclass, field
from typing import Any

from monitor.query_raw import Answered
from monitor.times import iso

THOUSANDTH = 1e-3  # of the stated 95 % interval: what another kind of processor may differ by
SHOWN = 100  # differing windows listed; all are counted


class Likeness(enum.StrEnum):
    """How alike two answers to one window are."""

    SAME = "same"  # bit for bit: verdict, values, intervals, criteria, curve
    CLOSE = "close"  # same verdict, every value within a thousandth of its stated interval
    MOVED = "moved"  # same verdict, a value beyond that
    VERDICT = "verdict"  # another verdict


def likeness(then: Answered, now: Answered) -> tuple[Likeness, float]:
    """How alike two answers are, and the largest distance of a value, in its own stated intervals' lengths. [1]"""
    if (then.verdict, then.result, then.curve) == (now.verdict, now.result, now.curve):
        return Likeness.SAME, 0.0
    if then.verdict != now.verdict:
        return Likeness.VERDICT, math.inf
    far = _distance(then.result, now.result)
    return (Likeness.CLOSE if far <= THOUSANDTH else Likeness.MOVED), far


def _distance(then: dict[str, Any], now: dict[str, Any]) -> float:
    before, after = then.get("parameters", {}), now.get("parameters", {})
    if set(before) != set(after):
        return math.inf
    far = 0.0
    for name, old in before.items():
        if old["value"] == after[name]["value"]:
            continue
        length = old["ci95"][1] - old["ci95"][0] if old.get("ci95") else 0.0
        far = max(far, abs(after[name]["value"] - old["value"]) / length if length > 0 else math.inf)
    return far


@dataclass(slots=True)
class Tally:
    """What came out for one axis.

    Attributes:
        axis: its name.
        alike: windows by likeness.
        gone: windows whose raw samples the journal holds no more.
        failed: windows that could not be answered now; the next run tries them again.
        farthest: largest distance of a value among those with the same verdict. [1, in interval lengths]
        differing: the first of those that are not the same, in words.
    """

    axis: str
    alike: collections.Counter[str] = field(default_factory=collections.Counter)
    gone: int = 0
    failed: int = 0
    farthest: float = 0.0
    differing: list[dict[str, Any]] = field(default_factory=list)

    def add(self, then: Answered, now: Answered) -> None:
        """Count one window that has both answers."""
        kind, far = likeness(then, now)
        self.alike[kind.value] += 1
        if kind in (Likeness.CLOSE, Likeness.MOVED):
            self.farthest = max(self.farthest, far)
        if kind is not Likeness.SAME and len(self.differing) < SHOWN:
            self.differing.append(_told(then, now, kind, far))

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {
            "axis": self.axis,
            "windows": self.alike.total() + self.gone + self.failed,
            **{kind.value: self.alike[kind.value] for kind in Likeness},
            "raw_gone": self.gone,
            "failed": self.failed,
            "farthest": self.farthest,
            "differing": self.differing,
        }


def _told(then: Answered, now: Answered, kind: Likeness, far: float) -> dict[str, Any]:
    return {
        "end": iso(then.window.end_ns),
        "epoch": then.window.id.epoch,
        "first_seq": then.window.id.first_seq,
        "likeness": kind.value,
        "distance": far,
        "verdict": {"then": then.verdict, "now": now.verdict},
        "reason": {"then": then.reason, "now": now.reason},
        "software": {"then": then.software, "now": now.software},
    }
