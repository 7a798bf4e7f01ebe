"""The front door of the diagnosis: recordings and axis in; verdict, names, sizes, rivals and proof out."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from identify.criterion import RUN_LENGTH, noise_level
from identify.errors import InputError
from identify.judge import median_speed, too_broken, unusable
from identify.mismatch import words
from identify.mismatch.baseline import read_torque
from identify.mismatch.changes import changes_since
from identify.mismatch.compare import Fit, fit, free_run_ratio
from identify.mismatch.data import Evidence, digest, gather
from identify.mismatch.detect import detectable
from identify.mismatch.experiment import Experiment, in_words, propose, settling
from identify.mismatch.force_error import force_errors, native
from identify.mismatch.guise import Guise, Setting, guises
from identify.mismatch.inverse import unexplained
from identify.mismatch.locate import COORDINATE, locate, named_location
from identify.mismatch.pictures import pictures_of
from identify.mismatch.report_values import quantities, spread_of
from identify.mismatch.residual import RESTING, setting_of
from identify.mismatch.result import Change, Diagnosis, FoundEffect, Location, Pair, Quantity, Verdict
from identify.mismatch.rivals import rivals_of, still_tied
from identify.mismatch.score import extend
from identify.mismatch.select import TIED_BIC, Selection, Step, select, tied, without
from identify.preprocess import Samples, prepare, smooth_velocity
from identify.result import FrictionCurve
from identify.uncertainty import Uncertainty
from plant.axis import Axis, TorqueHold
from plant.effects import find, names
from plant.recording import Recording

Floats = NDArray[np.float64]

CLEAN = 0.013  # of F_c: latent force of a complete model
REST = 0.05  # of F_c: latent force beside a name, above which ...
KEPT = 0.45  # ... and above which share of its former level, the name does not stand
OFFSET_PRIOR = 0.01  # of rated force: a constant force beyond it is an effect (design.md)
OFFSET_KNOWN = 0.5  # relative half-width of a constant force that may carry a name
FEWEST_MOVING = 100  # samples in motion
NOISE_TRAVEL = 30.0  # noise levels of travel, below which nothing can be said
CURVE_KNOWN = 0.25  # relative half-width of friction at the usual speed
HELD_OUT = 1.02  # ratio of squared one-second errors on held-out data above which a richer model is refused
EXACT = {"force_offset": "coulomb_asymmetry", "coulomb_asymmetry": "force_offset"}


def diagnose(
    recordings: Sequence[Recording],
    axis: Axis,
    *,
    seed: int = 0,
    progress: Callable[[str], None] = lambda _: None,
) -> Diagnosis:
    """Say whether the baseline model leaves physics out, which, how big, and what else it could be.

    Args:
        recordings: one or more of one machine; notes `commissioning` and `today` mark a before/after pair, otherwise
            they are repeats with other excitation, the last of which is held out.
        axis: what the commissioning engineer knows.
        seed: of the search.
        progress: told what is being tried.

    Raises:
        InputError: no recording.
    """
    if not recordings:
        raise InputError("no recording to diagnose: give one, or list [[recording]] in the axis file")
    for recording in recordings:
        reason = unusable(recording, axis) or too_broken(prepare(recording, axis))
        if reason is not None:
            return _insufficient(recordings, axis, seed, f"{recording.source or 'recording'}: {reason}")
    doubtful = all(
        recording.loop == "closed" and recording.hold in (TorqueHold.HOLD, TorqueHold.UNKNOWN)
        for recording in recordings
    )
    progress("baseline")
    evidence, baseline = read_torque(gather(recordings, axis), axis, doubtful, seed)
    reason = _too_little(baseline, evidence.train)
    if reason is not None:
        return _insufficient(recordings, axis, seed, reason)
    setting = setting_of(baseline.problem, baseline.x)
    ways = guises({name: find(name) for name in names()}, setting)
    selection = select(baseline, ways, progress)
    report = _Report(axis, seed, recordings, evidence, setting, selection, progress)
    return report.written(ways)


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


def _too_little(baseline: Fit, samples: Samples) -> str | None:
    """Why the motion cannot carry a diagnosis, or None."""
    velocity = np.abs(smooth_velocity(samples))
    moving = int(np.count_nonzero(velocity > RESTING * float(velocity.max())))
    travel = float(np.ptp(samples.position))
    noise = noise_level(samples.position)
    unit = baseline.problem.axis.position_unit
    if travel < NOISE_TRAVEL * noise:
        return f"the axis moved {travel:.2g} {unit}, {travel / noise:.0f} times the noise of its position"
    if moving < FEWEST_MOVING:
        return f"only {moving} samples show motion"
    usual, fastest = median_speed(samples)
    scales = baseline.problem.scales
    curve = FrictionCurve(baseline.x[:4], scales.force, scales.speed, fastest, spread_of(baseline).part(4))
    force, half = curve.at([usual])
    if not half[0] <= CURVE_KNOWN * abs(force[0]):
        return f"friction at the usual speed of {usual:.2g} {unit}/s is {force[0]:.2g} ± {half[0]:.1g}: not known"
    return None


@dataclasses.dataclass(frozen=True, slots=True)
class _Report:
    """Everything a finished selection is written up from."""

    axis: Axis
    seed: int
    recordings: Sequence[Recording]
    evidence: Evidence
    setting: Setting
    selection: Selection
    progress: Callable[[str], None]

    @property
    def level(self) -> float:
        """F_c of the baseline, or the force scale where it vanishes. [N]."""
        problem = self.selection.baseline.problem
        return max(float(problem.law(self.selection.baseline.x[None])[0, 0]), 0.1 * problem.scales.force)

    def written(self, ways: list[Guise]) -> Diagnosis:
        """Judge the selection on held-out data and say what it means."""
        selection, evidence = self.selection, self.evidence
        chosen, baseline = selection.chosen, selection.baseline
        before, after = baseline.latent_force, chosen.latent_force
        held = self._held_out(baseline), self._held_out(chosen)
        spread = spread_of(chosen)
        effects = self._effects(spread)
        offset = self._offset(chosen, spread)
        payload, apart = (None, 0.0) if offset is None else self._payload(chosen, ways)
        if offset is not None and payload is not None and apart > 0.0:
            chosen = payload
            offset = self._as_payload(payload, offset)
            held = held[0], self._held_out(chosen)
        location: Location | None = None
        verdict = Verdict.NO_MISMATCH
        stands = not effects or (
            free_run_ratio(baseline, chosen, evidence.held_out) < HELD_OUT
            and not (after > REST * self.level and after > KEPT * before)
        )
        if effects and stands:
            verdict = Verdict.EXPLAINED
            first = max(effects, key=lambda effect: effect.share)
            step = next(step for step in selection.steps if step.guise.name == first.name)
            location = named_location(
                first.name, first.parameters, first.share, step.evidence.z, evidence.train, self.axis
            )
        if offset is not None and stands:
            effects = (*effects, offset)
            verdict = Verdict.EXPLAINED
            location = location or named_location(
                offset.name, offset.parameters, offset.share, 6.0, evidence.train, self.axis
            )
        if not stands or (verdict is Verdict.NO_MISMATCH and after > CLEAN * self.level):
            location = locate(baseline if not stands else chosen, evidence.train, evidence.held_out)
            if not stands or location is not None:
                verdict, effects, chosen, held = Verdict.UNEXPLAINED, (), baseline, (held[0], held[0])
        alternatives = self._alternatives(effects)
        if payload is not None and abs(apart) < TIED_BIC and effects:
            alternatives = _with_twin(alternatives, "force_offset", "inertia_error")
        candidates: tuple[Experiment, ...] = ()
        if verdict is Verdict.EXPLAINED and len(alternatives) > 1:
            self.progress("next experiment")
            rivals = rivals_of(chosen, alternatives, selection.rivals, ways)
            alternatives = still_tied(rivals, alternatives)
            closed = self.recordings[-1].loop == "closed"
            candidates = propose([rival for rival in rivals if rival.names in alternatives], closed)
        best = settling(candidates)
        hidden = detectable(baseline, ways) if verdict is Verdict.NO_MISMATCH else {}
        remaining = Quantity(chosen.latent_force, self.axis.force_unit)
        if verdict is Verdict.EXPLAINED:
            explanation = words.explained(effects, alternatives, held[1] / max(held[0], 1e-300))
        elif verdict is Verdict.UNEXPLAINED:
            explanation = words.unexplained(remaining, location)
        else:
            explanation = words.nothing_missing(remaining, hidden)
        wanted = [COORDINATE.get(effect.name, "time") for effect in effects]
        if location is not None:
            wanted += [location.coordinate, *location.alternatives]
        different: tuple[Change, ...] = ()
        if evidence.before is not None:
            self.progress("changes since commissioning")
            different = changes_since(chosen, evidence.before, (evidence.train, evidence.held_out))
            explanation += words.changed(different)
        named = chosen if chosen is not baseline else None
        recorded = native(self.recordings, self.axis, evidence)
        return Diagnosis(
            verdict=verdict,
            axis=self.axis.name,
            explanation=explanation,
            effects=effects,
            alternatives=alternatives if effects else (),
            location=location,
            fit={
                "baseline": Pair(baseline.short_run(), held[0]),
                "extended": Pair(chosen.short_run(), held[1]),
            },
            force_error={
                name: force_errors(fitted.problem, fitted.x, recorded)
                for name, fitted in (("baseline", baseline), ("extended", chosen))
            },
            held_out_kind=evidence.kind,
            run_length=RUN_LENGTH,
            remaining_force=remaining,
            detectable=hidden,
            changes=different,
            next_experiment=None if best is None else in_words(best),
            experiments=candidates,
            seed=self.seed,
            data_sha256=evidence.sha256,
            preprocessing=evidence.removed,
            pictures=pictures_of(selection, named, evidence, wanted, {way.name for way in ways}),
        )

    def _held_out(self, fitted: Fit) -> float:
        """Eq. (4) over one-second free runs on data the fit has not seen. [1]."""
        problem = fitted.problem.on(self.evidence.held_out)
        x = np.concatenate([fitted.x[: problem.p], np.zeros(2 * self.evidence.held_out.runs)])
        return Fit(problem, dataclasses.replace(fitted.found, x=x)).short_run()

    def _effects(self, spread: Uncertainty) -> tuple[FoundEffect, ...]:
        """The chosen effects, the largest share first."""
        chosen = self.selection.chosen
        with_all = unexplained(chosen.problem, chosen.x, self.evidence.train)
        found = []
        for step in self.selection.steps:
            guise = next(g for g in chosen.problem.guises if g.name == step.guise.name)
            self.progress(f"share of {guise.name}")
            rest = without(chosen, guise) if len(self.selection.steps) > 1 else self.selection.baseline
            lacking = unexplained(rest.problem, rest.x, self.evidence.train)
            share = 0.0
            if with_all is not None and lacking is not None:
                share = 1.0 - float(np.sum(with_all.lacking**2) / max(float(np.sum(lacking.lacking**2)), 1e-300))
            found.append(
                FoundEffect(
                    guise.name, float(np.clip(share, 0.0, 1.0)), quantities(chosen, guise, spread), step.force_rms
                )
            )
        return tuple(sorted(found, key=lambda effect: -effect.share))

    def _offset(self, fitted: Fit, spread: Uncertainty) -> FoundEffect | None:
        """The constant force as an effect, where mass and gravity are known and it is beyond what they allow."""
        problem = fitted.problem
        if not problem.gravity_known or any(guise.name == "force_offset" for guise in problem.guises):
            return None
        scale = problem.scales.force
        value = float(fitted.x[4] * scale)
        unit = np.zeros((1, len(fitted.x)))
        unit[0, 4] = scale
        half = float(spread.half_widths(unit)[0])
        allowed = OFFSET_PRIOR * (self.axis.drive.rated_force or scale)
        if abs(value) - half < allowed or half > OFFSET_KNOWN * abs(value):
            return None
        quantity = Quantity(value, self.axis.force_unit, (value - half, value + half))
        lacking = unexplained(problem, fitted.x, self.evidence.train)
        rest = 0.0 if lacking is None else float(np.mean(lacking.lacking**2))
        return FoundEffect("force_offset", value**2 / (value**2 + rest), {"force": quantity}, abs(value))

    def _payload(self, fitted: Fit, ways: list[Guise]) -> tuple[Fit | None, float]:
        """The constant force read as the weight of a payload, and by how much that is likelier (BIC). [1]."""
        guise = next((g for g in ways if g.name == "inertia_error" and ("weight_share", 1.0) in g.fixed), None)
        if guise is None or any(g.name == guise.name for g in fitted.problem.guises):
            return None, 0.0
        mass = fitted.x[4] * fitted.problem.scales.force / self.axis.mechanics.g
        problem, x = extend(fitted, guise, np.array([[guise.unknowns[0].scaled(float(mass))]]))
        x[:, 4] = 0.0
        found = fit(problem, x)
        return found, fitted.found.criterion - found.found.criterion - float(np.log(problem.samples.used))

    def _as_payload(self, payload: Fit, offset: FoundEffect) -> FoundEffect:
        """The effect inertia_error in place of a constant force."""
        guise = next(g for g in payload.problem.guises if g.name == "inertia_error")
        values = quantities(payload, guise, spread_of(payload))
        return FoundEffect("inertia_error", offset.share, values, offset.force_rms)

    def _alternatives(self, effects: tuple[FoundEffect, ...]) -> tuple[tuple[str, ...], ...]:
        """The chosen set, then every set these data cannot tell from it."""
        chosen = tuple(effect.name for effect in effects)
        sets = [chosen]
        for step, rivals in zip(self.selection.steps, self.selection.rivals, strict=False):
            for rival in _strong(tied(step, rivals)):
                swapped = tuple(rival.guise.name if name == step.guise.name else name for name in chosen)
                if len(set(swapped)) == len(swapped) and set(swapped) not in [set(s) for s in sets]:
                    sets.append(swapped)
        for name, twin in EXACT.items():
            if name in chosen and twin not in chosen and (name == "force_offset" or self.setting.free_offset):
                sets.append(tuple(twin if n == name else n for n in chosen))
        return tuple(sets)


def _with_twin(sets: tuple[tuple[str, ...], ...], one: str, other: str) -> tuple[tuple[str, ...], ...]:
    """`sets`, and the first of them with `one` and `other` exchanged."""
    swap = {one: other, other: one}
    twin = tuple(swap.get(name, name) for name in sets[0])
    return sets if set(twin) in [set(names) for names in sets] else (*sets, twin)


def _strong(rivals: list[Step]) -> list[Step]:
    """Rivals that would earn a name themselves."""
    return [rival for rival in rivals if rival.refused is None]
