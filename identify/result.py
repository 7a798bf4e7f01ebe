"""The answer to one window: verdict, parameters with intervals, friction curve with its band."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from identify.uncertainty import Uncertainty

Floats = NDArray[np.float64]

SCHEMA_VERSION = 1


class Verdict(enum.StrEnum):
    """What one window could tell."""

    IDENTIFIED = "identified"
    NOT_INFORMATIVE = "not_informative"
    BAD_DATA = "bad_data"


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter with its 95 % interval; None where the window does not tell it.

    `hint` then says why, and which motion would inform it.
    """

    name: str
    value: float
    unit: str
    ci95: tuple[float, float] | None
    identifiable: bool
    at_bound: bool = False
    hint: str | None = None

    def to_dict(self) -> dict[str, Any]:
        """JSON of the contract."""
        return {
            "value": self.value,
            "unit": self.unit,
            "ci95": None if self.ci95 is None else list(self.ci95),
            "identifiable": self.identifiable,
            "at_bound": self.at_bound,
            "hint": self.hint,
        }


@dataclass(frozen=True, slots=True, eq=False)
class FrictionCurve:
    """Friction F(v) averaged over both directions, known far better than the single parameters.

    F_c, F_s, v_s and F_v trade off along a flat valley; their sum at a speed the axis visited does not.

    Attributes:
        x: scaled F_c, F_s, log v_s, F_v. (4,)
        force, speed: what scales them. [N], [m/s]
        fastest: highest speed the recording visited; beyond it the curve is a guess. [m/s]
        uncertainty: of x.
        others: scaled parameters (4,) that fit about as well, with their uncertainty; the band holds them too.
    """

    x: Floats
    force: float
    speed: float
    fastest: float
    uncertainty: Uncertainty
    others: tuple[tuple[Floats, Uncertainty], ...] = ()

    def at(self, speeds: ArrayLike) -> tuple[Floats, Floats]:
        """Friction and the half-width of its 95 % interval at `speeds` > 0 [m/s]. [N] (k,) each."""
        u = np.asarray(speeds, dtype=np.float64) / self.speed
        value, half = _friction(self.x, self.uncertainty, u)
        for x, spread in self.others:
            other, other_half = _friction(x, spread, u)
            half = np.maximum(half, np.abs(other - value) + other_half)
        return value * self.force, half * self.force

    def to_dict(self, points: int = 12) -> dict[str, list[Any]]:
        """JSON: speeds from a fiftieth of the fastest to the fastest, friction, and its interval."""
        speeds = self.fastest * np.geomspace(0.02, 1.0, points)
        force, half = self.at(speeds)
        ci95 = np.stack([force - half, force + half], axis=1)
        return {"speed": speeds.tolist(), "force": force.tolist(), "ci95": ci95.tolist()}


def _friction(x: Floats, spread: Uncertainty, u: Floats) -> tuple[Floats, Floats]:
    """Scaled friction of x (4,) and its half-width at scaled speeds u (k,)."""
    v_s = np.exp(x[2])
    bump = np.exp(-u / v_s)
    value = x[0] + (x[1] - x[0]) * bump + x[3] * u
    gradient = np.stack([1.0 - bump, bump, (x[1] - x[0]) * bump * u / v_s, u], axis=1)
    return value, spread.half_widths(gradient)


@dataclass(frozen=True, slots=True, eq=False)
class IdentificationResult:
    """What one window says about friction.

    Attributes:
        verdict: identified, not_informative or bad_data.
        reason: why not, in words and numbers; None when identified.
        axis: its name.
        parameters: by name; empty for bad data.
        criterion: eq. (4) over one-second free runs; over one free run where that is what was minimised. [1]
        held_out_criterion: the same on the last 40 %, fitted on the rest. [1]
        method: "ga+polish" or "paper".
        evaluations: candidate simulations spent.
        seed: of the search.
        samples: used for the fit, after averaging; `start` and `end` are their time stamps. [s]
        curve: friction curve with its band; None where nothing was identified.
        observer: correlation time [s] and strength [1/s²] of the latent force the fit settled on.
        preprocessing: what was averaged or left out, in words.
        latent_force: force the observer had to supply, what the model leaves unexplained. [N or N·m]
    """

    verdict: Verdict
    reason: str | None
    axis: str
    parameters: dict[str, Parameter]
    criterion: float | None
    held_out_criterion: float | None
    method: str
    evaluations: int
    seed: int
    samples: int
    start: float
    end: float
    curve: FrictionCurve | None = None
    observer: tuple[float, float] | None = None
    preprocessing: tuple[str, ...] = ()
    latent_force: float | None = None

    def curve_at(self, speeds: ArrayLike) -> tuple[Floats, Floats]:
        """Friction over both directions and its 95 % half-width at `speeds` [m/s]; nan without a curve. [N]."""
        if self.curve is None:
            nothing = np.full(np.shape(speeds), np.nan)
            return nothing, nothing
        return self.curve.at(speeds)

    def to_dict(self) -> dict[str, Any]:
        """JSON of the contract (docs/json.md)."""
        return {
            "schema_version": SCHEMA_VERSION,
            "verdict": self.verdict.value,
            "reason": self.reason,
            "axis": self.axis,
            "parameters": {name: parameter.to_dict() for name, parameter in self.parameters.items()},
            "criterion": self.criterion,
            "held_out_criterion": self.held_out_criterion,
            "method": self.method,
            "evaluations": self.evaluations,
            "seed": self.seed,
            "window": {"samples": self.samples, "start": self.start, "end": self.end},
            "friction_curve": None if self.curve is None else self.curve.to_dict(),
            "observer": None if self.observer is None else dict(zip(("tau", "rho"), self.observer, strict=True)),
            "preprocessing": list(self.preprocessing),
            "latent_force": self.latent_force,
        }
