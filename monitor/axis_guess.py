"""What a recording itself says of its axis: which column is what, in which unit, and rough constants. Pure."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from identify.audit_fit import finest_step, fit
from plant.axis import STANDARD_GRAVITY, Axis, Mechanics, Orientation
from plant.recording import Floats, Recording

# our name: (words of a column's name, best first; words that speak against it)
_WORDS: Mapping[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "t": (("t", "time", "timestamp", "stamp", "zeit"), ("temp", "torque")),
    "position": (("position", "pos", "posn", "angle", "y", "x", "q", "qm", "actual"), ("ref", "cmd", "set", "target")),
    "torque": (("torque", "tau", "moment", "drehmoment", "current", "amps", "iq"), ("rated", "limit", "max")),
    "force": (("force", "f", "kraft", "thrust"), ("rated", "limit", "pulse")),
    "velocity": (("velocity", "vel", "speed", "omega", "v"), ("ref", "cmd", "set", "target")),
    "temperature": (("temperature", "temp"), ()),
    "load": (("load", "payload"), ()),
}
_UNITS: Mapping[str, Mapping[str, float]] = {
    "t": {"s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9},
    "position": {"m": 1.0, "mm": 1e-3, "um": 1e-6, "cm": 1e-2, "rad": 1.0, "mrad": 1e-3, "deg": math.pi / 180},
    "torque": {"nm": 1.0, "mnm": 1e-3, "knm": 1e3, "ncm": 1e-2},
    "force": {"n": 1.0, "kn": 1e3, "mn": 1e-3},
}
FEWEST_LEVELS = 20  # a relay has two or three, which says nothing about resolution
_ROTARY_UNITS = ("rad", "mrad", "deg", "rev")
_ANGLES = ("angle", "rad", "deg", "joint", "theta", "phi")


@dataclass(frozen=True, slots=True)
class ColumnGuess:
    """Which column of a file is which channel, and in which unit its name says it is.

    Attributes:
        columns: our name -> the file's.
        scale: our name -> factor to SI, where it is not 1.
        current: the drive's column holds amperes: its scale is the torque constant [N*m/A], which nobody can guess.
        rotary: the position's name speaks of an angle.
    """

    columns: Mapping[str, str] = field(default_factory=dict)
    scale: Mapping[str, float] = field(default_factory=dict)
    current: bool = False
    rotary: bool = False


def guess_columns(names: Sequence[str], given: Mapping[str, str] | None = None) -> ColumnGuess:
    """Match column names with channels; `given` is believed."""
    columns = dict(given or {})
    for ours in ("t", "position", "force", "torque", "velocity", "temperature", "load"):
        drive_known = ours in ("torque", "force") and ("torque" in columns or "force" in columns)
        if ours in columns or drive_known:
            continue
        free = [name for name in names if name not in columns.values()]
        best = max(free, key=lambda name: _likeness(ours, name), default=None)
        if best is not None and _likeness(ours, best) > 0:
            columns[ours] = best
    scale = {ours: factor for ours, name in columns.items() if (factor := _unit_factor(ours, name)) not in (None, 1.0)}
    drive = columns.get("torque", "").lower()
    words = _split(columns.get("position", ""))
    return ColumnGuess(
        columns={ours: columns[ours] for ours in _WORDS if ours in columns},
        scale={ours: factor for ours, factor in scale.items() if factor is not None},
        current=any(word in ("current", "amps", "a", "iq", "ma") for word in _split(drive)),
        rotary=any(word in _ANGLES or word in _ROTARY_UNITS for word in words),
    )


def _split(name: str) -> list[str]:
    return [word for word in re.split(r"[^a-z0-9]+", re.sub(r"([a-z])([A-Z])", r"\1_\2", name).lower()) if word]


def _likeness(ours: str, name: str) -> float:
    """How much a column's name says that it is channel `ours`; 0 for not at all."""
    words = _split(name)
    meant, against = _WORDS[ours]
    if any(word in against for word in words):
        return 0.0
    said = [word for k, word in enumerate(words) if word in meant and (len(word) > 1 or k == 0)]  # control_V is volts
    score = max((1.0 - 0.05 * meant.index(word) for word in said), default=0.0)
    score += 0.1 * any(word in ("feedback", "actual", "measured", "unwrapped") for word in words) if score else 0.0
    score -= 0.3 * any(word in ("cmd", "command", "set", "ref", "target") for word in words) if score else 0.0
    return score - 0.01 * len(words) if score else 0.0


def _unit_factor(ours: str, name: str) -> float | None:
    """Factor to SI by the unit at the end of a column's name."""
    head, _, unit = re.sub(r"[^A-Za-z0-9]+", " ", name).strip().rpartition(" ")
    return _UNITS.get(ours, {}).get(unit.lower()) if head else None


@dataclass(frozen=True, slots=True)
class Constants:
    """Rough constants of an axis, from how it moved.

    Attributes:
        orientation: vertical where the force carries a weight that fits the inertia.
        inertia: force per acceleration, on a vertical axis the mass that weighs; None where the recording does not say.
            [kg; kg·m² rotary]
        sample_time: median step. [s]
        travel: range of the position seen. [m or rad]
        position_resolution: step of the position, 0 where it has none. [m or rad]
        force_resolution: step of the force at the belt, 0 where it has none. [N or N·m]
    """

    orientation: Orientation
    inertia: float | None
    sample_time: float
    travel: tuple[float, float]
    position_resolution: float
    force_resolution: float


def guess_constants(recording: Recording, *, rotary: bool) -> Constants:
    """Estimate what the axis file needs from a recording in SI."""
    good = np.isfinite(recording.position) & np.isfinite(recording.force)
    result = fit(recording)
    mass = result.mass if result is not None and result.mass > 4 * result.mass_error else None
    weight = result.constant if result is not None and math.isfinite(result.constant_error) else 0.0
    carries = mass is not None and 0.6 < weight / (mass * STANDARD_GRAVITY) < 1.6
    orientation = Orientation.ROTARY if rotary else Orientation.VERTICAL if carries else Orientation.HORIZONTAL
    position = recording.position[good] if good.any() else np.zeros(1)
    steps = np.diff(recording.t[np.isfinite(recording.t)])
    return Constants(
        orientation=orientation,
        inertia=None if mass is None else _rounded(weight / STANDARD_GRAVITY if carries and not rotary else mass),
        sample_time=_rounded(float(np.median(steps)), 4) if len(steps) else 0.01,
        travel=(float(position.min()), float(position.max())),
        position_resolution=_grid(recording.position),
        force_resolution=_grid(recording.force),
    )


def guess_time_scale(recording: Recording) -> float:
    """Factor to seconds where the median step says that `t` counts ms, us or ns: no axis is sampled at 1 Hz."""
    steps = np.diff(recording.t[np.isfinite(recording.t)])
    step = float(np.median(steps)) if len(steps) else 0.01
    for factor, least in ((1e-9, 1e5), (1e-6, 50.0), (1e-3, 0.2)):
        if step >= least:
            return factor
    return 1.0


def _grid(values: Floats) -> float:
    """Step of a grid that the values lie on, 0 where they lie on none."""
    step = finest_step(values)
    distinct = np.unique(values[np.isfinite(values)][:5000])
    if step == 0 or len(distinct) < FEWEST_LEVELS:
        return 0.0
    counts = (distinct - distinct[0]) / step
    return _rounded(step) if np.mean(np.abs(counts - np.rint(counts)) < 0.1) > 0.9 else 0.0


def _rounded(value: float, digits: int = 3) -> float:
    return float(f"{value:.{digits}g}")


def plain_axis(rotary: bool, gain: float) -> Axis:
    """An axis that knows nothing but its gain: to read a recording with before its constants are known."""
    orientation = Orientation.ROTARY if rotary else Orientation.HORIZONTAL
    mass, inertia = (0.0, 1.0) if rotary else (1.0, 0.0)
    return Axis("unknown", Mechanics(orientation, M=mass, J=inertia, force_per_torque=gain))
