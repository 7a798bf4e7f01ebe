"""Errors of the position sensor that look like forces: a periodic one, a jump of its zero."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from identify.mismatch.compare import block_sums, block_z, without_best
from identify.mismatch.nameless import (
    AGREED,
    EVIDENCE,
    HELD_OUT,
    Structure,
    gain_of_one,
    gain_of_pair,
    gained,
    likelier,
)
from identify.mismatch.probes import View
from identify.preprocess import Samples

Floats = NDArray[np.float64]

WAVES = (1.5, 40.0)  # of a sensor's error, over the travel
JUMPED = "jumps of the position zero"  # words of the preprocessing
FINER = 21  # numbers of waves around the best, for unseen data may reach further
SURE = 2.5  # times the usual evidence: what is white noise to a force is not to a sensor
UNEVEN = 1000.0  # of unseen data, without their two best blocks: slow passes tell nothing of it, and need not agree
STARTING = 5  # samples of a run whose errors are those of its start
SLIPS = 5  # prediction errors looked at as jumps of the sensor
ASIDE = 0.2  # s: another moment
BESIDE = 0.05  # s: what a jump moves the prediction errors of
CLEARED = 2.5  # times the usual error: a jump that leaves more there is how the axis breaks away
HALF_OF_NORMAL = 0.4549  # median of the square of a standard normal number
ONCE = 1.0 / 3.0  # of its evidence: a jump that another moment has as much of is how the axis breaks away


def encoder_error(here: View, there: View) -> Structure | None:
    """A periodic error of the position sensor itself."""
    samples = here.fit.problem.samples
    travel = float(np.ptp(samples.position))
    numbers = np.arange(*WAVES, 0.5) / travel
    best, most = _best_wave(here, numbers)
    evidence = likelier(here, most) - 2.0 * float(np.log(len(numbers)))
    if evidence < SURE * EVIDENCE:
        return None
    best, _ = _best_wave(here, best + np.linspace(-0.5, 0.5, FINER) / travel)
    seen = here.shifted(_ripples(here.foreseen(), best))
    weights = -np.linalg.lstsq(seen, here.error, rcond=None)[0]
    gain = gained(there, there.shifted(_ripples(there.foreseen(), best)) @ weights)
    z = block_z(gain)
    agreed = z >= AGREED or without_best(block_sums(gain)) > UNEVEN
    if not agreed or float(gain.sum()) < HELD_OUT:
        return None
    interval = float(samples.position.min()), float(samples.position.max())
    return Structure("position", interval, evidence, z, 0.0)


def _best_wave(view: View, numbers: Floats) -> tuple[float, float]:
    """The likeliest of `numbers` of waves per metre, and what it gains."""
    samples = view.foreseen()
    seen = view.shifted(np.concatenate([_ripples(samples, number) for number in numbers], axis=1))
    gains = [gain_of_pair(view, pair) for pair in np.split(seen, len(numbers), axis=1)]
    top = int(np.argmax(gains))
    return float(numbers[top]), float(gains[top])


def _ripples(samples: Samples, number: float) -> Floats:
    """Cosine and sine over position, `number` waves per metre. (n, 2)"""
    phase = 2 * np.pi * number * samples.position
    return np.stack([np.cos(phase), np.sin(phase)], axis=1)


def slip(view: View) -> Structure | None:
    """A jump of the sensor's zero: the largest prediction error, if a jump of the position takes it away, once."""
    samples = view.fit.problem.samples
    since = np.arange(len(samples)) - samples.first[samples.run]
    order = np.argsort(-np.abs(np.where(since < STARTING, 0.0, view.error)))
    gain, at, left = max(_jump(view, k) for k in order[:SLIPS].tolist())
    evidence = likelier(view, gain) - 2.0 * float(np.log(len(samples)))
    if evidence < EVIDENCE or left > CLEARED:
        return None
    when = float(samples.t[at])
    elsewhere = order[np.abs(samples.t[order] - when) > ASIDE][:SLIPS].tolist()
    if any(_jump(view, k)[0] > ONCE * gain for k in elsewhere):
        return None
    width = 2.0 * samples.sample_time
    return Structure("time", (when - width, when + width), evidence, float(np.sqrt(evidence)), 0.0)


def _jump(view: View, k: int) -> tuple[float, int, float]:
    """What a jump of the position from sample k to the end of its run gains, k, and the error left over the usual."""
    samples = view.fit.problem.samples
    after = (np.arange(len(samples)) >= k) & (samples.run == samples.run[k])
    seen = view.shifted(after.astype(np.float64)[:, None])[:, 0]
    near = np.abs(samples.t - samples.t[k]) <= BESIDE
    rest = view.error - seen * float(seen @ view.error) / max(float(seen @ seen), 1e-300)
    usual = float(np.median(view.error**2)) / HALF_OF_NORMAL
    return gain_of_one(view, seen), k, float(np.sqrt(np.mean(rest[near] ** 2) / max(usual, 1e-300)))


def zero_jumps(samples: Samples) -> list[Structure]:
    """Moments at which the sensor jumped so far that the samples were cut there; averaged data hide them."""
    if not any(JUMPED in line for line in samples.removed):
        return []
    first = samples.first[1:]
    since = samples.t[first] - samples.t[first - 1]
    step = samples.sample_time
    moments = samples.t[first[(since > 0.0) & (since < 1.5 * step)]]
    return [Structure("time", (float(t - 2.0 * step), float(t + step)), np.inf, np.inf, 0.0) for t in moments]
