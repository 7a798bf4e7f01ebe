"""The usual mistakes at the edge, done to healthy recordings: the zoo that the audit is judged by."""

import dataclasses
import math

import numpy as np

from plant.axis import Orientation

replace = dataclasses.replace


def factor_of(axis, parts):
    """Parts of the rated torque taken as SI are this much too large."""
    return parts / (axis.drive.rated_force / axis.mechanics.gain)


def telling(factor):
    return factor > 10 or factor < 0.1


def unsigned(recording, axis):
    counts = np.round(recording.force / axis.drive.force_resolution)
    return replace(recording, force=np.where(counts < 0, counts + 65536, counts) * axis.drive.force_resolution)


def scaled(channel, factor):
    return lambda recording, axis: replace(recording, **{channel: getattr(recording, channel) * factor})


def any_axis(axis):
    return True


def linear(axis):
    return not axis.is_rotary


def vertical(axis):
    return axis.mechanics.orientation is Orientation.VERTICAL


def gain(axis):
    return axis.mechanics.gain


ZOO = {
    # name: what happens, to which axes, a word of the likely cause, share that must be refused
    "force turned": (scaled("force", -1), any_axis, "wrong sign", 1.0),
    "position turned": (scaled("position", -1), any_axis, "", 1.0),
    "both turned": (
        lambda r, a: replace(r, force=-r.force, position=-r.position),
        vertical,
        "both force and position",
        1.0,
    ),
    "mN*m as N*m": (scaled("force", 1e3), any_axis, "thousandths", 1.0),
    "kN as N": (scaled("force", 1e-3), any_axis, "kN", 0.98),
    "per mille as percent": (scaled("force", 10), any_axis, "percent", 0.98),
    "percent as per mille": (scaled("force", 0.1), lambda a: a.mechanics.inertia_known, "percent", 0.98),
    "three times too large": (scaled("force", 3), lambda a: a.mechanics.inertia_known, "", 0.98),
    "a third of it": (scaled("force", 1 / 3), lambda a: a.mechanics.inertia_known, "", 0.98),
    "per mille as N*m": (
        lambda r, a: replace(r, force=r.force * factor_of(a, 1000)),
        lambda a: telling(factor_of(a, 1000)),
        "0x6077",
        0.98,
    ),
    "percent as N*m": (
        lambda r, a: replace(r, force=r.force * factor_of(a, 100)),
        lambda a: telling(factor_of(a, 100)),
        "0x6077",
        0.98,
    ),
    "force as torque": (lambda r, a: replace(r, force=r.force * gain(a)), lambda a: gain(a) > 10, "mapped as", 0.98),
    "torque as force": (lambda r, a: replace(r, force=r.force / gain(a)), lambda a: gain(a) > 10, "mapped as", 0.98),
    "mm as m": (scaled("position", 1e3), linear, "mm", 1.0),
    "metres twice": (scaled("position", 1e-3), linear, "", 1.0),
    "degrees as rad": (scaled("position", 180 / math.pi), lambda a: a.is_rotary, "degrees", 1.0),
    "rad twice": (scaled("position", math.pi / 180), lambda a: a.is_rotary, "", 1.0),
    "turns as rad": (scaled("position", 1 / (2 * math.pi)), lambda a: a.is_rotary, "", 0.98),
    "pulley angle as m": (scaled("position", 1 / 0.045), linear, "pulley", 1.0),
    "ms as s": (scaled("t", 1e3), any_axis, "ms", 1.0),
    "columns swapped": (
        lambda r, a: replace(r, force=r.position * gain(a), position=r.force / gain(a)),
        any_axis,
        "swapped",
        1.0,
    ),
    "unsigned": (unsigned, lambda a: not vertical(a), "unsigned", 0.98),
    "upper half of 32 bits": (scaled("force", 65536), any_axis, "16-bit", 1.0),
    "lower half lost": (scaled("force", 1 / 65536), any_axis, "", 0.98),
    "wrapped position": (
        lambda r, a: replace(r, position=np.mod(r.position, np.ptp(r.position) / 2.7)),
        any_axis,
        "wrap",
        0.98,
    ),
    "time backwards": (lambda r, a: replace(r, t=r.t[::-1].copy()), any_axis, "", 1.0),
}
