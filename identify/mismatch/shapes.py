"""Forces along a coordinate: a free shape learnt on what was fitted and judged on what was not."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.mismatch.compare import block_z
from identify.mismatch.locate import coordinates
from identify.mismatch.nameless import EVIDENCE, HELD_OUT, Structure, large_enough, net_force
from identify.mismatch.probes import Outlook, Shape, View, shape_of

Floats = NDArray[np.float64]

FINEST = 36  # knots along the travel
COARSE = 14  # knots along other coordinates
HALF = 0.35  # of the highest: where a shape counts as being there
TURNS = (1, 2, 3, 6)  # harmonics of a wheel


@dataclass(frozen=True, slots=True, eq=False)
class Probe:
    """Force series of one coordinate on fitted and on unseen data, per newton, and where each of them acts."""

    coordinate: str
    here: Floats
    there: Floats
    places: Floats


def along_coordinates(here: View, there: View) -> Iterator[Probe]:
    """Shapes along every coordinate: pushing one way (even), and against the motion (odd)."""
    axis = here.fit.problem.axis
    ours, theirs = (coordinates(view.foreseen(), axis) for view in (here, there))
    signs = ours["direction"][:, None], theirs["direction"][:, None]
    one = np.ones((1, 1)), np.ones((1, 1))
    both, odd, even = (one, signs), (signs,), (one,)
    plans = {
        "position": (FINEST, False, both), "velocity": (COARSE, False, both), "acceleration": (COARSE, True, even),
        "torque": (COARSE, True, both), "torque_rate": (COARSE, True, even),
        "time_since_reversal": (COARSE, True, odd), "distance_since_reversal": (COARSE, True, odd),
    }  # fmt: skip
    for name, (count, crowded, kinds) in plans.items():
        x = ours[name]
        spread = np.linspace(0.003, 0.997, count)
        low, high = (float(edge) for edge in np.quantile(x, [0.002, 0.998]))
        knots = np.unique(np.quantile(x, spread)) if crowded else np.linspace(low, high, count)
        if len(knots) < 4 or np.ptp(knots) <= 0:
            continue
        for sign in kinds:
            yield Probe(name, hats(x, knots) * sign[0], hats(theirs[name], knots) * sign[-1], knots)
    for name in ("motor_angle", "pulley_angle"):
        if np.ptp(ours["position"]) < 2 * np.pi * (axis.mechanics.Rm if name == "motor_angle" else axis.mechanics.Rc):
            continue
        for sign in both:
            yield Probe(name, _turns(ours[name]) * sign[0], _turns(theirs[name]) * sign[-1], np.array([0, 2 * np.pi]))


def hats(x: Floats, knots: Floats) -> Floats:
    """Straight-line interpolation between knots (q,): the share of each at x (n,). (n, q)"""
    return np.stack([np.interp(x, knots, row) for row in np.eye(len(knots))], axis=1)


def _turns(angle: Floats) -> Floats:
    """Harmonics of a wheel's angle [rad]. (n, q)"""
    return np.stack([wave(k * angle) for k in TURNS for wave in (np.cos, np.sin)], axis=1)


def judged(outlook: Outlook, probe: Probe) -> Structure | None:
    """The shape along one coordinate, if it is sure, holds on unseen data and is big enough to matter."""
    here, there = outlook.here, outlook.there
    shape = shape_of(here, here.responses(probe.here))
    evidence = shape.evidence - outlook.behind
    if evidence < EVIDENCE:
        return None
    force = net_force(here, probe.here @ shape.weights)
    gain = outlook.gained(there.responses(probe.there) @ shape.weights)
    z = block_z(gain)
    found = Structure(probe.coordinate, _where(probe, shape), evidence, z, force)
    enough = float(gain.sum()) >= HELD_OUT and large_enough(found, here.fit.dry_level)
    return found if enough else None


def _where(probe: Probe, shape: Shape) -> tuple[float, float]:
    """The stretch around the strongest place over which the shape stays above `HALF` of it."""
    if len(probe.places) != len(shape.weights):
        return float(probe.places[0]), float(probe.places[-1])
    size = np.abs(shape.weights - np.median(shape.weights))
    top = int(np.argmax(size))
    low = high = top
    while low > 0 and size[low - 1] > HALF * size[top]:
        low -= 1
    while high < len(size) - 1 and size[high + 1] > HALF * size[top]:
        high += 1
    edge = np.concatenate([probe.places[:1], 0.5 * (probe.places[1:] + probe.places[:-1]), probe.places[-1:]])
    return float(edge[low]), float(edge[high + 1])
