"""The answer of a diagnosis, in the contract's words."""

from __future__ import annotations

import enum
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from identify.mismatch.experiment import Experiment
    from identify.mismatch.pictures import Pictures

SCHEMA_VERSION = 1


class Verdict(enum.StrEnum):
    """What the recordings say about the baseline model."""

    NO_MISMATCH = "no_mismatch"
    EXPLAINED = "explained"
    UNEXPLAINED = "unexplained"
    INSUFFICIENT_DATA = "insufficient_data"


@dataclass(frozen=True, slots=True)
class Quantity:
    """A number with unit and, where known, its 95 % interval."""

    value: float
    unit: str
    ci95: tuple[float, float] | None = None

    def to_dict(self) -> dict[str, Any]:
        """JSON of the contract."""
        return {"value": self.value, "unit": self.unit, "ci95": None if self.ci95 is None else list(self.ci95)}


@dataclass(frozen=True, slots=True)
class FoundEffect:
    """One named effect: its share of the residual force variance [1], and its parameters.

    Attributes:
        pooled: whether the parameters are the means of what fitted and unseen data tell.
    """

    name: str
    share: float
    parameters: dict[str, Quantity]
    force_rms: float
    pooled: bool = False

    def to_dict(self) -> dict[str, Any]:
        """JSON of the contract."""
        return {
            "name": self.name,
            "share": self.share,
            "parameters": {name: quantity.to_dict() for name, quantity in self.parameters.items()},
            "force_rms": self.force_rms,
        }


@dataclass(frozen=True, slots=True)
class Location:
    """Where the mismatch shows: a coordinate and an interval on it, with its share and calibrated p-value."""

    coordinate: str
    interval: tuple[float, float]
    share: float
    p_value: float
    alternatives: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """JSON of the contract."""
        return {
            "coordinate": self.coordinate,
            "interval": list(self.interval),
            "share": self.share,
            "p_value": self.p_value,
            "alternatives": list(self.alternatives),
        }


@dataclass(frozen=True, slots=True)
class Pair:
    """A figure on the data that were fitted and on those that were not."""

    train: float | None
    held_out: float | None

    def to_dict(self) -> dict[str, float | None]:
        """JSON of the contract."""
        return {"train": self.train, "held_out": self.held_out}


@dataclass(frozen=True, slots=True)
class Hidden:
    """The smallest size of an effect these recordings would have shown: first parameter, and force."""

    value: float
    unit: str
    force_rms: float

    def to_dict(self) -> dict[str, Any]:
        """JSON of the contract."""
        return {"value": self.value, "unit": self.unit, "force_rms": self.force_rms}


@dataclass(frozen=True, slots=True)
class Change:
    """A parameter that differs between commissioning and today; the interval is that of the difference.

    `effect` and `kind` ("appeared", "grown", "shrunk", "gone") say so where it is the strength of a named effect;
    of friction itself they are None and "moved".
    """

    parameter: str
    before: float
    after: float
    unit: str
    ci95: tuple[float, float]
    effect: str | None = None
    kind: str = "moved"

    def to_dict(self) -> dict[str, Any]:
        """JSON of the contract."""
        return {
            "parameter": self.parameter,
            "effect": self.effect,
            "kind": self.kind,
            "before": self.before,
            "after": self.after,
            "unit": self.unit,
            "ci95": list(self.ci95),
        }


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """What the recordings tell about the model; docs/json.md says what each entry means.

    `pictures` are the arrays a report draws; they are not part of the JSON.
    """

    verdict: Verdict
    axis: str
    explanation: str
    effects: tuple[FoundEffect, ...] = ()
    alternatives: tuple[tuple[str, ...], ...] = ()
    location: Location | None = None
    fit: dict[str, Pair] = field(default_factory=dict)
    force_error: dict[str, Pair] = field(default_factory=dict)
    held_out_kind: str = "time"
    run_length: float = 1.0
    remaining_force: Quantity | None = None
    detectable: dict[str, Hidden] = field(default_factory=dict)
    changes: tuple[Change, ...] = ()
    next_experiment: str | None = None
    experiments: tuple[Experiment, ...] = ()
    reason: str | None = None
    seed: int = 0
    data_sha256: str = ""
    preprocessing: tuple[str, ...] = ()
    pictures: Pictures | None = field(default=None, compare=False, repr=False)

    def to_dict(self) -> dict[str, Any]:
        """JSON of the contract."""
        remaining = self.remaining_force
        return {
            "schema_version": SCHEMA_VERSION,
            "verdict": self.verdict.value,
            "reason": self.reason,
            "axis": self.axis,
            "effects": [effect.to_dict() for effect in self.effects],
            "alternatives": [list(names) for names in self.alternatives],
            "location": None if self.location is None else self.location.to_dict(),
            "fit": {model: pair.to_dict() for model, pair in self.fit.items()},
            "force_error": {model: pair.to_dict() for model, pair in self.force_error.items()},
            "held_out_kind": self.held_out_kind,
            "run_length": self.run_length,
            "remaining_force": None if remaining is None else {"value": remaining.value, "unit": remaining.unit},
            "detectable": {name: hidden.to_dict() for name, hidden in self.detectable.items()},
            "changes": [change.to_dict() for change in self.changes],
            "next_experiment": self.next_experiment,
            "experiments": [experiment.to_dict() for experiment in self.experiments],
            "explanation": self.explanation,
            "seed": self.seed,
            "data_sha256": self.data_sha256,
            "preprocessing": list(self.preprocessing),
        }
