"""The model everybody would fit, with the torque between two samples read in the likeliest way."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
from scipy.ndimage import convolve1d

from identify.mismatch.compare import Fit, fit, trimmed
from identify.mismatch.data import Evidence
from identify.mismatch.extended import MOST, ExtendedProblem
from identify.mismatch.quiet import quieted
from identify.mismatch.rules import hardly_late, price
from identify.outliers import late_outliers, without
from identify.preprocess import Samples
from identify.problem import FrictionProblem
from identify.search import observer_search
from plant.axis import Axis

LIKELIER = 30.0  # twice the log-likelihood by which another reading of the torque must win
COARSE = 0.01  # s: steps to begin with; whether shorter ones are needed shows
LITTLE = 10.0  # twice the log-likelihood that shorter steps may change
MISREAD = {"transmission_compliance", "actuator_lag", "dead_time"}  # what a wrong reading of the torque looks like
FELT = 1000.0  # the same by which a restless force must be likelier as logged: an axis that jumps with it is far surer
READINGS = {  # of a torque logged as held by a loop that runs faster than the log
    "straight between samples": (1.0,),
    "straight, averaged over three samples": (0.25, 0.5, 0.25),
    "straight, averaged over five samples": (0.2, 0.2, 0.2, 0.2, 0.2),
}


def fit_baseline(samples: Samples, axis: Axis, seed: int) -> Fit:
    """Fit the baseline model to `samples`."""
    plain = FrictionProblem(samples, axis)
    found = observer_search(plain, np.random.default_rng(seed))
    return _finely(Fit(ExtendedProblem(samples, axis, scales=plain.scales, longest_substep=COARSE), found))


def _finely(found: Fit) -> Fit:
    """The same model in steps so short that shorter ones change little: some effects ask for those by themselves."""
    while (substeps := found.problem.substeps) < MOST:
        finer = found.problem.stepping(found.problem.samples.sample_time / min(2 * substeps, MOST))
        x, gain = found.x[None], found.found.gain
        if abs(finer.losses(x, gain)[0] - found.problem.losses(x, gain)[0]) < LITTLE:
            break
        found = fit(finer, x)
    return found


def read_torque(gathered: Evidence, axis: Axis, doubtful: bool, seed: int) -> tuple[Evidence, Fit]:
    """The baseline, and the evidence with the torque read in the likeliest way.

    A closed loop runs faster than most logs of it: what is logged as "held" is often one point of a restless force,
    and the force that acted is better told from its neighbours. An open-loop command is what its word says. Noise that
    was logged with either is taken out where the motion is likelier without it.

    Args:
        gathered: as gathered.
        axis: the machine.
        doubtful: True where the word on the torque cannot be relied on.
        seed: of the search.
    """
    chosen, best = gathered, fit_baseline(gathered.train, axis, seed)
    needed = best.found.criterion - LIKELIER
    for other in _readings(gathered) if doubtful else ():
        fitted = fit_baseline(other.train, axis, seed)
        if fitted.found.criterion < min(needed, best.found.criterion):
            best, chosen = fitted, other
    for other in (gathered,) if chosen is gathered else (gathered, chosen):
        quiet = _quieted(other, axis)
        fitted = fit(best.problem.on(quiet.train, best.problem.first_state), best.x[None])
        if fitted.found.criterion < best.found.criterion - LIKELIER:
            best, chosen = fitted, quiet
    return _without_outliers(chosen, best)


def felt(logged: Evidence, axis: Axis, seed: int) -> bool:
    """Whether the axis has felt a loop's force as it was logged: nothing else it is read as is nearly as likely.

    A loop answers the noise of its sensor from sample to sample; held so long, that moves the axis.
    """
    held = fit_baseline(logged.train, axis, seed).found.criterion
    return all(held < fit_baseline(other.train, axis, seed).found.criterion - FELT for other in _readings(logged))


def read_again(gathered: Evidence, current: Evidence, chosen: Fit, seed: int) -> tuple[Evidence, Fit] | None:
    """Evidence and baseline with the torque read as the model `chosen` on `current` asks for; None: it is read so.

    What the baseline lacks distorts how the torque looks between samples; a model with effects knows better. What a
    wrong reading itself looks like may be among those effects: a model without it, read in another way, is preferred
    unless it is much less likely. One whose clocks are a little apart is not read in another way with that free to
    grow: straight between samples comes half a period earlier than held, which would become a dead time.
    """
    guises = chosen.problem.guises
    fewer = [trimmed(chosen, tuple(g for g in guises if g is not guise)) for guise in guises if guise.name in MISREAD]
    as_chosen = () if hardly_late(chosen) else (chosen,)
    readings = [gathered, *_readings(gathered)]
    if current.quiet:
        readings = [_quieted(other, chosen.problem.axis) for other in readings]
    best, least = None, np.inf
    for model in (*fewer, *as_chosen):
        margin = -LIKELIER if model is chosen else LIKELIER
        for other in readings:
            samples = dataclasses.replace(current.train, force=other.train.force, linear=other.train.linear)
            if samples.linear == current.train.linear and np.array_equal(samples.force, current.train.force):
                continue
            fitted = fit(model.problem.on(samples, model.problem.first_state), model.x[None])
            if price(fitted) - margin < min(least, price(chosen)):
                best, least = other, price(fitted) - margin
    if best is None:
        return None
    return _without_outliers(best, fit_baseline(best.train, chosen.problem.axis, seed))


def _readings(gathered: Evidence) -> list[Evidence]:
    """The evidence with its held torque read in other ways."""
    if gathered.train.linear:
        return []
    return [
        dataclasses.replace(
            gathered,
            train=_reread(gathered.train, weights),
            held_out=_reread(gathered.held_out, weights),
            before=None if gathered.before is None else _reread(gathered.before, weights),
            removed=(*gathered.removed, f"torque read as {name}: likelier than held"),
        )
        for name, weights in READINGS.items()
    ]


def _quieted(evidence: Evidence, axis: Axis) -> Evidence:
    """The evidence with the noise that was logged with its force taken out."""
    train = quieted(evidence.train)
    noise, unit = float(np.std(evidence.train.force - train.force)), axis.force_unit
    return dataclasses.replace(
        evidence,
        train=train,
        held_out=quieted(evidence.held_out),
        before=None if evidence.before is None else quieted(evidence.before),
        removed=(
            *evidence.removed,
            f"noise of the logged force taken out ({noise:.2g} {unit}): the motion is likelier so",
        ),
        quiet=True,
    )


def _without_outliers(evidence: Evidence, best: Fit) -> tuple[Evidence, Fit]:
    """Evidence and baseline without the positions that only the fitted model can tell to be wrong (stale rows).

    The baseline is polished once more in the predictor that richer models use: they are compared by the last digit.
    """
    problem, x = best.problem, best.x
    bad = late_outliers(problem, x, best.found.gain)
    unseen = best.on(evidence.held_out)
    bad_unseen = late_outliers(unseen.problem, unseen.x, best.found.gain)
    if bad_unseen.any():
        evidence = dataclasses.replace(evidence, held_out=without(evidence.held_out, bad_unseen))
    if bad.any():
        evidence = dataclasses.replace(evidence, train=without(evidence.train, bad))
    best = fit(problem.on(evidence.train, problem.first_state), x[None])
    count = int(np.count_nonzero(bad) + np.count_nonzero(bad_unseen))
    if not count:
        return evidence, best
    note = f"position outliers against the fitted model not used: {count}"
    return dataclasses.replace(evidence, removed=(*evidence.removed, note)), best


def _reread(samples: Samples, weights: tuple[float, ...]) -> Samples:
    """The samples with their force averaged by `weights` and straight in between."""
    force = samples.force.copy()
    for a, b in itertools.pairwise([*samples.first.tolist(), len(samples)]):
        force[a:b] = convolve1d(samples.force[a:b], np.array(weights), mode="nearest")
    return dataclasses.replace(samples, force=force, linear=True)
