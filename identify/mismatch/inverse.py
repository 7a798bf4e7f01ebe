"""Force error of the inverse model, the figure the robotics literature quotes (Gautier, Janot & Vandanjon 2013)."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from identify.kernels.inverse import unexplained_force
from identify.mismatch.extended import ExtendedProblem
from identify.mismatch.guise import Guise
from identify.preprocess import Samples
from plant.kernels.laws import LANES, POSITION

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

ORDER = 4
HIGHEST_CUT = 100.0  # Hz
CUT_SHARE = 0.2  # of the sampling rate
EDGE = 2.0  # periods of the cut left out at the ends of a run, where the filter has one side only
MUCH = 0.1  # of the largest force of an effect: there it acts
LASTS = 10  # samples for which the predictor feels a force
FEWEST = 60  # samples of a run that a zero-phase filter can take


@dataclass(frozen=True, slots=True, eq=False)
class Unexplained:
    """Drive force and what the model lacks of it, both low-passed without phase.

    Attributes:
        index: of the samples they belong to. (k,)
        force: drive force. [N] (k,)
        lacking: drive force minus inverse model. [N] (k,)
    """

    index: Ints
    force: Floats
    lacking: Floats

    @property
    def error(self) -> float:
        """100 ||F - F^|| / ||F|| of the drive force. [%]."""
        return 100.0 * float(np.linalg.norm(self.lacking) / max(float(np.linalg.norm(self.force)), 1e-300))


def unexplained(
    model: ExtendedProblem, x: Floats, samples: Samples, highest_cut: float = HIGHEST_CUT, substeps: int = 2
) -> Unexplained | None:
    """Run the inverse model with unknowns x (>= p,) over `samples` in `substeps` at least; None where there is none.

    There is none for two masses measured at the motor.

    Position is low-passed without phase and differentiated; drive force and residual pass the same filter.
    """
    problem = model.on(samples)
    x = np.concatenate([x[: problem.p], np.zeros(2 * samples.runs)])
    blocks = problem.blocks(x[None])
    if blocks.observed != POSITION:
        return None
    rate = 1.0 / samples.sample_time
    cut = min(highest_cut, CUT_SHARE * rate)
    sections = butter(ORDER, cut / (0.5 * rate), output="sos")
    edge = int(np.ceil(EDGE * rate / cut - 1e-9))
    drive = problem.drive(np.full(LANES, blocks.delay[0]))
    index, force, lacking = [], [], []
    for a, b in itertools.pairwise([*samples.first.tolist(), len(samples)]):
        if b - a < max(FEWEST, 3 * edge):
            continue
        position = sosfiltfilt(sections, samples.position[a:b])
        velocity = np.gradient(position, samples.t[a:b])
        out = np.empty(b - a)
        unexplained_force(
            blocks.b[0],
            blocks.laws,
            blocks.structure,
            drive[a:b],
            position,
            velocity,
            samples.t[a:b],
            samples.steps[a:b],
            np.zeros(b - a, dtype=np.int64),
            max(substeps, blocks.substeps_for_effects(samples.sample_time)),
            out,
        )
        inner = slice(edge, b - a - edge)
        index.append(np.arange(a, b)[inner])
        force.append(sosfiltfilt(sections, samples.force[a:b])[inner])
        lacking.append(-sosfiltfilt(sections, out)[inner])
    if not force:
        return None
    return Unexplained(np.concatenate(index), np.concatenate(force), np.concatenate(lacking))


def effect_series(problem: ExtendedProblem, x: Floats, guise: Guise) -> tuple[Ints, Floats] | None:
    """Samples (k,), and the force that `guise` brings there at unknowns x (size,) [N] (k,); None without an inverse.

    Both models march in the same steps: where the axis leaves a rest, other steps are a force of newtons.
    """
    slot = problem.slot(guise)
    without = problem.including(tuple(other for other in problem.guises if other is not guise))
    bare = np.concatenate([x[: slot.start], x[slot.stop : problem.p]])
    asked = problem.blocks(x[None]).substeps_for_effects(problem.samples.sample_time)
    here = unexplained(problem, x, problem.samples)
    there = unexplained(without, bare, problem.samples, substeps=max(2, asked))
    return None if here is None or there is None else (here.index, here.lacking - there.lacking)


def acting(problem: ExtendedProblem, x: Floats, guise: Guise) -> Bools | None:
    """Samples at which `guise` brings much of its largest force, or just did. (n,); None where there is no inverse."""
    found = effect_series(problem, x, guise)
    if found is None:
        return None
    index, force = found
    near = np.zeros(len(problem.samples), dtype=np.bool_)
    for late in range(LASTS):
        at = index[np.abs(force) > MUCH * float(np.abs(force).max())] + late
        near[at[at < len(near)]] = True
    return near


def effect_force(problem: ExtendedProblem, x: Floats, guise: Guise) -> tuple[float, float]:
    """Force that `guise` brings at unknowns x (size,), infinite where there is no inverse. [N] twice.

    Returns:
        Its rms over the motion, and its rms where it acts: weighted by its own square, so that a place or an event
        counts in full.
    """
    found = effect_series(problem, x, guise)
    if found is None:
        return float("inf"), float("inf")
    with np.errstate(all="ignore"):
        square = found[1] ** 2
        acting = float(np.sqrt(np.sum(square**2) / max(float(np.sum(square)), 1e-300)))
        return float(np.sqrt(np.mean(square))), acting
