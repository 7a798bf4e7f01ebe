"""Forces along a coordinate: a free shape learnt on what was fitted and judged on what was not."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.mismatch.compare import block_sums, block_z, without_best
from identify.mismatch.locate import coordinates
from identify.mismatch.nameless import AGREED, EVIDENCE, HELD_OUT, Structure, large_enough, likelier, net_force
from identify.mismatch.probes import Outlook, Shape, View, shape_of

Floats = NDArray[np.float64]

FINEST = 36  # knots along the travel
COARSE = 14  # knots along other coordinates
HALF = 0.35  # of the highest: where a shape counts as being there
SPELL = 0.6  # of the evidence for any force along a coordinate: one equal stretch with so much is where it acts
LASTING = 250.0  # what unseen data must gain without their best blocks, where these do not agree: healthy ones 124
WHITE = 0.6745 * 6.0**0.5  # median size of the second differences of white noise, of its standard deviation
NOISY = 8.0  # standard deviations of a coordinate's noise: no shape along it may turn twice within
ZEROS = 2  # knots at most, where a shape that pushes and then pulls goes through zero
TOLD = {"speed": "velocity"}  # a speed, whichever way, is told as a positive velocity
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
    for known in (ours, theirs):
        known["speed"] = np.abs(known["velocity"])
    plans = {
        "position": (FINEST, False, both), "velocity": (COARSE, False, both), "speed": (COARSE, False, odd),
        "acceleration": (COARSE, True, even),
        "torque": (COARSE, True, both), "torque_rate": (COARSE, True, even),
        "time_since_reversal": (COARSE, True, odd), "distance_since_reversal": (COARSE, True, odd),
    }  # fmt: skip
    for name, (count, crowded, kinds) in plans.items():
        x = ours[name]
        spread = np.linspace(0.003, 0.997, count)
        low, high = (float(edge) for edge in np.quantile(x, [0.002, 0.998]))
        knots = _apart(np.unique(np.quantile(x, spread)), x) if crowded else np.linspace(low, high, count)
        if len(knots) < 4 or np.ptp(knots) <= 0:
            continue
        for sign in kinds:
            told = TOLD.get(name, name)
            yield Probe(told, hats(x, knots) * sign[0], hats(theirs[name], knots) * sign[-1], knots)
    for name in ("motor_angle", "pulley_angle"):
        if np.ptp(ours["position"]) < 2 * np.pi * (axis.mechanics.Rm if name == "motor_angle" else axis.mechanics.Rc):
            continue
        for sign in both:
            yield Probe(name, _turns(ours[name]) * sign[0], _turns(theirs[name]) * sign[-1], np.array([0, 2 * np.pi]))


def _apart(knots: Floats, x: Floats) -> Floats:
    """Those of ascending knots (q,) that stand farther apart than the noise of x (n,) reaches.

    Where an axis slides evenly its torque is one number and noise, and a shape with knots inside that noise subtracts
    it: errors of the sensor, which no machine has felt, would look like a force along it.
    """
    noise = float(np.median(np.abs(np.diff(x, 2)))) / WHITE
    kept = [float(knots[0])]
    for knot in knots[1:].tolist():
        if knot - kept[-1] > NOISY * noise:
            kept.append(knot)
    return np.array(kept)


def hats(x: Floats, knots: Floats) -> Floats:
    """Straight-line interpolation between knots (q,): the share of each at x (n,). (n, q)"""
    return np.stack([np.interp(x, knots, row) for row in np.eye(len(knots))], axis=1)


def _turns(angle: Floats) -> Floats:
    """Harmonics of a wheel's angle [rad]. (n, q)"""
    return np.stack([wave(k * angle) for k in TURNS for wave in (np.cos, np.sin)], axis=1)


def judged(outlook: Outlook, probe: Probe, *, suspicious: bool = False) -> Structure | None:
    """The shape along one coordinate, if it is sure, holds on unseen data and is big enough to matter.

    Where one is `suspicious`, unseen data need not agree on it if they tell enough of it without their best blocks.
    """
    here, there = outlook.here, outlook.there
    seen = here.responses(probe.here)
    shape = shape_of(here, seen)
    evidence = shape.evidence - outlook.behind
    if evidence < EVIDENCE:
        return None
    force = net_force(here, probe.here @ shape.weights)
    gain = outlook.gained(there.responses(probe.there) @ shape.weights)
    z = block_z(gain)
    if suspicious and without_best(block_sums(gain)) > LASTING:
        z = max(z, AGREED)
    interval, acting = _where(probe, shape, here, seen)
    found = Structure(probe.coordinate, interval, evidence, z, force, acting=acting)
    enough = float(gain.sum()) >= HELD_OUT and large_enough(found, here.fit.dry_level)
    return found if enough else None


def _where(probe: Probe, shape: Shape, here: View, seen: Floats) -> tuple[tuple[float, float], float]:
    """Where a force acts along its coordinate: one stretch of equal force, if that is it, or around its highest place.

    What the baseline swallows of a force leaves shapes that are nowhere zero; the stretch that with an equal force
    would explain most does not mind. Else it is where the shape stays above `HALF` of its highest, but for zeros.

    Returns:
        the interval, and the equal force of such a stretch, if that is short and away from both ends; else 0. [N]
    """
    count = len(probe.places)
    if count != len(shape.weights):
        return (float(probe.places[0]), float(probe.places[-1])), 0.0
    edge = edges_between(probe.places)
    gain, low, high = richest_stretch(seen, here.error)
    if likelier(here, gain / here.variance) > SPELL * shape.evidence:
        inside = low > 0 and high < count and 2 * (high - low) < count
        return (float(edge[low]), float(edge[high])), equal_force(seen[:, low:high], here.error) if inside else 0.0
    size = np.abs(shape.weights - np.median(shape.weights))
    there = np.flatnonzero(size > HALF * size.max())
    parts = np.split(there, np.flatnonzero(np.diff(there) > ZEROS + 1) + 1)
    part = next(one for one in parts if int(np.argmax(size)) in one)
    return (float(edge[part[0]]), float(edge[part[-1] + 1])), 0.0


def edges_between(knots: Floats) -> Floats:
    """Where the stretches begin and end in which each of the knots (q,) is the nearest. (q + 1,)"""
    return np.concatenate([knots[:1], 0.5 * (knots[1:] + knots[:-1]), knots[-1:]])


def richest_stretch(seen: Floats, error: Floats) -> tuple[float, int, int]:
    """The equal neighbouring columns of seen (n, q) that take most from the squares of error (n,): how much, which."""
    along = np.concatenate([[0.0], np.cumsum(seen.T @ error)])
    size = np.pad(np.cumsum(np.cumsum(seen.T @ seen, axis=0), axis=1), ((1, 0), (1, 0)))
    own = np.diag(size)
    power = own[:, None] + own - size - size.T
    gain = np.where(power > 0.0, (along[:, None] - along) ** 2 / np.where(power > 0.0, power, 1.0), 0.0)
    start, end = np.unravel_index(int(np.argmax(np.triu(gain, 1))), gain.shape)
    return float(gain[start, end]), int(start), int(end)


def equal_force(seen: Floats, error: Floats) -> float:
    """Size of the equal force in all columns of seen (n, q) [m/N] that explains most of error (n,). [N]"""
    together = seen.sum(axis=1)
    return abs(float(together @ error)) / max(float(together @ together), 1e-300)
