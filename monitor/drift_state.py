"""What the watch of one axis is told and what it remembers. Values only; they go through JSON."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

from monitor.baseline import Baseline
from monitor.channels import Seen
from monitor.data_quality import Quality
from monitor.estimate import Curve
from monitor.findings import Kind
from monitor.trend import Block

VERSION = 4  # of what is stored; older states are learned anew


@dataclass(frozen=True, slots=True)
class DriftRule:
    """Settings of the watch; see `config.DriftSection` and `config.AlarmsSection`.

    Attributes:
        baseline_span: time over which the windows of the first baseline are spread at least. [s]
        weight: of the moving mass on a vertical axis whose mass is known, 0 elsewhere. [N]
        limit_rise: relative rise of friction at mid speed that ends the guide's life, for the projection. [1]
    """

    baseline_windows: int = 20
    baseline_span: float = 3 * 86400.0
    min_change: float = 0.03
    jam_rise: float = 0.2
    false_alarms_per_year: float = 1.0
    bad_windows: int = 3
    force_unit: str = "N"
    weight: float = 0.0
    limit_rise: float = 0.5

    @property
    def pace_ns(self) -> int:
        """Least time between windows that are remembered: 1 % less than an even spread, for stamps that jitter. [ns]"""
        return round(0.99e9 * self.baseline_span / max(self.baseline_windows - 1, 1))

    @property
    def speed_unit(self) -> str:
        """m/s, or rad/s on a rotary axis."""
        return "rad/s" if self.force_unit == "N*m" else "m/s"

    @property
    def units(self) -> tuple[str, str, str]:
        """Of force, of its slope over speed, of inertia."""
        rotary = self.force_unit == "N*m"
        return self.force_unit, f"{self.force_unit}*s/{'rad' if rotary else 'm'}", "kg*m^2" if rotary else "kg"


@dataclass(frozen=True, slots=True)
class Step:
    """One window since the baseline: values and standard errors of the channels, and its movers less usual ones."""

    start_ns: int
    end_ns: int
    values: tuple[float | None, ...]
    errors: tuple[float, ...]
    away: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class DriftState:
    """What the watch of one axis remembers; goes through JSON.

    Attributes:
        learned: windows of a baseline in the making.
        offered: windows that could have been among them, since the first of them. [1]
        baseline: None while learning.
        recent: the latest windows, oldest first, a pace apart; the last is the latest of its stretch.
        fresh: of them, those at the end that have refined nothing yet. [1]
        last: epoch, and number after the last sample, of the last window that took a step.
        told: kind of change told at the last step, None while there is none.
        onset_ns: when the change that was told began. [ns]
        before_jam: deviation of mid-speed friction before a jam, None while there is none. [N]
        trend: mid-speed friction relative to the baseline, from the beginning.
        quality: of the data.
        passed_over: informative windows that did not cover the reference speeds; `passed_run` of them in a row. [1]
    """

    learned: tuple[Seen, ...] = ()
    offered: int = 0
    baseline: Baseline | None = None
    recent: tuple[Step, ...] = ()
    fresh: int = 0
    last: tuple[int, int] = (-1, 0)
    told: Kind | None = None
    onset_ns: int = 0
    before_jam: float | None = None
    trend: tuple[Block, ...] = ()
    quality: Quality = Quality()  # noqa: RUF009  # frozen
    passed_over: int = 0
    passed_run: int = 0

    @property
    def windows_kept(self) -> tuple[tuple[int, int, int], ...]:
        """Windows of the baseline, made or in the making: their samples are kept, for the day the model changes."""
        return self.baseline.made_of if self.baseline else tuple(one.window for one in self.learned)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        plain = dataclasses.asdict(dataclasses.replace(self, baseline=None))
        return plain | {"version": VERSION, "baseline": self.baseline.to_dict() if self.baseline else None}

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> DriftState:
        """Read what `to_dict` wrote, through JSON; what an older program wrote is learned anew."""
        if values.get("version") != VERSION:
            return cls()
        learned = tuple(_seen(one) for one in values["learned"])
        recent = tuple(
            Step(one["start_ns"], one["end_ns"], *(tuple(one[name]) for name in ("values", "errors", "away")))
            for one in values["recent"]
        )
        plain = {name: one for name, one in values.items() if name != "version"}
        return cls(
            **plain
            | {
                "learned": learned,
                "recent": recent,
                "baseline": Baseline.from_dict(values["baseline"]) if values["baseline"] else None,
                "last": tuple(values["last"]),
                "told": Kind(values["told"]) if values["told"] else None,
                "trend": tuple((float(a), float(b), float(c)) for a, b, c in values["trend"]),
                "quality": Quality.from_dict(values["quality"]),
            }
        )


def _seen(one: dict[str, Any]) -> Seen:
    others = {name: (float(value), float(error)) for name, (value, error) in one["others"].items()}
    return Seen(**one | {"curve": Curve.from_dict(one["curve"]), "others": others, "window": tuple(one["window"])})
