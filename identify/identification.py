"""The front door: one recording in; parameters with honest intervals, or a reasoned refusal, out."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from identify.criterion import one_run_criterion, short_run_criterion
from identify.errors import InputError
from identify.judge import median_speed, too_broken, uninformative, unusable, with_hints
from identify.latent import latent_force
from identify.mismatch.extended import ExtendedProblem
from identify.observer import gain_table
from identify.outliers import late_outliers, without
from identify.output_error import output_error_search
from identify.paper_method import identify_as_in_the_paper
from identify.polish import polish
from identify.preprocess import Samples, prepare
from identify.problem import FrictionProblem
from identify.profile import BETTER, Alternative, alternatives, doubtful
from identify.promoted import describe_effects, with_effects, without_twin
from identify.reach import reachable
from identify.result import FrictionCurve, IdentificationResult, Parameter, Verdict
from identify.search import ROUGH, SearchResult, losses_by_gain, nearby, observer_search
from identify.uncertainty import Uncertainty, uncertainty
from plant.axis import Axis
from plant.effects import find
from plant.recording import Recording

Floats = NDArray[np.float64]

METHODS = ("ga+polish", "paper")
CRITERIA = ("observer", "output_error")
FINER_SUBSTEP = 0.0025  # s: tried before the finest
SETTLED = 0.1  # standard errors by which the steps may move a parameter
FINISHES = 3  # polishes in fine steps: the likeliest gain may change once the steps err less
TRAIN = 0.6  # of the samples; the rest is held out
FRICTION = 4  # unknowns of the friction law, which come first
FORCE_KNOWN = 0.5  # half-width over the friction level, below which a force counts as identified
LOG_KNOWN = 0.7  # half-width of a logarithm: a factor of two either way


def identify_friction(
    recording: Recording,
    axis: Axis,
    *,
    seed: int = 0,
    method: str = "ga+polish",
    criterion: str = "observer",
    start: Mapping[str, float] | None = None,
    effects: Sequence[str] = (),
) -> IdentificationResult:
    """Identify the friction law of eq. (1) and (5) from one recording.

    Args:
        recording: samples of one run of the axis; the whole of it is used.
        axis: its constants; with `inertia_known = false` the moving mass is estimated too.
        seed: of the search; the same seed gives the same result, bit by bit, on one kind of processor.
        method: "ga+polish" (genetic start, then least squares) or "paper" (the genetic algorithm of §3 on eq. (4),
            with the preprocessing of §5).
        criterion: what "ga+polish" minimises: "observer", the one-step prediction with a disturbance observer, right
            on machines with unmodelled forces; or "output_error", eq. (4) over one free run, right without them only.
        start: parameter values to try first, for instance the axis' last answer; they compete, they do not bind.
        effects: names of effects that the axis is known to have, for instance "rail_defect"; their parameters are
            fitted together with the friction and called "rail_defect.amplitude" and so on.

    Returns:
        Parameters with 95 % intervals and verdict; unusable samples give the verdict `bad_data`.

    Raises:
        InputError: an unknown method, criterion or effect, or effects with a method or criterion that knows none.
    """
    for word, value, known in (("method", method, METHODS), ("criterion", criterion, CRITERIA)):
        if value not in known:
            raise InputError(f"{word} {value!r} is not known: use one of {', '.join(known)}")
        if effects and value != known[0]:
            wanted = ", ".join(effects)
            raise InputError(f"{word} {value!r} fits no effects, but {wanted} is asked for: use {known[0]!r}")
    for name in effects:
        find(name)  # a wrong name is an error whatever the samples are
    reason = unusable(recording, axis)
    if reason is not None:
        return _refused(recording, axis, method, seed, reason)
    if method == "paper":
        return identify_as_in_the_paper(recording, axis, seed=seed)
    samples = prepare(recording, axis)
    reason = too_broken(samples)
    if reason is not None:
        return _refused(recording, axis, method, seed, reason)
    problem, found = fit(samples, axis, np.random.default_rng(seed), start, criterion, effects)
    if not found.free_run:
        found = reachable(problem, found)
    samples = problem.samples
    spread = uncertainty(problem, found.x, found.gain)
    others: list[Alternative] = []
    if doubtful(found.x, spread):
        problem, found, spread, others = _look_along_the_valley(problem, found, spread)
    parameters = describe(problem, found.x, spread, others)
    if isinstance(problem, ExtendedProblem):
        parameters = without_twin(parameters | describe_effects(problem, found, spread))
    parameters = with_hints(samples, parameters, axis)
    usual, fastest = median_speed(samples)
    curve = FrictionCurve(
        found.x[:4].copy(),
        problem.scales.force,
        problem.scales.speed,
        fastest,
        spread.part(4),
        tuple((other.x[:4].copy(), other.spread.part(4)) for other in others),
    )
    force, half = curve.at([usual])
    reason = uninformative(samples, parameters, float(force[0]), float(half[0]), axis)
    return IdentificationResult(
        verdict=Verdict.IDENTIFIED if reason is None else Verdict.NOT_INFORMATIVE,
        reason=reason,
        axis=axis.name,
        parameters=parameters,
        criterion=(one_run_criterion if found.free_run else short_run_criterion)(problem, found.x),
        held_out_criterion=_held_out(problem, found),
        method=method,
        evaluations=found.evaluations,
        seed=seed,
        samples=len(samples),
        start=float(recording.t[0]),
        end=float(recording.t[-1]) + recording.period,
        curve=curve,
        observer=(float(found.setting[0]), float(found.setting[1])),
        latent_force=latent_force(problem, found.x, found.gain),
        preprocessing=samples.removed,
    )


def fit(
    samples: Samples,
    axis: Axis,
    rng: np.random.Generator,
    start: Mapping[str, float] | None = None,
    criterion: str = "observer",
    effects: Sequence[str] = (),
) -> tuple[FrictionProblem, SearchResult]:
    """Search, polish in fine steps, and once more without the outliers that only the model could tell."""
    problem = FrictionProblem(samples, axis)
    search = observer_search if criterion == "observer" else output_error_search
    found = search(problem, rng, None if start is None else problem.encode(start))
    if effects:
        problem, found = with_effects(problem, found, effects, start or {}, rng)
    problem, found = finish(problem, found, polished=not found.free_run)
    bad = late_outliers(problem, found.x, found.gain)
    if not bad.any():
        return problem, found
    fewer = without(problem.samples, bad)
    note = f"position outliers against the fitted model not used: {np.count_nonzero(bad)}"
    return finish(problem.masked(dataclasses.replace(fewer, removed=(*fewer.removed, note))), found)


def finish(
    problem: FrictionProblem, found: SearchResult, *, polished: bool = False
) -> tuple[FrictionProblem, SearchResult]:
    """Polish once more in steps as fine as the data can tell: on clean data the search's own would err the most.

    Where `found` was `polished` in the very steps that are fine enough, nothing remains to be done.
    """
    fine = _steps_that_settle(problem, found)
    if polished and fine is problem:
        return problem, found
    gains, settings = gain_table(problem.samples.sample_time)
    x, gain, setting, evaluations = found.x, found.gain, found.setting, found.evaluations
    for attempt in range(FINISHES):
        end = polish(fine, x, gain, 10)
        x, evaluations = end.x, evaluations + end.evaluations
        if found.free_run or attempt == FINISHES - 1:
            break
        near = nearby(settings, int(np.flatnonzero((setting == settings.T).all(axis=1))[0]))
        index = int(near[np.argmin(losses_by_gain(fine, x[None], gains[:, near])[0])])
        evaluations += len(near)
        if np.array_equal(setting, settings[:, index]):
            break
        gain, setting = gains[:, index].copy(), settings[:, index].copy()
    found = dataclasses.replace(found, x=x, criterion=end.loss, gain=gain, setting=setting, evaluations=evaluations)
    return fine, found


def _steps_that_settle(problem: FrictionProblem, found: SearchResult) -> FrictionProblem:
    """The same problem in the longest steps whose error moves no parameter by a tenth of its standard error.

    Steps of half the length tell: of a second-order scheme they take away three quarters of the error, of its first
    order at reversals a half.
    """
    middle = problem.refined(FINER_SUBSTEP)
    error, slope = problem.jacobian(found.x, found.gain)
    change = error - middle.errors(found.x[None], found.gain)[:, 0]
    variance = float(error @ error) / problem.samples.used
    covariance = np.linalg.pinv(slope.T @ slope / variance + np.diag(problem.prior[1] ** -2.0), hermitian=True)
    moved = np.abs(covariance @ (slope.T @ change)) / variance
    allowed = SETTLED * np.sqrt(np.diag(covariance))
    for steps, remains in ((problem, 1.5), (middle, 0.5)):
        if (remains * moved < allowed)[: problem.p].all():
            return steps
    return problem.refined()


def _look_along_the_valley(
    problem: FrictionProblem, found: SearchResult, spread: Uncertainty
) -> tuple[FrictionProblem, SearchResult, Uncertainty, list[Alternative]]:
    """What fits about as well with another v_s; where one fits better, it is the answer."""
    others = alternatives(problem, found.x, found.gain, spread)
    if others and others[0].worse < -BETTER:
        problem, found = finish(problem, dataclasses.replace(found, x=others[0].x))
        spread = uncertainty(problem, found.x, found.gain)
        others = alternatives(problem, found.x, found.gain, spread)
    return problem, found, spread, others


def describe(
    problem: FrictionProblem, x: Floats, spread: Uncertainty, others: Sequence[Alternative] = ()
) -> dict[str, Parameter]:
    """Physical parameters of the unknowns x (size,) with intervals; logarithmic unknowns get asymmetric ones.

    The interval holds those of the `others`, which fit about as well.
    """
    low, high = _reach(problem, x, spread)
    for other in others:
        below, above = _reach(problem, other.x, other.spread)
        low, high = np.minimum(low, below), np.maximum(high, above)
    half = 0.5 * (high - low)
    level = max(x[0], x[1], 1e-12)
    friction = max(level, x[0] + x[3])  # at the speed that scales the unknowns
    parameters = {}
    for index, (name, unit, value, logarithmic, scale) in enumerate(problem.named(x)):  # effects are not among them
        at_bound = bool(spread.at_bound[index])
        if logarithmic:
            known = half[index] < LOG_KNOWN
            with np.errstate(over="ignore"):
                interval = (value * float(np.exp(low[index] - x[index])), value * float(np.exp(high[index] - x[index])))
        else:
            reference = {"viscous_coefficient": max(x[index], 0.5 * level), "constant_force": friction}.get(name, level)
            known = half[index] < FORCE_KNOWN * reference
            least = problem.bounds[0][index] if index < FRICTION else -np.inf  # friction pushes nothing forward
            interval = (float(max(low[index], least) * scale), float(high[index] * scale))
        identifiable = bool(known and not at_bound)
        parameters[name] = Parameter(name, value, unit, interval if identifiable else None, identifiable, at_bound)
    return parameters


def _reach(problem: FrictionProblem, x: Floats, spread: Uncertainty) -> tuple[Floats, Floats]:
    """Ends of the 95 % intervals of the first p scaled unknowns. (p,) each"""
    half = spread.half_widths(np.eye(len(x))[: problem.p])
    return x[: problem.p] - half, x[: problem.p] + half


def _held_out(problem: FrictionProblem, found: SearchResult) -> float:
    """Eq. (4) over one-second free runs on the last 40 %, fitted on the first 60 %. [1]"""
    samples = problem.samples
    cut = int(TRAIN * len(samples))
    train, test = problem.on(samples.part(0, cut)), problem.on(samples.part(cut, len(samples)))
    error, slope = problem.jacobian(found.x, found.gain)
    error, slope = error[:cut], slope[:cut]
    variance = float(error @ error) / train.samples.used + 1e-300
    centre, width = problem.prior
    normal = slope.T @ slope / variance + np.diag(width**-2.0)
    step = np.linalg.solve(normal, -slope.T @ error / variance - (found.x - centre) * width**-2.0)
    kept = problem.p + 2 * train.samples.runs
    points = np.clip(np.stack([found.x, found.x + step])[:, :kept], *train.bounds)
    before, after = train.losses(points, found.gain)
    fitted = points[1] if after < before else polish(train, points[0], found.gain, 15, ROUGH).x
    return short_run_criterion(test, np.concatenate([fitted[: problem.p], np.zeros(2 * test.samples.runs)]))


def _refused(recording: Recording, axis: Axis, method: str, seed: int, reason: str) -> IdentificationResult:
    """The verdict bad_data with its reason."""
    return IdentificationResult(
        verdict=Verdict.BAD_DATA,
        reason=reason,
        axis=axis.name,
        parameters={},
        criterion=None,
        held_out_criterion=None,
        method=method,
        evaluations=0,
        seed=seed,
        samples=len(recording),
        start=_or_zero(recording.t[0]),
        end=_or_zero(recording.t[-1]),
    )


def _or_zero(stamp: float) -> float:
    """The stamp, or 0 where it is none: JSON knows no NaN."""
    return float(stamp) if np.isfinite(stamp) else 0.0
