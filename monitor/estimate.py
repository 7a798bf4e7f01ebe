"""The answer to one window, as history, drift and subscribers see it. Values only."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from monitor.samples import Window


@dataclass(frozen=True, slots=True)
class Parameter:
    """One friction parameter with its 95 % interval (None where not identifiable)."""

    name: str
    value: float
    unit: str
    low: float | None = None
    high: float | None = None
    identifiable: bool = True
    at_bound: bool = False


@dataclass(frozen=True, slots=True)
class Curve:
    """Friction F(v) averaged over both directions.

    Attributes:
        speeds: from a fixed geometric grid, so that windows share them; somewhat beyond `fastest`. [m/s or rad/s] (k,)
        values: friction. [N or N·m] (k,)
        low, high: 95 % interval; wide where the window did not go. [N or N·m] (k,)
        fastest: highest speed the window visited. [m/s or rad/s]
    """

    speeds: tuple[float, ...]
    values: tuple[float, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    fastest: float

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {name: list(one) if isinstance(one, tuple) else one for name, one in dataclasses.asdict(self).items()}

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Curve:
        """Read what `to_dict` wrote."""
        speeds, force, low, high = (tuple(values[name]) for name in ("speeds", "values", "low", "high"))
        return cls(speeds, force, low, high, values["fastest"])

    def at(self, speeds: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray] | None:
        """Values and standard errors at `speeds`, or None where one lies outside. [N or N·m]"""
        own = np.array(self.speeds)
        wanted = np.array(speeds)
        if len(own) == 0 or wanted.min() < own[0] * (1 - 1e-9) or wanted.max() > own[-1] * (1 + 1e-9):
            return None
        half = (np.array(self.high) - np.array(self.low)) / 2
        return np.interp(wanted, own, self.values), np.interp(wanted, own, half) / 1.96


@dataclass(frozen=True, slots=True)
class Estimate:
    """What identification said about one window.

    Attributes:
        window: which samples, and when. [ns]
        verdict: identified | not_informative | bad_data.
        reason: why not, in words and numbers.
        seconds: what it took. [s]
        conditions: mean temperature [degC], load [kg or 1], speed, travel and unexplained force, where known.
        faults: shares of the samples at fault, by fault; see `data_quality.faults_of`. [1]
        result: the JSON of `tribowatch identify`.
    """

    window: Window
    verdict: str
    reason: str | None
    method: str
    seed: int
    software: str
    data_sha256: str
    result: dict[str, Any]
    criterion: float | None = None
    held_out_criterion: float | None = None
    evaluations: int = 0
    seconds: float = 0.0
    parameters: tuple[Parameter, ...] = ()
    curve: Curve | None = None
    conditions: dict[str, float] = field(default_factory=dict)
    faults: dict[str, float] = field(default_factory=dict)

    def value_of(self, parameter: str) -> float | None:
        """Value of a parameter, None where it was not identified or not identifiable."""
        return next((one.value for one in self.parameters if one.name == parameter and one.identifiable), None)

    @property
    def informative(self) -> bool:
        """Whether drift may learn from it."""
        return self.verdict == "identified" and self.curve is not None
