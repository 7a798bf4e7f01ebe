"""One more effect on top of a fit: which are worth a full fit, where each starts, and what each is worth."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from identify.mismatch.compare import Comparison, Fit, compare, fit
from identify.mismatch.curve import CURVE
from identify.mismatch.extended import ExtendedProblem
from identify.mismatch.guise import Guise, Way
from identify.mismatch.inverse import effect_force
from identify.mismatch.progress import Doing, Stage, Tell, unheard
from identify.mismatch.rugged import climbed, moved, scattered
from identify.mismatch.rules import (
    BIC,
    BIC_STRONG,
    BREAK_AWAY,
    KNOWN,
    MUCH,
    NO_NAME,
    Step,
    all_told,
    bent_to_edge,
    everywhere,
    overwhelming,
    price,
    proven,
    refusal,
)
from identify.mismatch.score import extend, leads_at
from identify.mismatch.wandering import OTHERS, wanders
from identify.observer import gain_table
from identify.polish import polish_all
from identify.preprocess import Samples
from identify.search import CLASSICAL, SCOUTED, losses_by_gain
from identify.threads import allowed, side_by_side

Floats = NDArray[np.float64]

NOTHING: Mapping[Way, Fit] = MappingProxyType({})
FAINT = 0.03  # of the best lead's expected gain: fainter ones cannot win
REFITS = 5  # names per observer gain that get a full fit, however many ways each may be present in
STRANGE = 3  # kinds of physics that are in no catalogue per observer gain that get a full fit
NOTABLE, SHARE = 40.0, 0.1  # their expected gain, and its share of the best lead's: less beats no name and is not told
WORTH = 12.0  # expected gain below which a lead is not refitted
PROMISING = 15.0  # fall of the loss after a first look below which a candidate is left alone
TESTED = 0.4  # of the likeliest step's evidence: what has as much is put to the test by its own curve
SLIGHTLY = 0.06  # of its evidence: another curve that explains more by less may be how friction falls with speed
FIRST = 4  # of them, the most promising: these need not show more than strong evidence
LITTLE = 0.15  # of the evidence of an effect that has earned its name: what shows less at first is not fitted in full
CLIMBED = 0.3  # of it: what has less when fitted does not get its many peaks climbed
ROUGH = 0.3  # of log-likelihood units: what an iteration of the first look must gain
# always refitted: eq. (1) imitates a drag, rests are few, a share of viscous friction that the fit has lost is nothing
NO_SLOPE = {"quadratic_drag", "dwell_time_stiction", "viscous_asymmetry", "thermal_drift"}
# always looked at beside a likelier relative: from where neither is near, these have no slope
RELATIVES = {
    "presliding_hysteresis": {"cable_hysteresis", "frictional_lag", "creeping_spring"},
    "rested_grease": {"dwell_time_stiction"},
}
# looked at in each of its ways: the constant force hides if a mass has its weight, static friction how a rise falls
WAYS = {"inertia_error", "dwell_time_stiction"}
LOOK = 8  # iterations of each polish of a first look
HOPEFUL = 3  # points of a first look that are polished at their likeliest gain too
SHARES = (1.0, 0.5, 0.2, 0.05)  # of an amplitude that a start tries


@dataclass(slots=True)
class Candidate:
    """An effect worth a full fit: where to start (k rows, scaled), and the observer gain each start was seen at.

    And a fit of another model with the effect, where there was one: its baseline may be nearer to the truth, too.
    """

    guise: Guise
    starts: list[Floats]
    gains: list[Floats]
    known: Fit | None = None


def explore(
    current: Fit,
    guises: list[Guise],
    unseen: Samples,
    progress: Tell = unheard,
    most: int = REFITS,
    stage: Stage = Stage.SEARCH,
    needed: float = 0.0,
    known: Mapping[Way, Fit] = NOTHING,
) -> tuple[Fit, list[Step]]:
    """Refit the most promising of `guises` on top of `current`, judged; best information criterion first.

    What shows less than half the evidence `needed` at a first look, or hardly any beside the best, is not fitted, but
    for the first few: unseen data may tell more of them. Those that are `known` from other models begin there, too.

    Returns:
        `current`, or a better fit of the same model that showed up on the way, and the steps beyond it.
    """
    candidates = shortlist(current, guises, most, known)
    seen = side_by_side(functools.partial(_look, current), candidates)
    looks = []
    for number, candidate in enumerate(candidates):
        progress(Doing(stage, candidate.guise.name, number, 2 * len(candidates)))
        looks.append(next(seen))
    looks.sort(key=lambda look: -look.gained)
    fitted = _fitted(current, looks, max(PROMISING, 0.5 * needed), unseen)
    steps = []
    for number, look in enumerate(looks):
        progress(Doing(stage, look.guise.name, len(looks) + number, 2 * len(looks)))
        steps.append(next(fitted))
    steps.sort(key=lambda step: price(step.fit))
    steps = _in_whole_turns(current, steps, unseen)
    steps = sorted(_with_own_curves(current, steps, unseen), key=lambda step: price(step.fit))
    steps = [_alike(step, steps[:number]) for number, step in enumerate(steps)]
    likely = [step for step in steps if step.evidence.bic < BIC]
    fresh = next((step for step in steps if step.refused is None), None)
    if not likely:
        return current, steps
    poorer = _return(
        current, [step.fit for step in {id(step): step for step in (likely[0], fresh or likely[0])}.values()]
    )
    return poorer, steps if poorer is current else [_judged(poorer, step, unseen) for step in steps]


def _alike(step: Step, likelier: list[Step]) -> Step:
    """The step, refused where a likelier way of the same effect is no event of its own."""
    reasons = [other.refused or "" for other in likelier if other.guise.name == step.guise.name]
    wandering = next((reason for reason in reasons if reason.startswith(OTHERS)), None)
    return step if wandering is None else replace(step, refused=step.refused or wandering)


def _fitted(current: Fit, looks: list[Look], least: float, unseen: Samples) -> Iterator[Step]:
    """The steps of `looks`, most promising first: those that gained `least` and not too little beside the best, fitted.

    So is what has no slope where it is absent and whose short polish ended far below that: it has not arrived. And the
    first few where they are strong, however much is needed.
    As many at once as there are threads: what turns out not to be worth it beside one of the same wave is dropped.
    """
    best, width = 0.0, allowed()
    first = set(looks[:FIRST])

    def worth_it(look: Look) -> bool:
        under_way = look.guise.name in NO_SLOPE and look.gained < -PROMISING
        enough = min(least, -BIC_STRONG) if look in first else least
        return under_way or look.gained >= max(enough, -LITTLE * best)

    for begin in range(0, len(looks), width):
        wave = looks[begin : begin + width]
        hopeful = list(filter(worth_it, wave))
        fits = side_by_side(_full, hopeful)
        richer = dict(zip(hopeful, fits, strict=True))
        for look in wave:
            if not worth_it(look):
                yield look.unfitted(current)
                continue
            found = richer[look]
            if look.guise.rugged and current.found.criterion - found.found.criterion > -CLIMBED * best:
                found = climbed(found, look.guise)
            step = weighed(current, found, look.guise, unseen)
            best = min(best, step.evidence.bic) if step.refused is None else best
            yield step


def _full(look: Look) -> Fit:
    """A full fit from where a first look ended."""
    return moved(fit(look.problem, look.x[None]), look.guise)


def shortlist(
    current: Fit, guises: list[Guise], most: int = REFITS, known: Mapping[Way, Fit] = NOTHING
) -> list[Candidate]:
    """Effects worth a full fit, seen at the likeliest gain of each correlation time and at a much weaker one."""
    found: dict[Way, Candidate] = {}
    outlooks = _outlooks(current)
    for gain, seen in zip(outlooks, leads_at(current, guises, np.stack(outlooks, axis=1)), strict=True):
        ranked = [lead for lead in seen if lead.gain > WORTH]
        notable = max(NOTABLE, SHARE * ranked[0].gain) if ranked else 0.0
        strange = [lead.guise.name for lead in ranked if lead.guise.depends is not None and lead.gain > notable]
        names = list(dict.fromkeys(lead.guise.name for lead in ranked if lead.guise.depends is None))[:most]
        names += [name for name in dict.fromkeys(strange) if name != CURVE][:STRANGE]
        names += [CURVE] if CURVE in strange else []
        for lead in [lead for lead in ranked if lead.guise.name in names]:
            if lead.gain < FAINT * ranked[0].gain:
                break
            for guise in _ways(lead.guise, guises):
                candidate = found.setdefault(guise.way, Candidate(guise, [], []))
                candidate.starts.append(lead.start)
                candidate.gains.append(gain)  # where two outlooks see the same start, it leads to different ends
    there = {name for name, _ in found}
    for guise in guises:
        if (guise.name in NO_SLOPE or RELATIVES.get(guise.name, set()) & there) and guise.name not in there:
            starts = list(guise.scaled_starts())
            found[guise.way] = Candidate(guise, starts, [current.found.gain] * len(starts))
    for way, candidate in found.items():
        candidate.known = known.get(way)
    return list(found.values())


def _ways(guise: Guise, guises: list[Guise]) -> list[Guise]:
    """The guise, and another way of the same effect that may start where it does."""
    if guise.name not in WAYS:
        return [guise]
    return [other for other in guises if other.name == guise.name]


def _outlooks(current: Fit) -> list[Floats]:
    """Observer gains to look for effects at: the present one, those likeliest at other taus, a much weaker one."""
    gains, settings = gain_table(current.problem.samples.sample_time)
    tau, rho = current.found.setting
    losses = losses_by_gain(current.problem, current.x[None], gains)[0]
    chosen = [current.found.gain]
    for other in np.unique(settings[0, 1:]):
        if other != tau:
            same = np.flatnonzero(settings[0] == other)
            chosen.append(gains[:, same[np.argmin(losses[same])]])
    weaker = np.flatnonzero((settings[0] == tau) & (settings[1] <= rho / 30.0))
    return [*chosen, gains[:, weaker[-1]] if len(weaker) else gains[:, 0]]


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """Where short polishes of a candidate ended.

    Attributes:
        problem: the model with the effect.
        guise: the effect.
        x: its unknowns. (size,)
        gained: fall of the loss. [1]
    """

    problem: ExtendedProblem
    guise: Guise
    x: Floats
    gained: float

    def unfitted(self, current: Fit) -> Step:
        """The step that no full fit is worth."""
        bic = (self.problem.p - current.problem.p) * float(np.log(self.problem.samples.used)) - self.gained
        reason = f"evidence {-bic:.0f} is below {-BIC:.0f}"
        if bic < BIC:
            reason = f"evidence {-bic:.0f} at a first look, a small share of what another effect has"
        return Step(current, self.guise, Comparison(bic, 0.0, bic, 1.0, 1.0), 0.0, reason)


def _look(current: Fit, candidate: Candidate) -> Look:
    """Try `candidate` on top of `current` from the distorted baseline and from a textbook one."""
    guise = candidate.guise
    problem, x = extend(current, guise, np.array(candidate.starts))
    seen = np.array(candidate.gains).T
    _shrink(problem, x, guise, seen)
    classical = x.copy()
    classical[:, :4] = CLASSICAL
    others = [x, classical]
    if guise.name in BREAK_AWAY:
        others.append(_handed_over(problem, guise, x))
    if guise.rugged:
        others += [scattered(problem, guise, points, seen) for points in (x, classical)]
    x, seen = np.concatenate(others), np.concatenate([seen] * len(others), axis=1)
    if candidate.known is not None:
        x = np.vstack([x, _carried(candidate.known, problem, current)])
        seen = np.column_stack([seen, candidate.known.found.gain])
    return Look(problem, guise, *_first_look(current, problem, guise, x, seen))


def _handed_over(problem: ExtendedProblem, guise: Guise, x: Floats) -> Floats:
    """The points x (k, size) where the effect raises the static friction by what the baseline's had risen instead."""
    amplitude = guise.amplitude()
    if amplitude is None:
        return x
    other, unknown = x.copy(), guise.unknowns[amplitude]
    static = np.maximum(x[:, 1] - x[:, 0], 0.0) * problem.scales.force
    other[:, problem.slot(guise).start + amplitude] = [unknown.scaled(min(rise, unknown.high)) for rise in static]
    other[:, 1:3] = np.stack([x[:, 0], np.full(len(x), CLASSICAL[2])], axis=1)
    return other


def _in_whole_turns(current: Fit, steps: list[Step], unseen: Samples) -> list[Step]:
    """The steps, best first, with periods that go into a turn a whole number of times, where that explains as much.

    What else is missing bends a period that the axis travels few times. Only what would be likeliest is worth it.
    """
    found: list[Step] = []
    for number, step in enumerate(steps):
        if step.refused is None or step.evidence.bic > TESTED * steps[0].evidence.bic:
            return [*found, *steps[number:]]
        found.append(_in_whole_turn(current, step, unseen))
    return found


def _in_whole_turn(current: Fit, step: Step, unseen: Samples) -> Step:
    """The refused step with the nearest whole number of periods in a turn, or as it is."""
    guise = step.guise
    if guise.turn is None or guise not in step.fit.problem.guises or step.evidence.bic > BIC:
        return step
    x = step.fit.x[step.fit.problem.slot(guise)]
    if guise.oddity(x) is None:
        return step
    times = guise.turn / guise.value(x, "period")
    whole = [_bound(current, step, n, unseen) for n in sorted({max(1, math.floor(times)), math.ceil(times)})]
    whole = [one for one in whole if one.evidence.bic < (1.0 - KNOWN) * step.evidence.bic and one.refused is None]
    return min(whole, key=lambda one: one.evidence.unseen, default=step)


def _bound(current: Fit, step: Step, times: int, unseen: Samples) -> Step:
    """The step refitted with `times` periods in a turn."""
    guise = step.guise.bound_to(times)
    problem = current.problem.including((*current.problem.guises, guise))
    x = step.fit.x.copy()
    x[problem.slot(guise).start] = 0.0
    return weighed(current, fit(problem, x[None], rounds=0), guise, unseen)


def _with_own_curves(current: Fit, steps: list[Step], unseen: Samples) -> list[Step]:
    """The steps; where one is near the likeliest and its own curve, freed, explains clearly more, so bent.

    What takes its name away must explain more than friction's own curve may be known imperfectly.
    """
    most = min((step.evidence.bic for step in steps), default=0.0)
    found = []
    for step in steps:
        freed = step.guise.freed
        if freed is not None and step.evidence.bic < min(BIC, TESTED * most) and step.guise in step.fit.problem.guises:
            problem = current.problem.including((*current.problem.guises, freed))
            bent = weighed(current, fit(problem, _begun(_carried(step.fit, problem), problem, freed)), freed, unseen)
            gained = step.evidence.bic - bent.evidence.bic
            told = gained > max(-BIC, -SLIGHTLY * bent.evidence.bic if bent.denied else 0.0) and _truer(bent, step)
            known = bool(bent.denied) or not bent_to_edge(bent.fit, freed)
            found.append(bent if told and known else step)
        else:
            found.append(step)
    return found


def _truer(bent: Step, step: Step) -> bool:
    """Whether unseen data prefer a curve that is bent: sample by sample, or over a second where it keeps its name."""
    truer = bent.evidence.foreseen > step.evidence.foreseen
    return truer or (not bent.denied and bent.evidence.unseen < step.evidence.unseen)


def _carried(fitted: Fit, problem: ExtendedProblem, others: Fit | None = None) -> Floats:
    """Unknowns of `problem` where `fitted` has them, parameter by parameter; zero where it has none. (size,)

    Effects that `fitted` does not hold are as those `others` have them.
    """
    x = np.zeros(problem.size)
    x[: problem.base] = fitted.x[: problem.base]
    x[problem.p :] = fitted.x[fitted.problem.p :]
    for guise in problem.guises:
        source = fitted if others is None or guise.name in fitted.names else others
        known = source.problem.guise(guise.name)
        own = dict(zip((u.parameter for u in known.unknowns), source.x[source.problem.slot(known)], strict=True))
        x[problem.slot(guise)] = [own.get(unknown.parameter, 0.0) for unknown in guise.unknowns]
    return x


def _begun(x: Floats, problem: ExtendedProblem, freed: Guise) -> Floats:
    """Points x (size,) with the first shape of a freed curve where it may begin. (k, size)"""
    points = np.repeat(x[None], len(freed.bends), axis=0)
    shape = next(index for index, unknown in enumerate(freed.unknowns) if unknown.parameter in freed.shapes)
    points[:, problem.slot(freed).start + shape] = freed.bends
    return points


def weighed(current: Fit, richer: Fit, guise: Guise, unseen: Samples) -> Step:
    """What the richer model's `guise` is worth on top of `current`."""
    force, acting = effect_force(richer.problem, richer.x, guise)
    evidence = compare(current, richer, unseen)
    return Step(richer, guise, evidence, force, reason_against(richer, guise, evidence, acting), acting)


def reason_against(fitted: Fit, guise: Guise, evidence: Comparison, acting: float) -> str | None:
    """Why the effect does not earn its name, or is no event of its own; or None."""
    refused = refusal(fitted, guise, evidence, acting)
    if refused not in (None, NO_NAME):
        return refused
    told, solved = all_told(evidence), proven(evidence) or everywhere(evidence)
    sure = overwhelming(evidence) and evidence.unseen < MUCH
    return wanders(fitted, guise, told, acting, proven=solved, sure=sure, parting=evidence.parting) or refused


def _shrink(problem: ExtendedProblem, x: Floats, guise: Guise, seen: Floats) -> None:
    """Take the amplitudes of the starts x (k, size) back to where they are likeliest: a response is only so linear."""
    index = guise.amplitude()
    if guise.wave is None and index is None:
        return
    slot = problem.slot(guise)
    where = (
        slice(slot.stop - 2, slot.stop)
        if index is None or guise.wave is not None
        else slice(slot.start + index, slot.start + index + 1)
    )
    for k in range(len(x)):
        trials = np.repeat(x[[k]], len(SHARES), axis=0)
        trials[:, where] *= np.array(SHARES)[:, None]
        with np.errstate(all="ignore"):
            x[k] = trials[int(np.argmin(problem.losses(trials, seen[:, k])))]


def _judged(poorer: Fit, step: Step, unseen: Samples) -> Step:
    """The step judged anew against a better fit of the poorer model."""
    if step.fit.problem.p <= poorer.problem.p:
        return step
    evidence = compare(poorer, step.fit, unseen)
    return replace(step, evidence=evidence, refused=reason_against(step.fit, step.guise, evidence, step.acting))


def _first_look(
    current: Fit, problem: ExtendedProblem, guise: Guise, points: Floats, seen: Floats
) -> tuple[Floats, float]:
    """Short polishes at the gains `seen` (5, k) and at the likeliest one: where they end, and how much likelier.

    Where the effect is stays as it was seen at first: far from the optimum, its slope leads anywhere.
    """
    scouted = gain_table(problem.samples.sample_time)[0][:, ::SCOUTED]
    gains = np.column_stack([scouted, current.found.gain])  # of clean data, the next gain is 10000 less likely
    place = guise.place()
    pinned = None if place is None else problem.slot(guise).start + place
    first = polish_all(problem, points, seen, LOOK, ROUGH, pinned=pinned)
    by_gain = losses_by_gain(problem, first.x, gains)
    best = by_gain.min(axis=1).argsort()[:HOPEFUL]
    ends = polish_all(problem, first.x[best], gains[:, by_gain[best].argmin(axis=1)], LOOK, ROUGH)
    return ends.x[ends.best], current.found.criterion - float(ends.loss[ends.best])


def _return(current: Fit, richer: list[Fit]) -> Fit:
    """The poorer model once more from the richer ones' optima: what only polished the baseline is no evidence."""
    problem = current.problem
    again = fit(problem, np.stack([_carried(other, problem) for other in richer]))
    return again if again.found.criterion < current.found.criterion else current
