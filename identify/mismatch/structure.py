"""Force that repeats though nothing names it: along which coordinate, where on it, how sure.

Each coordinate proposes a shape, learnt on what was fitted and judged on what was not; a tone and a stretch of time
propose themselves. All compete by evidence, so that periodic motion, in which every coordinate is a function of every
other, does not decide by chance.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from identify.mismatch.compare import Fit, block_z
from identify.mismatch.inverse import unexplained
from identify.mismatch.locate import coordinates
from identify.mismatch.probes import Shape, View, shape_of
from identify.preprocess import Samples

Floats = NDArray[np.float64]

EVIDENCE = 60.0  # twice the log of how much likelier the force is than none
HELD_OUT = 25.0  # of the same, that the shape must gain on data it has not seen
AGREED = 2.5  # z of the blocks of those data
SMALLEST = 0.01  # of the dry friction, rms past what friction itself can take
FINEST = 36  # knots along the travel
COARSE = 14  # knots along other coordinates
HALF = 0.35  # of the highest: where a shape counts as being there
TONES = (0.3, 10.0)  # Hz
TURNS = (1, 2, 3, 6)  # harmonics of a wheel
SHORT = 0.5  # s, windows of time
EVENT = 16.0  # evidence that each window of an event must bring on average: friction that wanders brings less
STANDS_OUT = 4.0  # times the usual evidence of a window
ALONE = 0.65  # of all windows' evidence that one stretch of time must hold
LONGEST = 0.4  # of the recording: a stretch of time that is longer is no event
SMOOTH_CUT = 8.0  # Hz: what position sensors resolve as force
OUTBREAK = 9.0  # times the usual residual force, squared
WAVES = (1.5, 40.0)  # of a sensor's error, over the travel
JUMPED = "jumps of the position zero"  # words of the preprocessing
SLIPS = 5  # prediction errors looked at as jumps of the sensor


@dataclass(frozen=True, slots=True)
class Structure:
    """Force that depends on a coordinate though no name stands for it.

    Attributes:
        coordinate: of the contract.
        interval: where on it.
        evidence: twice the log marginal likelihood ratio. [1]
        z: of its gain on data that were not fitted. [1]
        force: rms past what friction itself could take. [N]
    """

    coordinate: str
    interval: tuple[float, float]
    evidence: float
    z: float
    force: float

    @property
    def p_value(self) -> float:
        """Probability of such a gain on unseen data by chance."""
        return float(norm.sf(self.z))


@dataclass(frozen=True, slots=True, eq=False)
class _Probe:
    """Force series of one coordinate on fitted and on unseen data, per newton, and where each of them acts."""

    coordinate: str
    here: Floats
    there: Floats
    places: Floats


def structures(fit: Fit, held_out: Samples, *, suspicious: bool = False) -> list[Structure]:
    """Everything that is sure, the most evident first; where one is `suspicious`, events that came once too."""
    here = View.of(fit, fit.found.gain)
    there = View.of(_moved(fit, held_out), fit.found.gain)
    found = [s for probe in _along(here, there) if (s := _judged(here, there, probe)) is not None]
    others = (
        _tone(here, there),
        _encoder(here, there),
        _stretch(here),
        _slip(here),
        _burst(fit) if suspicious else None,
    )
    found += [s for s in others if s is not None]
    return sorted(found, key=lambda s: -s.evidence)


def zero_jumps(samples: Samples) -> list[Structure]:
    """Moments at which the sensor jumped so far that the samples were cut there; averaged data hide them."""
    if not any(JUMPED in line for line in samples.removed):
        return []
    first = samples.first[1:]
    since = samples.t[first] - samples.t[first - 1]
    step = samples.sample_time
    moments = samples.t[first[(since > 0.0) & (since < 1.5 * step)]]
    return [Structure("time", (float(t - 2.0 * step), float(t + step)), np.inf, np.inf, 0.0) for t in moments]


def _moved(fit: Fit, samples: Samples) -> Fit:
    """The same model and unknowns on other samples, from their measured starts."""
    problem = fit.problem.on(samples)
    x = np.concatenate([fit.x[: problem.p], np.zeros(2 * samples.runs)])
    return Fit(problem, dataclasses.replace(fit.found, x=x))


def _along(here: View, there: View) -> Iterator[_Probe]:
    """Shapes along every coordinate: pushing one way (even), and against the motion (odd)."""
    axis = here.fit.problem.axis
    ours, theirs = (coordinates(view.foreseen(), axis) for view in (here, there))
    signs = ours["direction"][:, None], theirs["direction"][:, None]
    one = np.ones((1, 1)), np.ones((1, 1))
    both, odd, even = (one, signs), (signs,), (one,)
    plans = {
        "position": (FINEST, False, both), "velocity": (COARSE, False, even), "acceleration": (COARSE, True, even),
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
            yield _Probe(name, _hats(x, knots) * sign[0], _hats(theirs[name], knots) * sign[-1], knots)
    for name in ("motor_angle", "pulley_angle"):
        if np.ptp(ours["position"]) < 2 * np.pi * (axis.mechanics.Rm if name == "motor_angle" else axis.mechanics.Rc):
            continue
        for sign in both:
            yield _Probe(name, _turns(ours[name]) * sign[0], _turns(theirs[name]) * sign[-1], np.array([0, 2 * np.pi]))


def _encoder(here: View, there: View) -> Structure | None:
    """A periodic error of the position sensor itself."""
    samples = here.fit.problem.samples
    travel = float(np.ptp(samples.position))
    numbers = np.arange(*WAVES, 0.5) / travel
    gains = [_pair(here, _shifted(here, _ripples(samples, number))) for number in numbers]
    top = int(np.argmax(gains))
    evidence = float(gains[top]) - 2.0 * float(np.log(len(numbers)))
    if evidence < EVIDENCE:
        return None
    seen = _shifted(here, _ripples(samples, numbers[top]))
    weights = -np.linalg.lstsq(seen, here.error, rcond=None)[0]
    gained = _gain(there, _shifted(there, _ripples(there.fit.problem.samples, numbers[top])) @ weights)
    z = block_z(gained)
    if z < AGREED or float(gained.sum()) < HELD_OUT:
        return None
    interval = float(samples.position.min()), float(samples.position.max())
    return Structure("position", interval, evidence, z, 0.0)


def _ripples(samples: Samples, number: float) -> Floats:
    """Cosine and sine over position, `number` waves per metre. (n, 2)"""
    phase = 2 * np.pi * number * samples.position
    return np.stack([np.cos(phase), np.sin(phase)], axis=1)


def _shifted(view: View, shifts: Floats) -> Floats:
    """Change of the prediction errors per metre that the sensor errs by, a column each. [1] (n, q)"""
    problem, size = view.fit.problem, float(np.sqrt(view.variance))
    start = problem.errors(view.x[None], view.gain)[:, 0].copy()
    found = np.empty_like(shifts)
    for k, shift in enumerate(shifts.T):
        moved = dataclasses.replace(problem.samples, position=problem.samples.position + size * shift)
        change = problem.on(moved, problem.first_state).errors(view.x[None], view.gain)[:, 0] - start
        found[:, k] = (change - view.basis @ (view.basis.T @ change)) / size
    return found


def _single(view: View, seen: Floats) -> float:
    """What one response (n,) gains."""
    return float(seen @ view.error) ** 2 / max(float(seen @ seen), 1e-300) / view.variance


def _pair(view: View, seen: Floats) -> float:
    """What two responses (n, 2) together gain."""
    weights = np.linalg.lstsq(seen, view.error, rcond=None)[0]
    return float(weights @ (seen.T @ view.error)) / view.variance


def _hats(x: Floats, knots: Floats) -> Floats:
    """Straight-line interpolation between knots (q,): the share of each at x (n,). (n, q)"""
    return np.stack([np.interp(x, knots, row) for row in np.eye(len(knots))], axis=1)


def _turns(angle: Floats) -> Floats:
    """Harmonics of a wheel's angle [rad]. (n, q)"""
    return np.stack([wave(k * angle) for k in TURNS for wave in (np.cos, np.sin)], axis=1)


def _judged(here: View, there: View, probe: _Probe) -> Structure | None:
    """The shape along one coordinate, if it is sure, holds on unseen data and is big enough to matter."""
    shape = shape_of(here, here.responses(probe.here))
    if shape.evidence < EVIDENCE:
        return None
    force = _net(here, probe.here @ shape.weights)
    gained = _gain(there, there.responses(probe.there) @ shape.weights)
    z = block_z(gained)
    if force < SMALLEST * here.fit.dry_level or float(gained.sum()) < HELD_OUT or z < AGREED:
        return None
    return Structure(probe.coordinate, _where(probe, shape), shape.evidence, z, force)


def _gain(view: View, change: Floats) -> Floats:
    """Twice the log-likelihood that a change of the prediction errors gains, per sample. (n,)"""
    return np.asarray((view.error**2 - (view.error + change) ** 2) / view.variance, dtype=np.float64)


def _net(view: View, force: Floats) -> float:
    """Rms of a force series past what a constant, dry and viscous friction could take. [N]."""
    problem = view.fit.problem
    known = coordinates(problem.samples, problem.axis)
    speed, sign = known["velocity"], known["direction"]
    bend = np.exp(-np.abs(speed) * problem.law(view.x[None])[2, 0])
    design = np.stack([np.ones_like(speed), sign, speed, sign * bend], axis=1)
    rest = force - design @ np.linalg.lstsq(design, force, rcond=None)[0]
    return float(np.sqrt(np.mean(rest**2)))


def _where(probe: _Probe, shape: Shape) -> tuple[float, float]:
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


def _tone(here: View, there: View) -> Structure | None:
    """One frequency of an outer force, found here and confirmed there."""
    samples = here.fit.problem.samples
    step = 0.5 / float(np.ptp(samples.t))
    tones = np.arange(TONES[0], min(TONES[1], 0.2 / samples.sample_time), step)
    gains = _pairs(here, _waves(samples, tones))
    top = int(np.argmax(gains))
    evidence = float(gains[top]) - 2.0 * float(np.log(len(tones)))
    if evidence < EVIDENCE:
        return None
    waves = _waves(samples, tones[[top]])
    shape = shape_of(here, here.responses(waves))
    force = _net(here, waves @ shape.weights)
    seen = there.responses(_waves(there.fit.problem.samples, tones[[top]]))
    z = block_z(_gain(there, seen @ shape_of(there, seen).weights))
    if force < SMALLEST * here.fit.dry_level or z < AGREED:
        return None
    return Structure("frequency", (float(tones[top] - step), float(tones[top] + step)), evidence, z, force)


def _waves(samples: Samples, tones: Floats) -> Floats:
    """Cosine and sine of each tone [Hz]. (n, 2 q)"""
    phase = 2 * np.pi * samples.t[:, None] * tones
    return np.stack([np.cos(phase), np.sin(phase)], axis=2).reshape(len(samples), -1)


def _pairs(view: View, forces: Floats) -> Floats:
    """What each pair of neighbouring force series (n, 2 q) together gains. (q,)"""
    seen = view.responses(forces)
    along = (seen.T @ view.error).reshape(-1, 2)
    one, two = seen[:, 0::2], seen[:, 1::2]
    a, b, c = (np.einsum("nq,nq->q", *pair) for pair in ((one, one), (one, two), (two, two)))
    determinant = a * c - b * b
    usable = determinant > 1e-9 * np.maximum(a * c, 1e-300)
    gained = c * along[:, 0] ** 2 - 2 * b * along[:, 0] * along[:, 1] + a * along[:, 1] ** 2
    return np.where(usable, gained / np.where(usable, determinant, 1.0), 0.0) / view.variance


def _burst(fit: Fit) -> Structure | None:
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
    evidence = 2.0 * SHORT * SMOOTH_CUT * float((inside - 1.0 - np.log(inside)).sum())
    force = float(np.sqrt(power[low:high].mean()))
    if evidence < EVIDENCE or force < SMALLEST * fit.dry_level:
        return None
    return Structure("time", (low * SHORT, high * SHORT), evidence, float(np.sqrt(evidence / (high - low))), force)


def _stretch(view: View) -> Structure | None:
    """A stretch of time that holds most of the evidence for forces that come and go."""
    problem = view.fit.problem
    samples = problem.samples
    direction = coordinates(samples, problem.axis)["direction"]
    centres = np.arange(0.5 * SHORT, float(samples.t.max()), 0.5 * SHORT)
    window = np.clip(1.0 - np.abs(samples.t[:, None] - centres) / SHORT, 0.0, None)
    forces = np.stack([window, window * direction[:, None]], axis=2).reshape(len(samples), -1)
    gains = _pairs(view, forces)
    low, high, best = _richest(gains - STANDS_OUT * max(float(np.median(gains)), 2.0))
    sure = best > max(EVIDENCE, EVENT * (high - low)) and gains[low:high].sum() > ALONE * gains.sum()
    if not sure or (high - low) > LONGEST * len(gains):
        return None
    inside = forces[:, 2 * low : 2 * high]
    force = _net(view, inside @ shape_of(view, view.responses(inside)).weights)
    if force < SMALLEST * view.fit.dry_level:
        return None
    interval = float(centres[low] - 0.5 * SHORT), float(centres[high - 1] + 0.5 * SHORT)
    return Structure("time", interval, best, float(np.sqrt(best / (high - low))), force)


def _richest(excess: Floats) -> tuple[int, int, float]:
    """The stretch with the largest sum: first index, one past its last, and the sum."""
    sums = np.concatenate([[0.0], np.cumsum(excess)])
    lowest = np.minimum.accumulate(sums)
    high = int(np.argmax(sums - lowest))
    low = int(np.argmin(sums[: high + 1]))
    return low, max(high, low + 1), float(sums[high] - sums[low])


def _slip(view: View) -> Structure | None:
    """A jump of the sensor's zero: the largest prediction error, if a jump of the position takes it away."""
    samples = view.fit.problem.samples
    best = (0.0, 0)
    for k in np.argsort(-np.abs(view.error))[:SLIPS].tolist():
        after = (np.arange(len(samples)) >= k) & (samples.run == samples.run[k])
        change = _shifted(view, after.astype(np.float64)[:, None])
        best = max(best, (_single(view, change[:, 0]), k))
    evidence = best[0] - 2.0 * float(np.log(len(samples)))
    if evidence < EVIDENCE:
        return None
    when = float(samples.t[best[1]])
    width = 2.0 * samples.sample_time
    return Structure("time", (when - width, when + width), evidence, float(np.sqrt(evidence)), 0.0)
