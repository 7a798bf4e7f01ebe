"""The numbers behind the pictures of a diagnosis: what a reader must see to believe it. Pure arrays, no plotting."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.criterion import restarted
from identify.mismatch.compare import Fit, free_errors
from identify.mismatch.data import Evidence
from identify.mismatch.grids import Grid, grids_of
from identify.mismatch.maps import BINS, Map, maps_of
from identify.mismatch.result import Quantity
from identify.mismatch.rules import Step, tied
from identify.mismatch.select import Selection
from identify.preprocess import Samples

Floats = NDArray[np.float64]

POINTS = 600  # of a running sum
MOST_POINTS = 4000  # of the predictions


@dataclass(frozen=True, slots=True, eq=False)
class Accrual:
    """Where the log-likelihood gained by the extended model comes from, on the data that were fitted.

    Attributes:
        seconds: of fitted data. [s] (k,)
        running: log-likelihood gained up to there. [1] (k,)
        position: middles of bins. [m] (b,)
        gained: log-likelihood gained in each bin. [1] (b,)
    """

    seconds: Floats
    running: Floats
    position: Floats
    gained: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Prediction:
    """One-second free runs on data that no fit has seen; a new run begins where `run` changes.

    Attributes:
        t: [s] (k,)
        run: index of the free run. (k,)
        position: measured. [m] (k,)
        before, after: measured minus predicted position, baseline and extended model. [m] (k,)
    """

    t: Floats
    run: NDArray[np.int64]
    position: Floats
    before: Floats
    after: Floats | None


@dataclass(frozen=True, slots=True)
class Tried:
    """One effect that was fitted in full or looked at, and what became of it.

    Attributes:
        stage: 1 for the first effect searched, 2 for the second on top of it, ...
        evidence: fall of the Bayes information criterion; a name needs 25. [1]
        z: mean over standard error of the evidence over twenty blocks. [1]
        free_run: squared one-second errors, with over without it. [1]
        force_rms: force it brings. [N]
    """

    stage: int
    name: str
    evidence: float
    z: float
    free_run: float
    force_rms: float
    outcome: str


@dataclass(frozen=True, slots=True, eq=False)
class Pictures:
    """Everything a report draws beside the diagnosis itself.

    Attributes:
        maps: residual force along coordinates, the effects' own first.
        grids: residual force over position and velocity, and over position and time.
        accrual: None where no effect was named.
        prediction: on held-out data.
        tried: fits in the order of the search, the likeliest of each stage first.
        screened: effects whose response promised nothing, never fitted.
        friction: "baseline" and "extended" -> parameters of the friction law by name.
        samples: "fitted" and "unseen" -> number of samples.
        sample_time: of the analysis. [s]
        position_unit, force_unit: of all of the above.
    """

    maps: tuple[Map, ...]
    grids: tuple[Grid, ...]
    accrual: Accrual | None
    prediction: Prediction
    tried: tuple[Tried, ...]
    screened: tuple[str, ...]
    friction: dict[str, dict[str, Quantity]]
    samples: dict[str, int]
    sample_time: float
    position_unit: str
    force_unit: str


def pictures_of(
    selection: Selection,
    baseline: Fit,
    named: Fit | None,
    evidence: Evidence,
    wanted: Sequence[str],
    offered: Collection[str],
    told: Collection[str],
) -> Pictures:
    """Take the pictures of a finished search.

    Args:
        selection: what was searched and found.
        baseline: what everybody would fit.
        named: the extended model that stands, None where none does.
        evidence: fitted and held-out samples.
        wanted: coordinates to draw, most telling first.
        offered: names of all effects that were looked at.
        told: names that the answer gives.
    """
    axis = baseline.problem.axis
    fits = {"baseline": baseline} if named is None else {"baseline": baseline, "extended": named}
    tried = _tried(selection, told)
    return Pictures(
        maps=maps_of(baseline, named, evidence, wanted),
        grids=grids_of(baseline, named, evidence),
        accrual=None if named is None else _accrual(baseline, named),
        prediction=_prediction(baseline, named, evidence.held_out),
        tried=tried,
        screened=tuple(sorted(set(offered) - {one.name for one in tried})),
        friction={model: friction_of(fitted) for model, fitted in fits.items()},
        samples={"fitted": evidence.train.used, "unseen": evidence.held_out.used},
        sample_time=evidence.train.sample_time,
        position_unit=axis.position_unit,
        force_unit=axis.force_unit,
    )


def friction_of(fitted: Fit) -> dict[str, Quantity]:
    """Parameters of the friction law and the constant force of a fit, with 95 % intervals."""
    problem, spread = fitted.problem, fitted.spread
    half = spread.half_widths(np.eye(len(fitted.x)))
    found = {}
    for index, (name, unit, value, logarithmic, scale) in enumerate(problem.named(fitted.x)):
        if logarithmic:
            factor = float(np.exp(min(half[index], 50.0)))
            interval = (value / factor, value * factor)
        else:
            interval = (value - scale * float(half[index]), value + scale * float(half[index]))
        found[name] = Quantity(value, unit, None if spread.at_bound[index] else interval)
    return found


def _accrual(baseline: Fit, named: Fit) -> Accrual:
    """Running log-likelihood gain over the fitted samples, and where along the travel it comes from."""
    samples = baseline.problem.samples
    gained = named.terms() - baseline.terms()
    seconds = np.cumsum(np.append(0.0, np.where(samples.steps[:-1] > 0, samples.steps[:-1], samples.sample_time)))
    shown = np.unique(np.linspace(0, len(gained) - 1, POINTS).astype(np.int64))
    edges = np.linspace(samples.position.min(), samples.position.max(), BINS + 1)
    place = np.clip(np.digitize(samples.position, edges) - 1, 0, BINS - 1)
    return Accrual(
        seconds[shown],
        np.cumsum(gained)[shown],
        0.5 * (edges[1:] + edges[:-1]),
        np.bincount(place, gained, minlength=BINS).astype(np.float64),
    )


def _prediction(baseline: Fit, named: Fit | None, held_out: Samples) -> Prediction:
    """Errors of one-second free runs on `held_out`."""
    samples, states = restarted(held_out)
    errors = [free_errors(fitted, samples, states) for fitted in (baseline, named or baseline)]
    shown = slice(None, None, max(1, -(-len(samples) // MOST_POINTS)))
    after = None if named is None else errors[1][shown]
    return Prediction(samples.t[shown], samples.run[shown], samples.position[shown], errors[0][shown], after)


def _tried(selection: Selection, told: Collection[str]) -> tuple[Tried, ...]:
    """Every effect that was fitted, per stage of the search, in its best guise."""
    found = []
    for stage, steps in enumerate(selection.rivals, 1):
        accepted = [step for step in steps if step.refused is None]
        winner = min(accepted, key=lambda step: step.evidence.bic) if accepted else None
        close = {step.guise.name for step in tied(winner, steps)} if winner is not None else set()
        best: dict[str, Step] = {}
        for step in sorted(steps, key=lambda step: step.evidence.bic):
            best.setdefault(step.guise.name, step)
        for name, step in best.items():
            seen = step.evidence
            outcome = _outcome(step, winner, name in told, name in close)
            found.append(Tried(stage, name, -seen.bic, seen.z, seen.free_run, step.force_rms, outcome))
    return tuple(found)


def _outcome(step: Step, winner: Step | None, told: bool, close: bool) -> str:
    """What became of a candidate, in words."""
    if told:
        return "named"
    if step.refused is not None:
        return f"refused: {step.refused}"
    if winner is None or step.guise.name == winner.guise.name:
        return "fits best here, but did not stand at the end"
    if close:
        return "cannot be told from the best"
    return f"explains less: evidence {step.evidence.bic - winner.evidence.bic:.0f} lower"
