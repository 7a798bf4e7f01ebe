"""What is normal for an axis: its numbers over its first healthy windows, what moves them, their scatter. Pure."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from monitor.channels import (
    MOVERS,
    PARTS,
    REFERENCES,
    SHAPES,
    THINNING,
    UNEXPLAINED,
    Channel,
    Parts,
    Seen,
    channels_of,
    extras_of,
    film_of,
    mover,
    numbers_of,
    parts_of,
    reactions,
    reference_speeds,
    shapes_of,
    unmoved,
)
from monitor.glr import YEAR_NS
from monitor.moments import FINEST, LOG_FINEST, PER_KELVIN, PER_LOAD, Fitted, Moments, fitted
from plant.recording import Floats

WANDERING = 0.003  # of the scale: friction of a healthy machine wanders over days (paper, section 5)
FILTERED = 0.02  # of the dry part: so far off the filter of the viscous part expects it, by chance or unseen wandering
STEADY = 0.001  # the same of what is viscous, once the temperature explains how thin the lubricant is
UNTOLD = 4.0  # K, rms: how far a hall leaves the temperature of the baseline, where nobody tells it
FILM = (SHAPES[6], PARTS[1])
LEVEL_WINDOWS = 4  # times the windows of the first baseline: so many more refine the level, then it stands


@dataclass(frozen=True, slots=True)
class Baseline:
    """The learned normal state.

    Attributes:
        windows: how many made the level.
        needed: how many made the first baseline.
        from_ns, to_ns: first and last sample of the windows that made the level. [ns]
        steps_per_year: non-overlapping informative windows, at the cadence of the first baseline. [1/a]
        speeds: reference speeds. [m/s or rad/s] (REFERENCES,)
        stribeck_velocity: median, for the shapes of changes. [m/s or rad/s]
        parts: matched filters, see `channels.parts_of`.
        channels: the numbers, in the order of `channels.numbers_of`.
        movers: which of temperature and load are corrected for.
        ranges: lowest and highest of each of them, as `channels.mover` gives them. (p, 2)
        usual: mean squared standard error of identification, of each number. (J,)
        made_of: the windows of the first baseline, whose raw samples are kept: epoch, first sample, samples.
        moments: sums.
    """

    windows: int
    needed: int
    from_ns: int
    to_ns: int
    steps_per_year: float
    speeds: tuple[float, ...]
    stribeck_velocity: float
    parts: Parts
    channels: tuple[Channel, ...]
    movers: tuple[str, ...]
    ranges: tuple[tuple[float, float], ...]
    usual: tuple[float, ...]
    made_of: tuple[tuple[int, int, int], ...]
    moments: Moments
    fit: Fitted

    def __eq__(self, other: object) -> bool:
        """Equal in everything that is stored."""
        return isinstance(other, Baseline) and self.to_dict() == other.to_dict()

    def __hash__(self) -> int:
        """By the windows it was made of, and what refined it."""
        return hash((self.windows, self.from_ns, self.to_ns, self.moments.dof, self.moments.blocks))

    @property
    def frame(self) -> Frame:
        """What the numbers mean."""
        return Frame(self.speeds, self.stribeck_velocity, self.parts, self.channels, self.movers)

    @property
    def extra(self) -> tuple[str, ...]:
        """Names of what is watched beside friction."""
        return tuple(one.name for one in self.channels[len(SHAPES) : -len(PARTS)])

    @property
    def friction(self) -> Floats:
        """Friction at the reference speeds, at the mean temperature and load of the baseline. [N or N·m]"""
        return self.moments.mean_y[:REFERENCES]

    def away(self, conditions: dict[str, float]) -> Floats:
        """Movers of a window minus the baseline's; one that is not told counts as usual. (p,)"""
        usual = self.moments.mean_x
        found = [
            mover(name, conditions[name]) if name in conditions else usual[i] for i, name in enumerate(self.movers)
        ]
        return np.array(found) - usual

    @property
    def covered(self) -> dict[str, list[float]]:
        """Lowest and highest temperature [degC] and load [kg] of the windows behind slopes and scatter."""
        return {
            name: [unmoved(name, low), unmoved(name, high)]
            for name, (low, high) in zip(self.movers, self.ranges, strict=True)
        }

    def index(self, name: str) -> int | None:
        """Where a channel stands."""
        return next((i for i, one in enumerate(self.channels) if one.name == name), None)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        values = {name: getattr(self, name) for name in self.__dataclass_fields__ if name not in ("moments", "fit")}
        channels = [dataclasses.asdict(one) | {"floor": _finite(one.floor)} for one in self.channels]
        return values | {"channels": channels, "moments": self.moments.to_dict()}

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Baseline:
        """Read what `to_dict` wrote, through JSON."""
        channels = tuple(
            Channel(**{**one, "floor": float("inf") if one["floor"] is None else one["floor"]})
            for one in values["channels"]
        )
        moments = Moments.from_dict(values["moments"])
        lists = {name: tuple(values[name]) for name in ("speeds", "movers", "usual")}
        ranges = tuple((float(low), float(high)) for low, high in values["ranges"])
        lists["parts"] = tuple(tuple(one) for one in values["parts"])
        frame = Frame(lists["speeds"], float(values["stribeck_velocity"]), lists["parts"], channels, lists["movers"])
        fit = _fit(frame, moments, ranges)
        lists["made_of"] = tuple(tuple(one) for one in values["made_of"])
        return cls(**{**values, **lists, "ranges": ranges, "channels": channels, "moments": moments, "fit": fit})


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None


class Frame(NamedTuple):
    """What the numbers of an axis mean; see `Baseline`."""

    speeds: tuple[float, ...]
    stribeck_velocity: float
    parts: Parts
    channels: tuple[Channel, ...]
    movers: tuple[str, ...]

    @property
    def untold(self) -> float:
        """How far the temperature moves the logarithm of the viscosity without our knowledge. [1]"""
        return 0.0 if "temperature" in self.movers else THINNING * UNTOLD

    def film(self, friction: Floats) -> Floats:
        """What that does to friction at the reference speeds. (REFERENCES,)"""
        return self.untold * film_of(friction, self.speeds, self.stribeck_velocity)


def _fit(frame: Frame, moments: Moments, ranges: tuple[tuple[float, float], ...]) -> Fitted:
    channels, movers, friction = frame.channels, frame.movers, moments.mean_y[:REFERENCES]
    scales = np.array([one.scale for one in channels])
    finest = np.array([LOG_FINEST if one.name == UNEXPLAINED else FINEST * one.scale for one in channels])
    heaviest = {name: max(abs(low), abs(high), 1e-9) for name, (low, high) in zip(movers, ranges, strict=True)}
    widths = np.array([PER_KELVIN if name == "temperature" else PER_LOAD / heaviest[name] for name in movers])
    steady = FILM if "temperature" in movers else ()
    usual = np.array([STEADY if one.name in steady else WANDERING for one in channels]) * scales
    answers = reactions(frame.speeds, channels, frame.parts)
    dry, _ = shapes_of(friction, frame.speeds)
    leaks = np.array([WANDERING * (one.name in steady) for one in channels]) * (answers @ dry)  # into the viscous part
    return fitted(moments, scales, finest, widths, np.hypot(usual, leaks), answers @ frame.film(friction))


def learn(
    windows: list[Seen], needed: int, min_change: float, units: tuple[str, str, str] = ("N", "N*s/m", "kg")
) -> Baseline | None:
    """Make the baseline from `windows`, or None while fewer than `needed` share a range of speeds.

    Args:
        windows: identified, non-overlapping, in order of time.
        needed: windows that make a baseline. [1] >= 5
        min_change: smallest relative change worth telling. [1]
        units: of force, of its slope over speed, of inertia.
    """
    speeds = reference_speeds([window.curve for window in windows])
    if speeds is None:
        return None
    covering = [window for window in windows if window.curve.at(speeds) is not None]
    if len(covering) < needed:
        return None
    extra = extras_of(covering)
    told = [(window, numbers) for window in covering if (numbers := numbers_of(window, speeds, extra, ())) is not None]
    whole = [(window, numbers) for window, numbers in told if np.isfinite(numbers[0]).all()]
    if len(whole) < needed:
        return None
    y, s = (np.array([numbers[k] for _, numbers in whole]) for k in (0, 1))
    seen = [window for window, _ in whole]
    movers = tuple(name for name in MOVERS if all(name in window.conditions for window in seen))
    x = np.array([[mover(name, window.conditions[name]) for name in movers] for window in seen]).reshape(
        len(seen), len(movers)
    )
    channels = channels_of(y.mean(axis=0), speeds, extra, min_change, units)
    ranges = tuple((float(column.min()), float(column.max())) for column in x.T)
    known = [window.stribeck_velocity for window in seen if window.stribeck_velocity]
    stribeck_velocity = float(np.median(known)) if known else speeds[len(speeds) // 2] / 2
    frame = Frame(speeds, stribeck_velocity, (), channels[: -len(PARTS)], movers)
    parts = _parts(frame, x, y, ranges)
    frame = Frame(speeds, stribeck_velocity, parts, channels, movers)
    y, s = (np.array([pair[k] for pair in _with_parts(seen, speeds, extra, parts)]) for k in (0, 1))
    moments = Moments.of(x, y)
    first = _fit(frame, moments, ranges)
    moments = moments.with_lags(y - moments.mean_y - (x - moments.mean_x) @ first.slopes)
    begin, end = seen[0], seen[-1]
    return Baseline(
        windows=len(seen),
        needed=needed,
        from_ns=begin.start_ns,
        to_ns=end.end_ns,
        steps_per_year=(len(seen) - 1) / max(end.end_ns - begin.end_ns, 1) * YEAR_NS,
        speeds=speeds,
        stribeck_velocity=stribeck_velocity,
        parts=parts,
        channels=channels,
        movers=movers,
        ranges=ranges,
        usual=tuple(np.mean(s**2, axis=0).tolist()),
        made_of=tuple(window.window for window in seen),
        moments=moments,
        fit=_fit(frame, moments, ranges),
    )


def _parts(frame: Frame, x: Floats, y: Floats, ranges: tuple[tuple[float, float], ...]) -> Parts:
    """Matched filters from the scatter of the first windows, and what they cannot have seen of it yet."""
    moments = Moments.of(x, y)
    fit = _fit(frame, moments, ranges)
    friction = moments.mean_y[:REFERENCES]
    residuals = (y - moments.mean_y - (x - moments.mean_x) @ fit.slopes)[:, :REFERENCES]
    dry, film = FILTERED * shapes_of(friction, frame.speeds)[0], frame.film(friction)
    covariance = residuals.T @ residuals / max(moments.dof, 1) + np.outer(dry, dry) + np.outer(film, film)
    return parts_of(friction, covariance, frame.speeds)


def _with_parts(
    windows: list[Seen], speeds: tuple[float, ...], extra: tuple[str, ...], parts: Parts
) -> list[tuple[Floats, Floats]]:
    found = [numbers_of(window, speeds, extra, parts) for window in windows]
    return [one for one in found if one is not None]


def refined(baseline: Baseline, x: Floats, y: Floats, end_ns: int) -> Baseline:
    """The baseline with a block of later healthy windows x (n, p), y (n, J): level for a while, slopes for good."""
    block = Moments.of(x, y)
    residuals = y - baseline.moments.mean_y - (x - baseline.moments.mean_x) @ baseline.fit.slopes
    block = block.with_lags(residuals - residuals.mean(axis=0))
    block = dataclasses.replace(block, blocks=1, wandered=_beyond_scatter(baseline, residuals))
    ranges = tuple(
        (min(low, float(column.min())), max(high, float(column.max())))
        for (low, high), column in zip(baseline.ranges, x.T, strict=True)
    )
    young = baseline.windows < LEVEL_WINDOWS * baseline.needed
    moments = baseline.moments.joined(block) if young else baseline.moments.beside(block)
    return dataclasses.replace(
        baseline,
        windows=moments.n,
        to_ns=end_ns if young else baseline.to_ns,
        ranges=ranges,
        moments=moments,
        fit=_fit(baseline.frame, moments, ranges),
    )


def wandered(baseline: Baseline, residuals: Floats) -> Baseline:
    """The baseline that has seen the axis go as far as `residuals` (n, J) and come back; nothing else is learned."""
    moments = baseline.moments
    known = np.nan_to_num(residuals, nan=0.0)
    seen = moments.wandered + np.maximum(_beyond_scatter(baseline, known), 0.0)
    moments = dataclasses.replace(moments, blocks=moments.blocks + 1, wandered=seen)
    fit = _fit(baseline.frame, moments, baseline.ranges)
    return dataclasses.replace(baseline, moments=moments, fit=fit)


def _beyond_scatter(baseline: Baseline, residuals: Floats) -> Floats:
    """Squared mean of residuals (n, J), less what scatter alone would make. (J,)"""
    fit, off = baseline.fit, residuals.mean(axis=0)
    alone = fit.variance * (1 + fit.correlation) / (1 - fit.correlation)
    return np.asarray(off**2 - alone * (1 / len(residuals) + 1 / baseline.windows), dtype=np.float64)
