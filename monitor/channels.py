"""The numbers of one window that are watched or that tell causes apart: which, in what unit, how sure. Pure."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from monitor.estimate import Curve, Estimate
from plant.recording import Floats

REFERENCES = 5  # reference speeds, spread over the range the axis visits
MARGIN = 0.75  # of the fastest speed, up to which friction is compared
SLOWER = 1.3  # times the slowest known: an axis that becomes faster knows less of the slow speeds
SHAPES = (
    "friction at low speed",
    "friction between low and mid speed",
    "friction at mid speed",
    "friction between mid and high speed",
    "friction at high speed",
    "Coulomb level",
    "viscous slope",
    "Stribeck rise",
)
UNWATCHED = (SHAPES[1], SHAPES[3])  # they tell shapes apart; watched, they would only share the others' false alarms
PARTS = ("dry part", "viscous part")  # relative change of these parts of friction, from all reference speeds at once
LEAST_PART = 0.25  # of friction at mid speed, against which a part is measured at least: what hardly rubs may change
RIDGE = 1e-3  # of the variances: 20 windows do not know a covariance of five speeds to better
MOVERS: tuple[str, ...] = ("temperature", "load")  # what moves friction without wear, where it is reported
THINNING, USUAL_TEMPERATURE = 0.02, 20.0  # 1/K, degC: oils and greases thin by 1.5-4 % per kelvin (Vogel, Walther)
EXTREME = 150.0  # K from the usual temperature: no sensor of a machine means more
ASYMMETRY, UNEXPLAINED, MASS = "constant force", "unexplained force", "moving mass"
CLEAN = 0.013  # of friction: latent force of a complete model (identify.mismatch), added so that nothing counts twice
DOUBLED = 0.7  # of the logarithm: the unexplained force has doubled


Parts = tuple[tuple[float, ...], ...]  # of each of `PARTS`: weights of the reference speeds, value of the baseline


@dataclass(frozen=True, slots=True)
class Channel:
    """One number.

    Attributes:
        name: one of `SHAPES`, `PARTS`, `ASYMMETRY`, `UNEXPLAINED`, `MASS`, or a parameter of a promoted effect.
        unit: N, N*s/m, ..., 1 for a logarithm.
        scale: change that equals a relative change of 1.
        floor: smallest change worth telling; infinite where it is not watched.
    """

    name: str
    unit: str
    scale: float
    floor: float


@dataclass(frozen=True, slots=True)
class Seen:
    """One informative window as the watch keeps it.

    Attributes:
        start_ns, end_ns: first and last sample. [ns]
        curve: friction over speed.
        others: value and standard error of what is no friction: `ASYMMETRY`, `MASS`, parameters of effects.
        latent: force the model leaves unexplained. [N or N·m]
        conditions: temperature [degC] and load [kg or 1], where reported.
        stribeck_velocity: [m/s or rad/s], None where not known.
        window: epoch, first sample and number of samples.
    """

    start_ns: int
    end_ns: int
    curve: Curve
    others: dict[str, tuple[float, float]]
    latent: float | None
    conditions: dict[str, float]
    stribeck_velocity: float | None = None
    window: tuple[int, int, int] = (0, 0, 0)

    @classmethod
    def of(cls, estimate: Estimate) -> Seen:
        """What to keep of an informative estimate."""
        assert estimate.curve is not None  # informative
        others = {}
        for one in estimate.parameters:
            name = {"constant_force": ASYMMETRY, "moving_mass": MASS}.get(one.name, one.name)
            wanted = name in (ASYMMETRY, MASS) or "." in name
            if wanted and one.identifiable and one.low is not None and one.high is not None:
                others[name] = (one.value, (one.high - one.low) / 2 / 1.96)
        conditions = dict(one for one in estimate.conditions.items() if one[0] in MOVERS)
        window = estimate.window
        latent, v_s = estimate.conditions.get("latent_force"), estimate.value_of("stribeck_velocity")
        number = (window.id.epoch, window.id.first_seq, window.id.samples)
        return cls(window.start_ns, window.end_ns, estimate.curve, others, latent, conditions, v_s, number)


def mover(name: str, value: float) -> float:
    """What friction moves with in proportion: load as it is, temperature as lubricants feel it. [kg or K]

    A lubricant thins by so many percent per kelvin, not by so many newtons: over twenty kelvin a line would be off by a
    fifth of the change. In kelvin at the usual temperature, less and less of them above it.
    """
    if name != "temperature":
        return value
    kelvin = min(max(value - USUAL_TEMPERATURE, -EXTREME), EXTREME)
    return float(-np.expm1(-THINNING * kelvin) / THINNING)


def unmoved(name: str, value: float) -> float:
    """The inverse of `mover`. [kg or degC]"""
    return value if name != "temperature" else USUAL_TEMPERATURE - float(np.log1p(-THINNING * value)) / THINNING


def reference_speeds(curves: list[Curve]) -> tuple[float, ...] | None:
    """Speeds that four of five windows visited, spread on the logarithm; None where fewer than three are shared.

    They end somewhat below the fastest: an axis that wears becomes slower, and must stay comparable.
    """
    curves = [curve for curve in curves if len(curve.speeds) > 0]
    if not curves:
        return None
    low = SLOWER * float(np.quantile([curve.speeds[0] for curve in curves], 0.8, method="higher"))
    high = MARGIN * float(np.quantile([curve.fastest for curve in curves], 0.2, method="lower"))
    widest = max(curves, key=lambda curve: len(curve.speeds)).speeds
    common = [speed for speed in widest if low * (1 - 1e-9) <= speed <= high * (1 + 1e-9)]
    if len(common) < 3:
        return None
    picks = np.linspace(0, len(common) - 1, REFERENCES).round().astype(int)
    return tuple(common[i] for i in picks)


def numbers_of(
    seen: Seen, speeds: tuple[float, ...], extra: tuple[str, ...], parts: Parts
) -> tuple[Floats, Floats] | None:
    """Values and standard errors in the order `SHAPES`, then `extra`, then `parts`; nan where a window tells none.

    None where the window does not cover the reference speeds.
    """
    at = seen.curve.at(speeds)
    if at is None:
        return None
    force, error = at
    design = _line(speeds)
    upper = slice(len(speeds) // 2, None)
    level, slope = design @ force[upper]
    level_error, slope_error = np.sqrt((design**2) @ error[upper] ** 2)
    rise = force[0] - (level + slope * speeds[0])
    values = [*force, level, slope, rise]
    errors = [*error, level_error, slope_error, float(np.hypot(error[0], level_error))]
    for name in extra:
        value, spread = _other(seen, name, float(force[len(force) // 2]))
        values.append(value)
        errors.append(spread)
    for *weights, offset in parts:
        values.append(float(np.dot(weights, force)) - offset)
        errors.append(float(np.mean(error / np.abs(force))))
    return np.array(values), np.array(errors)


def sizes_of(friction: Floats, speeds: tuple[float, ...]) -> tuple[float, float]:
    """What the parts are relative to: friction at no speed and the viscous rise to the highest speed. [N or N·m]"""
    level, slope = _line(speeds) @ friction[len(speeds) // 2 :]
    least = LEAST_PART * float(abs(friction[REFERENCES // 2]))
    return max(float(level), least), max(float(slope) * speeds[-1], least)


def parts_of(friction: Floats, covariance: Floats, speeds: tuple[float, ...]) -> Parts:
    """Matched filters: the weights that see a change of each part best in friction that scatters so.

    Args:
        friction: mean at the reference speeds. (REFERENCES,)
        covariance: of one window about what temperature and load explain. (REFERENCES, REFERENCES)
        speeds: reference speeds.
    """
    known = covariance + np.diag(RIDGE * np.diag(covariance) + (1e-4 * friction) ** 2)
    found = []
    for shape in shapes_of(friction, speeds):
        weights = np.linalg.solve(known, shape)
        weights /= weights @ shape
        found.append((*weights.tolist(), float(weights @ friction)))
    return tuple(found)


def shapes_of(friction: Floats, speeds: tuple[float, ...]) -> Floats:
    """What the whole of each of `PARTS` makes at the reference speeds. (2, REFERENCES)"""
    dry, viscous = sizes_of(friction, speeds)
    return np.stack([dry * np.ones(REFERENCES), viscous * np.array(speeds) / speeds[-1]])


def film_of(friction: Floats, speeds: tuple[float, ...], stribeck_velocity: float) -> Floats:
    """Change of friction when the lubricant becomes thicker, per unit of the logarithm. (REFERENCES,)

    Friction of a film is a function of speed times viscosity (Stribeck 1902): a thicker lubricant is like more speed.
    """
    v = np.array(speeds)
    level, slope = _line(speeds) @ friction[len(speeds) // 2 :]
    rise = friction[0] - (level + slope * v[0])
    return np.asarray(slope * v - rise * v / stribeck_velocity * np.exp((v[0] - v) / stribeck_velocity))


def reactions(speeds: tuple[float, ...], channels: tuple[Channel, ...], parts: Parts) -> Floats:
    """How the numbers answer to friction at the reference speeds, in the order of `channels`. (J, REFERENCES)"""
    lowest = np.eye(REFERENCES)
    line = np.zeros((2, REFERENCES))
    line[:, len(speeds) // 2 :] = _line(speeds)
    rise = lowest[0] - line[0] - speeds[0] * line[1]
    weights = np.array([one[:-1] for one in parts]).reshape(len(parts), REFERENCES)
    others = np.zeros((len(channels) - len(SHAPES) - len(parts), REFERENCES))
    return np.vstack([lowest, line, rise, others, weights])


@functools.lru_cache(maxsize=1024)
def _line(speeds: tuple[float, ...]) -> Floats:
    """Level and slope of friction over the upper half of the speeds, where Stribeck's bump is gone. (2, upper)"""
    upper = np.array(speeds[len(speeds) // 2 :])
    return np.asarray(np.linalg.pinv(np.column_stack([np.ones(len(upper)), upper])), dtype=np.float64)


def _other(seen: Seen, name: str, middle: float) -> tuple[float, float]:
    if name == UNEXPLAINED:
        if seen.latent is None:
            return float("nan"), 0.0
        return float(np.log(max(seen.latent, 0.0) + CLEAN * abs(middle))), 0.0
    return seen.others.get(name, (float("nan"), 0.0))


def lacking(logarithm: float, middle: float) -> float:
    """Unexplained force of the logarithm that is watched; `middle`: friction at mid speed. [N or N·m]."""
    return max(float(np.exp(logarithm)) - CLEAN * abs(middle), 0.0)


def extras_of(windows: list[Seen]) -> tuple[str, ...]:
    """What beside friction nearly all of `windows` tell."""
    names = sorted({name for window in windows for name in window.others})
    if all(window.latent is not None for window in windows):
        names.append(UNEXPLAINED)
    many = 0.9 * len(windows)
    return tuple(
        name for name in names if name == UNEXPLAINED or sum(name in window.others for window in windows) >= many
    )


def channels_of(
    means: Floats, speeds: tuple[float, ...], extra: tuple[str, ...], min_change: float, units: tuple[str, str, str]
) -> tuple[Channel, ...]:
    """The channels, with scales and floors.

    Args:
        means: baseline values in the order of `numbers_of`, which may end before `PARTS`.
        speeds: reference speeds.
        extra: names beside `SHAPES` and `PARTS`.
        min_change: smallest relative change worth telling. [1]
        units: of force, of its slope over speed, of inertia.
    """
    force, slope, inertia = units
    middle = float(abs(means[REFERENCES // 2])) or 1.0
    found = []
    sizes = sizes_of(means[:REFERENCES], speeds)
    for index, name in enumerate((*SHAPES, *extra, *PARTS)):
        scale, unit, floor = middle, force, np.inf
        if index < REFERENCES:
            scale = float(abs(means[index])) or middle
        elif name in PARTS:
            floor, scale, unit = min_change, middle / sizes[PARTS.index(name)], "1"
        elif name == SHAPES[6]:
            scale, unit = middle / speeds[-1], slope
        elif name == UNEXPLAINED:
            scale, unit = 1.0, "1"
        elif name == MASS:
            scale, unit = float(abs(means[index])), inertia
        elif "." in name and not _is_force(name):
            scale, unit = float(abs(means[index])), ""
        if name not in PARTS:
            floor = DOUBLED if name == UNEXPLAINED else min_change * scale
        found.append(Channel(name, unit, scale, float("inf") if name in UNWATCHED else floor))
    return tuple(found)


def _is_force(name: str) -> bool:
    """Parameters of effects that are forces, whose change is measured against friction."""
    return name.split(".")[1] in ("amplitude", "force", "step", "coulomb_difference_half", "stiction_rise")
