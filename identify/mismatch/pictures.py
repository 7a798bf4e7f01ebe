"""The numbers behind the pictures of a diagnosis: what a reader must see to believe it. Pure arrays, no plotting."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.criterion import FREE, restarted
from identify.mismatch.compare import Fit
from identify.mismatch.data import Evidence, join
from identify.mismatch.inverse import Unexplained, unexplained
from identify.mismatch.locate import coordinates
from identify.mismatch.report_values import spread_of
from identify.mismatch.result import Quantity
from identify.mismatch.rules import Step, tied
from identify.mismatch.select import Selection
from identify.preprocess import Samples

Floats = NDArray[np.float64]

CUT = 12.0  # Hz of the residual force; bins average what noise is left
BINS = 48  # along a coordinate
FEWEST = 8  # samples of each direction in a bin that is drawn
BOTH = 0.5  # share of bins with both directions, below which halves are taken over all samples
POINTS = 600  # of a running sum
MOST_POINTS = 4000  # of the predictions
AS_DRAWN = {"direction": "speed", "velocity": "speed"}  # even and odd half already split by direction
ALWAYS = ("position", "speed")
EVEN_BINS = {"position", "time", "motor_angle", "pulley_angle"}  # others: as many samples in each bin


@dataclass(frozen=True, slots=True, eq=False)
class Halves:
    """Residual force in the bins of a coordinate; NaN where too few samples fall into one.

    Attributes:
        even: half that is the same in both directions of travel. [N] (k,)
        odd: half that flips with the direction: friction. [N] (k,)
        rms: of the residual force. [N] (k,)
    """

    even: Floats
    odd: Floats
    rms: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Map:
    """Residual force along one coordinate, of the baseline and of the extended model (None where there is none)."""

    coordinate: str
    unit: str
    middle: Floats
    before: Halves
    after: Halves | None


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
    named: Fit | None,
    evidence: Evidence,
    wanted: Sequence[str],
    offered: Collection[str],
) -> Pictures:
    """Take the pictures of a finished search.

    Args:
        selection: what was searched and found.
        named: the extended model that stands, None where none does.
        evidence: fitted and held-out samples.
        wanted: coordinates to draw, most telling first.
        offered: names of all effects that were looked at.
    """
    baseline = selection.baseline
    axis = baseline.problem.axis
    fits = {"baseline": baseline} if named is None else {"baseline": baseline, "extended": named}
    tried = _tried(selection, set() if named is None else set(named.names))
    return Pictures(
        maps=_maps(baseline, named, evidence, wanted),
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
    problem, spread = fitted.problem, spread_of(fitted)
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


def _maps(baseline: Fit, named: Fit | None, evidence: Evidence, wanted: Sequence[str]) -> tuple[Map, ...]:
    """Residual force along the wanted coordinates, then along position and speed."""
    axis = baseline.problem.axis
    names = dict.fromkeys([*(AS_DRAWN.get(name, name) for name in wanted), *ALWAYS])
    found = []
    for parts in ((evidence.train,), (evidence.train, evidence.held_out)):
        samples = join(parts)
        before = unexplained(baseline.problem, baseline.x, samples, CUT)
        after = None if named is None else unexplained(named.problem, named.x, samples, CUT)
        if before is None:
            return ()
        along = coordinates(samples, axis)
        along["speed"] = np.abs(along["velocity"])
        for name in names:
            if name in along and (name == "time") == (len(parts) == 1):  # clocks of two recordings are not one
                edges = _edges(name, along[name][before.index])
                if len(edges) > 2:
                    unit = unit_of(name, axis.position_unit)
                    middle = 0.5 * (edges[1:] + edges[:-1])
                    halves = [
                        None if one is None else _halves(one, along[name], along["direction"], edges)
                        for one in (before, after)
                    ]
                    if halves[0] is not None:
                        found.append(Map(name, unit, middle, halves[0], halves[1]))
    order = list(names)
    return tuple(sorted(found, key=lambda one: order.index(one.coordinate)))


def _edges(name: str, x: Floats) -> Floats:
    """Edges of the bins along coordinate values x."""
    if name in EVEN_BINS:
        low, high = np.quantile(x, [0.002, 0.998])
        return np.linspace(low, high, BINS + 1) if high > low else np.empty(0)
    return np.unique(np.quantile(x, np.linspace(0.0, 1.0, BINS // 2 + 1)))


def _halves(left: Unexplained, along: Floats, direction: Floats, edges: Floats) -> Halves:
    """Means of the residual force in each bin, split by the direction of travel."""
    count = len(edges) - 1
    place = np.digitize(along[left.index], edges) - 1
    place[along[left.index] == edges[-1]] = count - 1
    inside = (place >= 0) & (place < count)
    place, force, sign = place[inside], left.lacking[inside], direction[left.index][inside]
    forward, backward = (_mean(place[sign == way], force[sign == way], count) for way in (1.0, -1.0))
    even, odd = 0.5 * (forward + backward), 0.5 * (forward - backward)
    if np.mean(np.isfinite(even)) < BOTH:
        even, odd = _mean(place, force, count), _mean(place[sign != 0], (force * sign)[sign != 0], count)
    return Halves(even, odd, np.sqrt(_mean(place, force**2, count)))


def _mean(place: NDArray[np.int64], value: Floats, count: int) -> Floats:
    """Mean of `value` in each of `count` bins; NaN where there are too few."""
    number = np.bincount(place, minlength=count)
    total = np.bincount(place, value, minlength=count)
    return np.where(number >= FEWEST, total / np.maximum(number, 1), np.nan)


def unit_of(name: str, length: str) -> str:
    """Unit of a coordinate; `length` is that of a position."""
    units = {
        "position": length,
        "distance_since_reversal": length,
        "speed": f"{length}/s",
        "velocity": f"{length}/s",
        "acceleration": f"{length}/s^2",
        "torque": "N*m",
        "torque_rate": "N*m/s",
        "motor_angle": "rad",
        "pulley_angle": "rad",
        "frequency": "Hz",
        "direction": "1",
    }
    return units.get(name, "s")


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
    errors: list[Floats] = []
    for fitted in (baseline, named or baseline):
        cut = fitted.problem.on(samples, states)
        x = np.concatenate([fitted.x[: fitted.problem.p], np.zeros(2 * samples.runs)])
        errors.append(cut.errors(x[None], FREE)[:, 0].copy())
    shown = slice(None, None, max(1, -(-len(samples) // MOST_POINTS)))
    after = None if named is None else errors[1][shown]
    return Prediction(samples.t[shown], samples.run[shown], samples.position[shown], errors[0][shown], after)


def _tried(selection: Selection, chosen: set[str]) -> tuple[Tried, ...]:
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
            outcome = _outcome(step, winner, name in chosen, name in close)
            found.append(Tried(stage, name, -seen.bic, seen.z, seen.free_run, step.force_rms, outcome))
    return tuple(found)


def _outcome(step: Step, winner: Step | None, chosen: bool, close: bool) -> str:
    """What became of a candidate, in words."""
    if chosen:
        return "named"
    if step.refused is not None:
        return f"refused: {step.refused}"
    if winner is None or step.guise.name == winner.guise.name:
        return "fits best here, but did not stand at the end"
    if close:
        return "cannot be told from the best"
    return f"explains less: evidence {step.evidence.bic - winner.evidence.bic:.0f} lower"
