"""The front door of the diagnosis: recordings and axis in; verdict, names, sizes, rivals and proof out."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from identify.criterion import noise_level
from identify.errors import InputError
from identify.judge import median_speed, too_broken, unusable
from identify.mismatch.all_over import may_lack, tells_more
from identify.mismatch.alone import loudest_alone
from identify.mismatch.baseline import felt, fit_baseline, read_again, read_torque
from identify.mismatch.carried import carried
from identify.mismatch.compare import Fit, fit
from identify.mismatch.conclusion import Conclusion
from identify.mismatch.curve import curve
from identify.mismatch.data import Evidence, Judges, digest, gather
from identify.mismatch.guise import Guise, Setting
from identify.mismatch.once import happened_once
from identify.mismatch.progress import Doing, Stage, Tell, unheard
from identify.mismatch.report_values import Measured, measured
from identify.mismatch.residual import RESTING, setting_of
from identify.mismatch.result import Diagnosis, Verdict
from identify.mismatch.rules import BIC, price
from identify.mismatch.select import Selection, select
from identify.mismatch.twice import told_twice
from identify.mismatch.uncatalogued import uncatalogued
from identify.mismatch.wandering import STEP
from identify.mismatch.ways import guises
from identify.mismatch.written import written
from identify.preprocess import Samples, prepare, smooth_velocity
from identify.result import FrictionCurve
from identify.threads import at_most
from identify.uncertainty import Uncertainty
from plant.axis import Axis, TorqueHold
from plant.effects import find, names
from plant.recording import Recording

Floats = NDArray[np.float64]

FEWEST_MOVING = 100  # samples in motion
SET_ASIDE = "{} set aside: {}"
NOISE_TRAVEL = 30.0  # noise levels of travel, below which nothing can be said
RESTLESS = 0.3  # of the variance of a loop's logged force, white: what acted is known where the axis has felt that
KNOWN_AT_BEST = 1e-3  # of a scaled unknown: friction repeats no better
UNKNOWN = 3.0  # of a scaled unknown: a prior that hardly binds
ELASTIC = 0.8  # of the force's variance that goes with the position: machines that slide have 0.4 at most
CURVE_KNOWN = 0.25  # relative half-width of friction at the usual speed


def diagnose(
    recordings: Sequence[Recording],
    axis: Axis,
    *,
    seed: int = 0,
    progress: Tell = unheard,
    threads: int = 1,
) -> Diagnosis:
    """Say whether the baseline model leaves physics out, which, how big, and what else it could be.

    Args:
        recordings: one or more of one machine; notes `commissioning` and `today` mark a before/after pair, otherwise
            they are repeats with other excitation, the last of which is held out.
        axis: what the commissioning engineer knows.
        seed: of the search.
        progress: told what is being done, before each step.
        threads: processors to use at once; the answer does not depend on it.

    Raises:
        InputError: no recording, or no thread.
    """
    if threads < 1:
        raise InputError(f"threads is {threads}, but must be at least 1")
    with at_most(threads):
        found = conclude(recordings, axis, seed=seed, progress=progress)
        return found if isinstance(found, Diagnosis) else written(found)


def conclude(
    recordings: Sequence[Recording],
    axis: Axis,
    *,
    seed: int = 0,
    progress: Tell = unheard,
) -> Conclusion | Diagnosis:
    """As `diagnose`, but not yet written up; a diagnosis only where the recordings cannot tell."""
    if not recordings:
        raise InputError("no recording to diagnose: give one, or list [[recording]] in the axis file")
    ready = []
    for recording in recordings:
        reason = unusable(recording, axis)
        if reason is None:
            ready.append(prepare(recording, axis))
            reason = too_broken(ready[-1])
        if reason is not None:
            return _insufficient(recordings, axis, seed, f"{recording.source or 'recording'}: {reason}")
    recordings, still = _moving(recordings, ready, axis)
    doubtful = all(
        recording.loop == "closed" and recording.hold in (TorqueHold.HOLD, TorqueHold.UNKNOWN)
        for recording in recordings
    )
    reason = _too_restless(gather(recordings, axis), axis, seed) if doubtful else None
    if reason is not None:
        return _insufficient(recordings, axis, seed, reason)

    def asked(gathered: Evidence, of: Sequence[Recording] = recordings) -> Conclusion | Diagnosis:
        return _known_before(_selected(of, gathered, axis, doubtful, seed, progress))

    together = _together(lambda judges: asked(gather(recordings, axis, judges, still)))
    if isinstance(together, Diagnosis):
        return together
    if may_lack(together):
        progress(Doing(Stage.BASELINE, "tenths from all over the recordings"))
        tenths = asked(gather(recordings, axis, Judges.TENTHS, still))
        if isinstance(tenths, Conclusion) and tells_more(tenths, together):
            return tenths
    if together.verdict is not Verdict.NO_MISMATCH:
        return together
    progress(Doing(Stage.BASELINE, "each recording by itself"))
    loudest = loudest_alone(together, recordings, still, doubtful)
    if loudest is None:
        return together
    alone = asked(loudest.evidence, loudest.recordings)
    return alone if isinstance(alone, Conclusion) and loudest.stands(alone) else together


def _together(judged_by: Callable[[Judges], Conclusion | Diagnosis]) -> Conclusion | Diagnosis:
    """What all recordings say: judged by the last, and by others where that may tell more."""
    first = judged_by(Judges.LAST)
    if isinstance(first, Diagnosis):
        return first
    if first.verdict is Verdict.EXPLAINED:
        other = None if first.selection.steps or not first.torn else judged_by(Judges.PART)
        if (
            isinstance(other, Conclusion)
            and other.verdict is Verdict.EXPLAINED
            and other.selection.steps
            and not other.slight
        ):
            return other  # a constant force is no reason why recordings disagree
        return first
    several = first.evidence.kind == "recording"
    nothing = first.verdict is Verdict.NO_MISMATCH
    further = nothing and not several and first.outreached
    parts = (nothing and several and first.hinted) or (first.torn and (first.spelled or not first.happened))
    unpaid = not parts and first.unpaid
    begun = not several and bool(first.bent or (not first.recognised and (first.foretells_name or first.kept)))
    asked = judged_by(Judges.PART) if parts or unpaid or begun or further else first
    part = first if isinstance(asked, Diagnosis) else asked
    repeated = unpaid and part.repeats(first)
    named = further and part.verdict is Verdict.EXPLAINED
    more = part if parts or repeated or named else first
    found = more if _tells(more, first) else first
    explained = found.verdict is Verdict.EXPLAINED
    if not several:
        if part.straightens(first) or part.outweighs(first):
            return part
        if explained or first.recognised or part is first:
            return found
        return told_twice(first, part) or found
    if first.recognised or (explained and found.said != {STEP}):
        return found
    turned = judged_by(Judges.OTHERS)
    if isinstance(turned, Diagnosis):
        return found
    if not explained:
        again = turned if turned.holds_beside(first) else carried(first, turned)
        if again is not None:
            return again
    if found.verdict is Verdict.NO_MISMATCH and first.confirms(turned):
        return turned
    twice = None if explained else told_twice(first, turned)
    left = turned if turned.outlasts(found) else found
    return twice or happened_once(first) or happened_once(turned) or left


def _moving(
    recordings: Sequence[Recording], ready: Sequence[Samples], axis: Axis
) -> tuple[Sequence[Recording], tuple[str, ...]]:
    """The recordings in which the axis moves, and what is said of the others; all, where none of a state is left.

    One that stays where it is tells nothing of friction, and must not be all that is fitted, or all that judges.
    """
    said = [_hardly_moves(samples, axis) for samples in ready]
    for before in (True, False):
        state = [why for why, r in zip(said, recordings, strict=True) if (r.note.strip() == "commissioning") is before]
        if state and None not in state:
            return recordings, ()
    moving = [recording for recording, why in zip(recordings, said, strict=True) if why is None]
    return moving, tuple(
        SET_ASIDE.format(Path(recording.source).name or f"recording {number + 1}", why)
        for number, (recording, why) in enumerate(zip(recordings, said, strict=True))
        if why is not None
    )


def _tells(parts: Conclusion, whole: Conclusion) -> bool:
    """Whether what `parts` of a recording say is the answer, and not what `whole` ones said without a name."""
    if parts.verdict is Verdict.EXPLAINED:
        return not (parts.slight or whole.denies(parts.said) or whole.outdoes(parts))
    told = whole.spelled or whole.confirmed or (whole.recognised and not parts.recognised)
    less = {Verdict.NO_MISMATCH, Verdict.UNEXPLAINED} if told else {Verdict.NO_MISMATCH}
    return not (parts.verdict in less and whole.verdict is Verdict.UNEXPLAINED)


def _selected(
    recordings: Sequence[Recording], gathered: Evidence, axis: Axis, doubtful: bool, seed: int, progress: Tell
) -> Conclusion | Diagnosis:
    """Baseline and effects for one way to hold data out."""
    progress(Doing(Stage.BASELINE, "baseline"))
    evidence, baseline = read_torque(gathered, axis, doubtful, seed)
    reason = _too_little(evidence.train, axis)
    if reason is not None:
        return _insufficient(recordings, axis, seed, reason)
    unknown = _unknown_friction(baseline, evidence.train)
    native = max(float(np.median(np.diff(recording.t))) for recording in recordings)
    setting, ways, selection = _search(evidence, baseline, native, progress)
    again = read_again(gathered, evidence, selection.chosen, seed) if doubtful and selection.steps else None
    if again is not None:
        evidence, baseline = again
        setting, ways, selection = _search(evidence, baseline, native, progress)
    found = Conclusion(axis, seed, recordings, evidence, setting, selection, ways, progress, selection.baseline)
    found = found.or_constant()
    if unknown is not None and not (found.explains and _unknown_friction(found.final, evidence.train) is None):
        return _insufficient(recordings, axis, seed, unknown)  # a drive that is late hides friction from the baseline
    return found


def _known_before(found: Conclusion | Diagnosis) -> Conclusion | Diagnosis:
    """`found` today, or what explains today as well with the friction that the machine had at commissioning.

    Friction that may bend swallows most of an effect that has appeared since. Where it did bend, the search is run
    again with friction as well known as commissioning tells it; effects that make a bend unnecessary are the answer,
    as long as they predict unseen data better than bent friction does.
    """
    if isinstance(found, Diagnosis) or found.evidence.before is None:
        return found
    free = found.plain
    healthy = measured(fit_baseline(found.evidence.before, found.axis, found.seed))
    known = _knowledge(healthy, free)
    starts = np.stack([free.x, free.x])
    starts[1, : len(known[0])] = known[0]
    tied = fit(free.problem.knowing(known), starts)
    if found.explains and price(tied) < price(free) - BIC:
        return found
    setting, ways, selection = _search(found.evidence, tied, found.setting.native_time, found.progress)
    bent = float(np.log(free.problem.samples.used))  # price of one friction parameter of its own
    if not selection.steps or price(selection.chosen) > price(found.selection.chosen) + bent:
        return found
    since = dataclasses.replace(found, setting=setting, ways=ways, selection=selection, plain=free)
    return since if since.explains or (found.explains and since.stands) else found


def _knowledge(healthy: Measured, today: Fit) -> tuple[Floats, Floats]:
    """Centre and standard deviation of the baseline's unknowns, as scaled `today`, from the healthy machine."""
    problem = today.problem
    rows = healthy.fit.problem.named(healthy.fit.x)
    centre = problem.encode({name: value for name, _, value, _, _ in rows})[: problem.base]
    own = [scale for *_, scale in problem.named(today.x)]
    ratio = np.array([scale for *_, scale in rows]) / np.array(own)
    spread = np.sqrt(np.diag(healthy.spread.covariance)[: problem.base]) * ratio
    spread = np.where(healthy.spread.at_bound[: problem.base], UNKNOWN, spread)
    return centre, np.clip(spread, KNOWN_AT_BEST, UNKNOWN)


def _search(evidence: Evidence, baseline: Fit, native: float, progress: Tell) -> tuple[Setting, list[Guise], Selection]:
    """What recordings of this `native` period [s] can hold, and what was found in them."""
    setting = setting_of(baseline.problem, baseline.x, native)
    ways = guises({name: find(name) for name in names()}, setting)
    offered = [*ways, *uncatalogued(setting, names()), curve()]
    return setting, ways, select(baseline, offered, evidence.held_out, progress)


def _too_restless(logged: Evidence, axis: Axis, seed: int) -> str | None:
    """Why what acted between the samples of a loop is not known, or None."""
    restless = _restless(logged.train.force)
    if restless <= RESTLESS or felt(logged, axis, seed):
        return None
    return (
        f"{restless:.0%} of the logged force is restlessness from sample to sample that the axis has not felt so: what "
        "acted between the samples of this loop is not known; log its mean, or filter the loop's velocity"
    )


def _restless(force: Floats) -> float:
    """Share of the variance of a force (n,) that is white, from its second differences (von Neumann 1941)."""
    white = float(np.mean(np.diff(force, 2) ** 2)) / 6.0
    return white / max(float(np.var(force)), 1e-300)


def _insufficient(recordings: Sequence[Recording], axis: Axis, seed: int, reason: str) -> Diagnosis:
    """The verdict insufficient_data with its reason."""
    return Diagnosis(
        verdict=Verdict.INSUFFICIENT_DATA,
        axis=axis.name,
        explanation=f"These recordings cannot tell: {reason}.",
        reason=reason,
        seed=seed,
        data_sha256=digest(recordings),
    )


def _too_little(samples: Samples, axis: Axis) -> str | None:
    """Why the motion cannot carry a diagnosis, or None."""
    still = _hardly_moves(samples, axis)
    if still is not None:
        return still
    bent = _elastic(samples)
    if bent > ELASTIC:
        return f"the position follows the force like a spring ({bent:.0%}): the axis bends and hardly slides"
    return None


def _hardly_moves(samples: Samples, axis: Axis) -> str | None:
    """Why there is too little motion to tell anything of friction, or None."""
    velocity = np.abs(smooth_velocity(samples))
    moving = int(np.count_nonzero(velocity > RESTING * float(velocity.max())))
    travel = float(np.ptp(samples.position))
    noise = noise_level(samples.position)
    if travel < NOISE_TRAVEL * noise:
        return f"the axis moved {travel:.2g} {axis.position_unit}, {travel / noise:.0f} times the noise of its position"
    if moving < FEWEST_MOVING:
        return f"only {moving} samples show motion"
    return None


def _unknown_friction(fitted: Fit, samples: Samples) -> str | None:
    """Why a model's friction is not known, or None."""
    usual, fastest = median_speed(samples)
    problem = fitted.problem
    curve = FrictionCurve(
        fitted.x[:4], problem.scales.force, problem.scales.speed, fastest, _from_noise(fitted).part(4)
    )
    force, half = curve.at([usual])
    if half[0] <= CURVE_KNOWN * abs(force[0]):
        return None
    unit = problem.axis.position_unit
    return f"friction at the usual speed of {usual:.2g} {unit}/s is {force[0]:.2g} ± {half[0]:.1g}: not known"


def _elastic(samples: Samples) -> float:
    """Share of the force's variance that goes with the position, as in a spring; 0 where it goes against it."""
    position, force = (part - part.mean() for part in (samples.position, samples.force))
    together = float(position @ force)
    return max(together, 0.0) ** 2 / max(float(position @ position) * float(force @ force), 1e-300)


def _from_noise(fitted: Fit) -> Uncertainty:
    """Uncertainty if the model were right: how much the motion tells, not how well the model fits."""
    problem = fitted.problem
    error, slope = problem.jacobian(fitted.x, fitted.found.gain)
    variance = float(error @ error) / len(error) + 1e-300
    precision = slope.T @ slope / variance + np.diag(1.0 / problem.prior[1] ** 2)
    covariance = np.asarray(np.linalg.pinv(precision, hermitian=True), dtype=np.float64)
    return Uncertainty(covariance, np.zeros(len(fitted.x), dtype=np.bool_))
