"""The usual mistakes at the edge, as factors: what a recorded value is, divided by what it should be."""

from __future__ import annotations

import math
from dataclasses import dataclass

from plant.axis import Axis

CLOSE = 1.3  # a factor within this ratio of a known mistake is called by its name


@dataclass(frozen=True, slots=True)
class Cause:
    """A mistake that multiplies a channel by `factor`, in words that say what to do."""

    factor: float
    words: str


def force_causes(axis: Axis) -> list[Cause]:
    """Mistakes of the drive channel; those of a drive's per mille where the rated torque is known."""
    gain = abs(axis.mechanics.gain)
    channel = "torque" if gain != 1.0 or axis.is_rotary else "force"
    causes = [
        Cause(1e3, f"thousandths (mN*m, mN) taken as the unit: scale = {{ {channel} = 0.001 }}"),
        Cause(1e-3, f"kN or kN*m taken as the unit: scale = {{ {channel} = 1000 }}"),
        Cause(9.81, f"N taken as kgf twice over: scale = {{ {channel} = 0.102 }}"),
        Cause(1 / 9.81, f"kgf taken as N: scale = {{ {channel} = 9.81 }}"),
        Cause(10.0, f"per mille taken as percent: scale = {{ {channel} = 0.1 }}"),
        Cause(0.1, f"percent taken as per mille: scale = {{ {channel} = 10 }}"),
        Cause(65536.0, "a 16-bit value read from the upper half of a 32-bit field"),
        Cause(1 / 65536.0, "a 32-bit value of which only the upper 16 bits were read"),
        Cause(256.0, "bytes read in the wrong order, or one byte off"),
    ]
    if gain != 1.0:
        causes += [
            Cause(gain, "force in the column that is mapped as torque: columns = { force = ... }"),
            Cause(1 / gain, "motor torque in the column that is mapped as force: columns = { torque = ... }"),
        ]
    if axis.drive.rated_force:
        rated = axis.drive.rated_force / gain
        for parts, name in ((1000, "per mille"), (100, "percent"), (1, "parts")):
            words = f"{name} of the rated torque taken as SI (0x6077): scale = {{ {channel} = {rated / parts:.6g} }}"
            causes.insert(0, Cause(parts / rated, words))
    return causes


def position_causes(axis: Axis) -> list[Cause]:
    """Mistakes of the position channel."""
    degree = 180 / math.pi
    if axis.is_rotary:
        return [
            Cause(degree, "degrees taken as rad: scale = { position = 0.0174533 }"),
            Cause(1 / degree, "rad converted from degrees twice: scale = { position = 57.2958 }"),
            Cause(1 / (2 * math.pi), "revolutions taken as rad: scale = { position = 6.28319 }"),
            Cause(2 * math.pi, "rad taken as revolutions: scale = { position = 0.159155 }"),
            Cause(1e3, "mrad taken as rad: scale = { position = 0.001 }"),
            Cause(1e-3, "rad scaled as mrad: scale = { position = 1000 }"),
        ]
    radius = axis.mechanics.Rc
    causes = [
        Cause(1e3, "mm taken as m: scale = { position = 0.001 }"),
        Cause(1e-3, "m scaled as mm: scale = { position = 1000 }"),
        Cause(1e6, "um taken as m: scale = { position = 1e-6 }"),
        Cause(1e2, "cm taken as m: scale = { position = 0.01 }"),
        Cause(1e1, "dm taken as m, or one decimal place off: scale = { position = 0.1 }"),
        Cause(0.1, "one decimal place off: scale = { position = 10 }"),
        Cause(39.37, "inches taken as m: scale = { position = 0.0254 }"),
    ]
    if radius != 1.0:
        causes += [
            Cause(1 / radius, f"the pulley's angle in rad taken as m: scale = {{ position = {radius:.6g} }}"),
            Cause(degree / radius, f"the pulley's angle in degrees: scale = {{ position = {radius / degree:.6g} }}"),
            Cause(1 / (2 * math.pi * radius), f"revolutions: scale = {{ position = {2 * math.pi * radius:.6g} }}"),
        ]
    return causes


TIME_CAUSES = (
    Cause(1e3, "ms taken as s: scale = { t = 0.001 }"),
    Cause(1e6, "us taken as s: scale = { t = 1e-6 }"),
    Cause(1e9, "ns taken as s: scale = { t = 1e-9 }"),
    Cause(1e-3, "s scaled as ms: scale = { t = 1000 }"),
)

VELOCITY_CAUSES = (
    Cause(-1.0, "the velocity's sign is turned"),
    Cause(180 / math.pi, "degrees per second taken as rad/s"),
    Cause(60 / (2 * math.pi), "revolutions per minute taken as rad/s"),
    Cause(1 / (2 * math.pi), "revolutions per second taken as rad/s"),
    Cause(1e3, "mm/s taken as m/s"),
    Cause(60.0, "per minute taken as per second"),
    Cause(1e-3, "m/s scaled as mm/s"),
)


def named(factor: float, causes: list[Cause] | tuple[Cause, ...]) -> str | None:
    """Words of the causes whose factor is `factor`, sign included, the nearest first; None where none is near."""
    near = [
        (abs(math.log(factor / cause.factor)), cause.words)
        for cause in causes
        if factor * cause.factor > 0 and abs(math.log(factor / cause.factor)) < math.log(CLOSE)
    ]
    return "; or ".join(words for _, words in sorted(near)[:2]) or None
