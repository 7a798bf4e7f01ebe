"""A conclusion as the contract has it: every entry of the diagnosis."""

from __future__ import annotations

import numpy as np

from identify.criterion import RUN_LENGTH
from identify.mismatch import words
from identify.mismatch.alternatives import alternatives_of
from identify.mismatch.changes import changes_since
from identify.mismatch.compare import Fit
from identify.mismatch.conclusion import Conclusion
from identify.mismatch.constant import OFFSET_KNOWN
from identify.mismatch.curve import CURVE
from identify.mismatch.detect import detectable
from identify.mismatch.effect_sizes import taken_into_account
from identify.mismatch.experiment import Experiment, in_words, propose, settling
from identify.mismatch.force_error import force_errors, native
from identify.mismatch.locate import COORDINATE, named_location
from identify.mismatch.nameless import Structure
from identify.mismatch.pictures import pictures_of
from identify.mismatch.progress import Doing, Stage
from identify.mismatch.result import Change, Diagnosis, FoundEffect, Location, Pair, Quantity, Verdict
from identify.mismatch.rivals import rivals_of, still_tied
from identify.mismatch.rules import BRISTLES, SAME, constant_of

SLIGHT = {
    "dead_time": "position is stamped later than torque by less than a quarter of a sample: taken into account",
    "actuator_lag": "the drive lags its command by less than a quarter of a sample: taken into account",
}
EXPONENT = "friction falls with exp(-(v/v_s)^{:.2g}) rather than as in eq. (1): taken into account"
MICROMETRES = "contacts bend by less than can be measured here before they slide: taken into account"
BENT = "{} has not quite the catalogue's curve, which was left free to bend: taken into account"
POOLED = "{}: its sizes are the means of what fitted and unseen data tell; the fitted ones alone might do without it"
RIVAL = 0.8  # of the best evidence: coordinates this close are named too
SURELY = 6.0  # standard errors of a constant force, which no step found
NOTABLE = 0.03  # of the dry friction: a constant force that is told


def written(found: Conclusion) -> Diagnosis:
    """The answer."""
    chosen: Fit = found.plain
    effects: tuple[FoundEffect, ...] = ()
    if found.verdict is Verdict.EXPLAINED:
        chosen, effects = found.selection.chosen, found.named if found.selection.steps else ()
        if found.constant is not None and found.offset_named:
            chosen, effects = found.constant.fit, (*effects, found.constant.effect)
    baseline, evidence = found.plain, found.evidence
    held = found.held_out(baseline)
    shown = _shown(found, chosen)
    held_chosen = found.held_out(shown)
    alternatives, candidates = _alternatives(found, chosen, effects)
    best = settling(candidates)
    nameless = [] if effects else found.nameless
    location = _place(found, effects) if effects else _nameless(found, nameless, chosen)
    hidden = detectable(found.everyday, found.ways) if found.verdict is Verdict.NO_MISMATCH else {}
    left = found.everyday if chosen is baseline else chosen
    remaining = Quantity(left.latent_force, found.axis.force_unit)
    if found.verdict is Verdict.EXPLAINED:
        explanation = words.explained(effects, alternatives, held_chosen / max(held, 1e-300))
    elif found.verdict is Verdict.UNEXPLAINED:
        explanation = words.unexplained(remaining, location, nameless[0].like if nameless else "")
    else:
        explanation = words.nothing_missing(remaining, hidden)
    explanation += _free_constant(shown, effects)
    wanted = [COORDINATE.get(effect.name, "time") for effect in effects]
    if location is not None:
        wanted += [location.coordinate, *location.alternatives]
    different: tuple[Change, ...] = ()
    if evidence.before is not None:
        found.progress(Doing(Stage.CONCLUSION, "changes since commissioning"))
        different = changes_since(chosen, evidence.before, (evidence.train, evidence.held_out))
        explanation += words.changed(different)
    recorded = native(found.recordings, found.axis, evidence)
    return Diagnosis(
        verdict=found.verdict,
        axis=found.axis.name,
        explanation=explanation,
        effects=effects,
        alternatives=alternatives,
        location=location,
        fit={
            "baseline": Pair(baseline.short_run(), held),
            "extended": Pair(shown.short_run(), held_chosen),
        },
        force_error={
            name: force_errors(fitted.problem, fitted.x, recorded)
            for name, fitted in (("baseline", baseline), ("extended", shown))
        },
        held_out_kind=evidence.kind,
        run_length=RUN_LENGTH,
        remaining_force=remaining,
        detectable=hidden,
        changes=different,
        next_experiment=None if best is None else in_words(best),
        experiments=candidates,
        seed=found.seed,
        data_sha256=evidence.sha256,
        preprocessing=(*evidence.removed, *_aside(found, shown), *_uncertain(found, effects)),
        pictures=pictures_of(
            found.selection,
            baseline,
            chosen if chosen is not baseline else None,
            evidence,
            wanted,
            {way.name for way in found.ways},
            {effect.name for effect in effects},
        ),
    )


def _free_constant(fitted: Fit, effects: tuple[FoundEffect, ...]) -> str:
    """What is said of a constant force that the baseline may have, where no weight tells what is ordinary; or nothing.

    Several effects are no more than that while the axis slides; beside one of them, or a spring, which holds it in its
    rest position, nothing is said.
    """
    if fitted.problem.axis.mechanics.weight != 0.0 or {*SAME, "position_spring"} & {one.name for one in effects}:
        return ""
    value, half = constant_of(fitted)
    told = half < OFFSET_KNOWN * abs(value) and abs(value) > NOTABLE * fitted.dry_level
    return words.constant(value, half, fitted.dry_level, fitted.problem.axis.force_unit) if told else ""


def _shown(found: Conclusion, chosen: Fit) -> Fit:
    """The model that is reported: the `chosen` one after a last polish, or the baseline everybody would fit."""
    if chosen is found.plain:
        return chosen
    return found.final if chosen is found.selection.chosen else found.polished(chosen)


def _alternatives(
    found: Conclusion, chosen: Fit, effects: tuple[FoundEffect, ...]
) -> tuple[tuple[tuple[str, ...], ...], tuple[Experiment, ...]]:
    """The sets that a fit cannot tell from the named one either, and the motions that would."""
    sets = alternatives_of(found, effects) if effects else ()
    if len(sets) < 2:
        return sets, ()
    found.progress(Doing(Stage.CONCLUSION, "next experiment"))
    rivals = rivals_of(chosen, sets, found.selection.rivals, found.ways)
    still = still_tied(rivals, sets)
    closed = found.recordings[-1].loop == "closed"
    return still, propose([rival for rival in rivals if rival.names in still], closed)


def _place(found: Conclusion, effects: tuple[FoundEffect, ...]) -> Location:
    """Where the effect with the largest share acts."""
    first = max(effects, key=lambda effect: effect.share)
    z = next((step.evidence.z for step in found.selection.steps if step.guise.name == first.name), SURELY)
    return named_location(first.name, first.parameters, first.share, z, found.evidence.train, found.axis)


def _nameless(found: Conclusion, nameless: list[Structure], fitted: Fit) -> Location | None:
    """Where structure without a name shows."""
    if not nameless:
        return None
    best = nameless[0]
    close = [*best.also, *(s.coordinate for s in nameless[1:] if s.evidence > RIVAL * best.evidence)]
    others = tuple(dict.fromkeys(name for name in close if name != best.coordinate))
    share = 1.0 - float(np.exp(-best.evidence / len(found.evidence.train)))
    if best.force > 0.0:
        share = best.force**2 / (best.force**2 + fitted.latent_force**2)
    return Location(best.coordinate, best.interval, share, best.p_value, others)


def _aside(found: Conclusion, shown: Fit) -> tuple[str, ...]:
    """What is said of what the model takes into account though it is no effect."""
    selection = found.selection
    said = [sentence for name, sentence in SLIGHT.items() if name in selection.aside]
    if CURVE in selection.aside:
        model = shown if CURVE in shown.names else selection.chosen
        guise = model.problem.guise(CURVE)
        exponent = float(np.exp(guise.unknowns[0].value(model.x[model.problem.slot(guise)])[0]))
        said.append(EXPONENT.format(exponent))
    if BRISTLES in selection.aside:
        said.append(MICROMETRES)
    return (*said, *(BENT.format(guise.name) for guise in shown.problem.guises if guise.shapes))


def _uncertain(found: Conclusion, named: tuple[FoundEffect, ...]) -> tuple[str, ...]:
    """What is said of an effect in the model that is not among the `named` ones, and of one that all data tell."""
    if not named or not found.selection.steps:
        return ()
    known = {effect.name for effect in found.named}
    pooled = [POOLED.format(effect.name) for effect in named if effect.pooled]
    return (*(taken_into_account(effect) for effect in found.effects if effect.name not in known), *pooled)
