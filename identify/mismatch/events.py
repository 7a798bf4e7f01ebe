"""Forces that belong to no coordinate of the machine: a tone, a stretch of time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import czt

from identify.mismatch.compare import Fit, block_z
from identify.mismatch.data import join
from identify.mismatch.inverse import unexplained
from identify.mismatch.locate import coordinates
from identify.mismatch.nameless import (
    EVIDENCE,
    HELD_OUT,
    SMALLEST,
    Structure,
    gained,
    gains_of_pairs,
    large_enough,
    likelier,
    net_force,
)
from identify.mismatch.probes import Shape, View, shape_of
from identify.mismatch.shapes import edges_between, equal_force, hats, richest_stretch
from identify.preprocess import Samples

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

TONES = (0.3, 25.0)  # Hz
PULSATES = "dry friction that rises and falls in time, like a pump's pulses of oil,"
TRIED = 32  # tones at which the predictor is asked what a force would do: those at which its errors have most power
BROAD = 0.04  # of a frequency: what is told of where a tone is, though it is known better
SHORT = 0.5  # s, windows of time
EVENT = 16.0  # evidence that each window of an event must bring on average: friction that wanders brings less
STANDS_OUT = 4.0  # times the usual evidence of a window
ALONE = 0.65  # of all windows' evidence that one stretch of time must hold
LONGEST = 0.3  # of the recording: a stretch of time that is longer is no event
SLOW = 1.5  # s between the knots of a force that wanders
MOST_KNOTS = 40
SUDDEN = 150.0  # evidence for a spell ...
SPELLS = (0.85, 0.05), (0.6, 0.1)  # ... and its share of that for any slow force, with how much of the dry friction it
# must be then: spells of healthy friction that wanders have shares of 0.8 and forces of 4.5 % at most
KNOTS, LASTS = 4, (0.9, 0.025)  # a spell of so many knots; healthy ones as long have shares of 0.62
LONGEST_SPELL = 0.5, 0.6  # of a recording: what lasts longer is no spell, nor such a long one
WANDERS = 0.06  # of the dry friction, rms: friction itself wanders by less
SMOOTH_CUT = 8.0  # Hz: what position sensors resolve as force
WEIGHT = 0.1  # of evidence from residual force, which no unseen data confirm
OUTBREAK = 9.0  # times the usual residual force, squared


def tone(here: View, there: View) -> Structure | None:
    """One frequency of an outer force, or of dry friction that rises and falls, found here and confirmed there."""
    found = [told for told in (_tone(here, there), _tone(here, there, PULSATES)) if told is not None]
    return max(found, key=lambda one: one.evidence, default=None)


def _tone(here: View, there: View, like: str = "") -> Structure | None:
    """The same of a force, or of dry friction that does what it is `like`: that turns with the motion."""
    ours, theirs = ((_sign(view) if like else np.ones(len(view.error))) for view in (here, there))
    samples = here.fit.problem.samples
    step = 0.5 / float(np.ptp(samples.t))
    tones = np.arange(TONES[0], min(TONES[1], 0.2 / samples.sample_time), step)
    if len(tones) < 2:
        return None
    likely = tones[_standing_out(samples, here.error * ours, tones)]
    gains = gains_of_pairs(here, _waves(samples, likely, ours))
    top = likely[[int(np.argmax(gains))]]
    evidence = likelier(here, float(gains.max())) - 2.0 * float(np.log(len(tones)))
    if evidence < EVIDENCE:
        return None
    waves = _waves(samples, top, ours)
    shape = shape_of(here, here.responses(waves))
    force = net_force(here, waves @ shape.weights)
    seen = there.responses(_waves(there.fit.problem.samples, top, theirs))
    z = block_z(gained(there, seen @ shape_of(there, seen).weights))
    known = max(step, BROAD * float(top[0]))
    found = Structure("frequency", (float(top[0]) - known, float(top[0]) + known), evidence, z, force, like)
    return found if large_enough(found, here.fit.dry_level) else None


def _sign(view: View) -> Floats:
    """Direction of the motion. [1] (n,)"""
    problem = view.fit.problem
    return coordinates(problem.samples, problem.axis)["direction"]


def _standing_out(samples: Samples, error: Floats, tones: Floats) -> Ints:
    """Indices of the tones [Hz] at which errors (n,) have most power: a force shows where it acts. (q,)"""
    tick = samples.sample_time
    place = np.rint((samples.t - samples.t.min()) / tick).astype(np.int64)
    first, step = (np.exp(2j * np.pi * tick * hertz) for hertz in (tones[0], tones[1] - tones[0]))
    power = np.abs(czt(np.bincount(place, error), len(tones), 1.0 / step, first))
    return np.sort(np.argsort(power)[-TRIED:])


def _waves(samples: Samples, tones: Floats, times: Floats) -> Floats:
    """Cosine and sine of each tone [Hz], `times` (n,) each. (n, 2 q)"""
    phase = 2 * np.pi * samples.t[:, None] * tones
    return (np.stack([np.cos(phase), np.sin(phase)], axis=2) * times[:, None, None]).reshape(len(samples), -1)


def stretch(view: View) -> Structure | None:
    """A stretch of time that holds most of the evidence for forces that come and go."""
    samples, direction = view.fit.problem.samples, _sign(view)
    centres = np.arange(0.5 * SHORT, float(samples.t.max()), 0.5 * SHORT)
    window = np.clip(1.0 - np.abs(samples.t[:, None] - centres) / SHORT, 0.0, None)
    forces = np.stack([window, window * direction[:, None]], axis=2).reshape(len(samples), -1)
    gains = gains_of_pairs(view, forces)
    excess = gains - STANDS_OUT * max(float(np.median(gains)), 2.0)
    low, high, best = _richest(excess)
    top = low + int(np.argmax(excess[low:high]))
    first, last = max(top - 1, low), min(top + 2, high)  # the windows that one moment is in
    moment = float(excess[first:last].sum())
    if best - moment < EVENT * (high - low - (last - first)):
        low, high, best = first, last, moment
    sure = best > max(EVIDENCE, EVENT * (high - low)) and gains[low:high].sum() > ALONE * gains.sum()
    if not sure or (high - low) > LONGEST * len(gains):
        return None
    inside = forces[:, 2 * low : 2 * high]
    force = net_force(view, inside @ shape_of(view, view.responses(inside)).weights)
    if force < SMALLEST * view.fit.dry_level:
        return None
    interval = float(centres[low] - 0.5 * SHORT), float(centres[high - 1] + 0.5 * SHORT)
    return Structure("time", interval, best, float(np.sqrt(best / (high - low))), force)


def slow_force(here: View, there: View) -> Structure | None:
    """A force, or dry friction, that comes and goes slowly, in unseen data too.

    It must be far larger than friction wanders anyway, and explain more than the likeliest observer follows by itself.
    """
    ours = max((_slow(here, against) for against in (False, True)), key=lambda one: one[0].evidence)
    shape, force = ours[0], net_force(here, ours[1] @ ours[0].weights)
    if shape.evidence < EVIDENCE or force < WANDERS * here.fit.dry_level:
        return None
    sure = max(_slow(there, against)[0].evidence for against in (False, True))
    if sure < HELD_OUT:
        return None
    t = here.fit.problem.samples.t
    return Structure("time", (float(t.min()), float(t.max())), shape.evidence, float(np.sqrt(sure)), force)


def _slow(view: View, against: bool) -> tuple[Shape, Floats]:
    """The slow force that a view asks for, or the one `against` the motion, and the series it consists of. (n, q)"""
    forces = _slowly(view, against)[0]
    return shape_of(view, view.responses(forces)), forces


def _slowly(view: View, against: bool) -> tuple[Floats, Floats]:
    """Series between knots in time, of a push or `against` the motion (n, q), and the knots (q,). [s]"""
    samples = view.fit.problem.samples
    first, last = float(samples.t.min()), float(samples.t.max())
    knots = np.linspace(first, last, int(np.clip((last - first) / SLOW, 6, MOST_KNOTS)))
    forces = hats(samples.t, knots)
    if against:
        forces = forces * coordinates(samples, view.fit.problem.axis)["direction"][:, None]
    return forces, knots


def spell(fit: Fit, unseen: Samples) -> Structure | None:
    """An equal force, or dry friction, that begins and ends within a recording and is not there before or after.

    No other data are needed to say so: it must be far more than friction wanders, and nothing else of the kind be left.
    """
    samples = fit.problem.samples
    one_clock = float(unseen.t.min()) > float(samples.t.max()) or float(unseen.t.max()) < float(samples.t.min())
    whole = join(sorted((samples, unseen), key=lambda part: float(part.t[0]))) if one_clock else samples
    view = View.of(fit.on(whole), fit.found.gain)
    found = [one for against in (False, True) if (one := _spell(view, against)) is not None]
    return max(found, key=lambda one: one.evidence, default=None)


def _spell(view: View, against: bool) -> Structure | None:
    """The spell of a push, or of dry friction `against` the motion."""
    forces, knots = _slowly(view, against)
    seen = view.responses(forces)
    gain, start, end = richest_stretch(seen, view.error)
    evidence = likelier(view, gain / view.variance) - 4.0 * float(np.log(len(knots)))
    lasts = end - start >= KNOTS
    inside = start > 0 and end < len(knots) and end - start < LONGEST_SPELL[lasts] * len(knots)
    force = equal_force(seen[:, start:end], view.error)
    if not inside or evidence < SUDDEN:
        return None
    share = evidence / max(shape_of(view, seen).evidence, 1e-300)
    enough = (*SPELLS, LASTS) if lasts else SPELLS
    if not any(share >= most and force >= size * view.fit.dry_level for most, size in enough):
        return None
    edges = edges_between(knots)
    interval = float(edges[start]), float(edges[end])
    return Structure("time", interval, evidence, float(np.sqrt(evidence / (end - start))), force, acting=force)


def burst(fit: Fit) -> Structure | None:
    """A stretch of time with far more residual force than usual: what a strong observer has swallowed."""
    samples = fit.problem.samples
    lacking = unexplained(fit.problem, fit.x, samples, SMOOTH_CUT)
    if lacking is None:
        return None
    place = np.floor(samples.t[lacking.index] / SHORT).astype(np.int64)
    count = np.bincount(place)
    power = np.bincount(place, lacking.lacking**2) / np.maximum(count, 1)
    usual = float(np.median(power[count > 0]))
    ratio = power / max(usual, 1e-300)
    low, high, best = _richest(ratio - OUTBREAK)
    more = np.maximum(ratio - 1.0, 0.0)
    if best <= 0.0 or more[low:high].sum() < ALONE * more.sum() or (high - low) > LONGEST * len(ratio):
        return None
    inside = ratio[low:high][ratio[low:high] > 1.0]
    evidence = WEIGHT * 2.0 * SHORT * SMOOTH_CUT * float((inside - 1.0 - np.log(inside)).sum())
    force = float(np.sqrt(power[low:high].mean()))
    if evidence < EVIDENCE or force < SMALLEST * fit.dry_level:
        return None
    return Structure("time", (low * SHORT, high * SHORT), evidence, float(np.sqrt(evidence / (high - low))), force)


def _richest(excess: Floats) -> tuple[int, int, float]:
    """The stretch with the largest sum: first index, one past its last, and the sum."""
    sums = np.concatenate([[0.0], np.cumsum(excess)])
    lowest = np.minimum.accumulate(sums)
    high = int(np.argmax(sums - lowest))
    low = int(np.argmin(sums[: high + 1]))
    return low, max(high, low + 1), float(sums[high] - sums[low])
