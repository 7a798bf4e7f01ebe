"""Which effects, and how sure: forward, swap, backward; every step decided by several judges at once."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field, replace

from identify.mismatch.bends import bend
from identify.mismatch.compare import Comparison, Fit, compare, fit, trimmed
from identify.mismatch.curve import CURVE
from identify.mismatch.explore import REFITS, explore, reason_against
from identify.mismatch.guise import Guise, Way
from identify.mismatch.inverse import Bools, acting
from identify.mismatch.locate import COORDINATE, WHERE
from identify.mismatch.progress import Stage, Tell, unheard
from identify.mismatch.rules import (
    BIC,
    BIC_STRONG,
    CLEAN,
    FORESEEN,
    HARDLY,
    LATE,
    LESSER,
    NO_NAME,
    PROVEN,
    TIED_BIC,
    Z_STRONG,
    Step,
    Z,
    agreed,
    best_of,
    cost,
    fine_bristles,
    foretold,
    nearer,
    other_curve,
    price,
    proven,
    slight_delay,
    told_elsewhere,
    told_in_most_places,
    told_more_elsewhere,
)
from identify.preprocess import Samples

Near = Callable[[Guise], Bools | None]
Bends = Callable[[str], float]
Looked = tuple[frozenset[Guise], frozenset[Guise], int]

MOST_EFFECTS = 3
CLOSE = 0.6  # of the first name's evidence: what has as much may be the first name once the others are in
MINOR = 0.5  # of the evidence so far: what has more is no matter of how the first effect's curve bends
KIN = 0.2  # of the evidence so far: a twin of what is named needs as much; less is how imperfectly that shape is known
CERTAIN, BETTER = 4.0, 0.7  # z, and share of the errors of free runs: what has little evidence but this is not the same
FEW = 0.4  # of the samples: an effect that acts in more does not act in few places
MENDS = 0.7  # of the evidence from where a named effect acts: no second one, but how imperfectly the first is known
OPENINGS = 1  # names besides the first that get their own try: each costs as much as the first
DETOURS = 2  # names that get a try where something likelier, but odd, kept them from being given
TWICE = 2.0  # times the evidence of any name: physics in no catalogue that two names together do not outdo
SAME_FIT = 1.0  # of log-likelihood: what is better by more is another fit
MOST_LOOKS = 4  # in one search, before a much better fit of the same model is no reason for another
AGAIN = 3  # names per observer gain looked at again when a chosen effect is put to the test
PLACES = {"end_stop", "rail_defect"}  # act in one place, and nowhere else: there is no shape of them elsewhere
SOFT = "transmission_compliance"
EXACT = {"inertia_error", "torque_scale_error"}  # have no shape that could be known imperfectly
FAMILIES = (
    frozenset({"force_offset", "coulomb_asymmetry", "viscous_asymmetry", "position_spring"}),
    frozenset({"rail_defect", "position_dependent_friction", "torque_ripple", "pulley_eccentricity", "end_stop"}),
    frozenset({"inertia_error", "torque_scale_error", "load_dependent_friction", "quadratic_drag"}),
    frozenset({"position_spring", "torque_ripple"}),
    frozenset({"viscous_asymmetry", "quadratic_drag"}),
    frozenset({"torque_saturation", "load_dependent_friction", "quadratic_drag"}),
    frozenset({"actuator_lag", "dead_time", "transmission_compliance"}),
    frozenset({"presliding_hysteresis", "backlash", "dwell_time_stiction"}),
    frozenset({"backlash", "actuator_lag", "dead_time"}),
    frozenset({"thermal_drift", "step_change"}),
)
TWINS = {
    name: frozenset().union(*(family for family in FAMILIES if name in family)) - {name}
    for name in frozenset().union(*FAMILIES)
}


@dataclass(slots=True)
class Selection:
    """The chosen model and what competed with it.

    Attributes:
        baseline: nothing but friction.
        chosen: the model with all effects, and perhaps what is none: a shift of the clock, another Stribeck
            exponent, bristles of micrometres.
        steps: the effects, in the order of their finding.
        rivals: what was tried at each step.
        opening: what was tried for the first effect, as it was seen then.
        others: selections that began with another name and ended as likely.
    """

    baseline: Fit
    chosen: Fit
    steps: list[Step] = field(default_factory=list)
    rivals: list[list[Step]] = field(default_factory=list)
    opening: list[Step] = field(default_factory=list)
    others: list[Selection] = field(default_factory=list)

    @classmethod
    def beginning(cls, step: Step, baseline: Fit, opening: list[Step]) -> Selection:
        """A selection of one step, which competed with those of the `opening`."""
        return cls(baseline, step.fit, [step], [opening], opening=opening)

    def explained(self, model: Fit) -> float:
        """Evidence of a model against nothing but friction. [1]"""
        return price(self.baseline) - price(model)

    @property
    def aside(self) -> set[str]:
        """What the chosen model takes into account though it is no effect."""
        return set(self.chosen.names) - {step.guise.name for step in self.steps}


@dataclass(frozen=True, slots=True)
class Search:
    """What a search has to work with.

    Attributes:
        guises: what is on offer.
        unseen: data that judge.
        progress: who is told.
        seen: what was found beyond a set of effects, and the fit of them it was found from: several ways lead there.
        known: of each way an effect may be present in, the likeliest fit with it so far, where it is strong.
    """

    guises: list[Guise]
    unseen: Samples
    progress: Tell
    seen: dict[Looked, tuple[Fit, Fit, list[Step]]] = field(default_factory=dict)
    known: dict[Way, Fit] = field(default_factory=dict)

    @property
    def names(self) -> set[str]:
        """Names of what is on offer."""
        return {guise.name for guise in self.guises}

    def explore(
        self, current: Fit, names: Collection[str], most: int = REFITS, stage: Stage = Stage.SEARCH, needed: float = 0.0
    ) -> tuple[Fit, list[Step]]:
        """As `explore`, offering effects of these `names`; once per set of effects, unless a better fit shows.

        Not what the model has already, and be it as what is no effect: a shift of the clocks beside a gap's kin.
        """
        there = {guise.name for guise in current.problem.guises}
        offered = [guise for guise in self.guises if guise.name in names and guise.name not in there]
        looked = frozenset(current.problem.guises), frozenset(offered), most
        known = self.seen.get(looked)
        if known is not None and price(current) > price(known[0]) - SAME_FIT:
            return known[1], known[2]
        found = explore(current, offered, self.unseen, self.progress, most, stage, needed, self.known)
        self.seen[looked] = (current, *found)
        self._remember(found[1])
        return found

    def _remember(self, steps: list[Step]) -> None:
        """Keep the fits of what is strong: beside other effects, it may be seen from nowhere else."""
        for step in steps:
            strong, way = step.evidence.bic < BIC_STRONG and step.guise in step.fit.problem.guises, step.guise.way
            if strong and (way not in self.known or price(step.fit) < price(self.known[way])):
                self.known[way] = step.fit


def select(baseline: Fit, guises: list[Guise], unseen: Samples, progress: Tell = unheard) -> Selection:
    """Add effects one by one while one earns its name; where more than one does, begin with other names too.

    The first name is chosen while the others are missing. Where more than one effect is there, whatever came close to
    it then gets its own try with what is found on top of it.
    """
    search = Search(guises, unseen, progress)
    first = _forward(Selection(baseline, baseline), search)
    if not first.steps:
        return _around(first, search)
    found = [first, *(_forward(begun, search) for begun in _other_openings(first))]
    best = min(found, key=lambda one: cost(one.chosen))
    best.others = [one for one in found if one is not best and cost(one.chosen) < cost(best.chosen) + TIED_BIC]
    return best


def _other_openings(first: Selection) -> list[Selection]:
    """Selections that begin with what came close to the first name, where there is more than one effect."""
    chosen = first.chosen
    if not first.steps or (len(first.steps) < 2 and chosen.latent_force < CLEAN * chosen.dry_level):
        return []
    begun: list[Selection] = []
    known = {step.guise.name for step in first.steps}
    least = min((step.evidence.bic for step in first.opening if step.refused is None), default=0.0)
    for step in first.opening:
        if step.refused is None and step.guise.name not in known and step.evidence.bic < CLOSE * least:
            known.add(step.guise.name)
            begun.append(Selection.beginning(step, first.baseline, first.opening))
    return begun[:OPENINGS]


def _around(first: Selection, search: Search) -> Selection:
    """Two names that together are likelier than what kept every single one from being given; or `first`.

    Or one that was found beside another, which it then made unnecessary: it was not seen by itself. Or one beside what
    is no effect: how friction falls with speed.

    What is refused for being odd may be two effects that the search took for one; what is refused for what it predicts
    may predict well beside another. Physics that is in no catalogue, and predicts unseen data so well that nothing else
    is needed, or is so much likelier than any name, is the answer, unless a name predicts as well and is likelier.
    """
    rivals = [step.evidence for step in first.opening if step.refused is None and proven(step.evidence)]
    ours = min((told.bic for told in rivals), default=0.0)
    strangers = [s.evidence for s in first.opening if s.refused == NO_NAME and s.evidence.bic < ours]
    most = min((step.evidence.bic for step in first.opening if step.guise.depends is None), default=0.0)
    if any(proven(told) or (foretold(told) and told.bic < TWICE * most) for told in strangers):
        return first
    likeliest = min((cost(step.fit) for step in first.opening), default=0.0)
    fair: dict[str, Step] = {}
    for step in sorted((step for step in first.opening if _hopeful(step)), key=lambda step: cost(step.fit)):
        fair.setdefault(step.guise.name, step)
    named = [step for step in fair.values() if step.refused is None][:1]
    for step in [*named, *(step for step in fair.values() if step not in named)][:DETOURS]:
        begun = Selection.beginning(step, first.baseline, first.opening)
        found = _forward(begun, search, cost(step.fit) - likeliest + TIED_BIC)
        if not found.steps:  # beside what is no effect, nothing is left of it
            continue
        kept = found.steps[0]
        other = len(found.steps) > 1 or kept.guise.name != step.guise.name or bool(found.aside)
        if not other or cost(found.chosen) > likeliest - TIED_BIC or _odder_beside(found, search):
            continue
        if reason_against(found.chosen, kept.guise, kept.evidence, kept.acting) is None:
            return found
    return first


def _odder_beside(found: Selection, search: Search) -> bool:
    """Whether physics in no catalogue keeps a single name from being given beside what is no effect, too."""
    strangers = {step.guise.name for step in found.opening if step.refused == NO_NAME and step.guise.name != CURVE}
    if len(found.steps) > 1 or not found.aside or not strangers:
        return False
    name = found.steps[0].guise
    rest = without(found.chosen, name)
    _, tried = search.explore(rest, strangers | {name.name}, AGAIN, Stage.TEST)
    return best_of(tried) is None


def _hopeful(step: Step) -> bool:
    """Whether a step has a name, or might have one beside another: unseen data, sample by sample, speak for it."""
    if step.guise.depends is not None:
        return False
    return step.refused is None or (not step.misplaced and agreed(step.evidence) and step.evidence.foreseen > FORESEEN)


def _forward(selection: Selection, search: Search, least: float = 0.0) -> Selection:
    """Add effects one by one while one earns its name, then try to swap and to drop each.

    What a second one needs may be known to be at `least` so much evidence.
    """
    looks = early = 0
    while len(selection.steps) < MOST_EFFECTS:
        before, looks = selection.chosen, looks + 1
        taken = {guise.name for guise in before.problem.guises}
        needed = LESSER * _of_shapes(selection.steps, selection.explained(before))
        if len(selection.steps) == 1:
            needed = max(needed, least)
        current, steps = search.explore(before, search.names, needed=needed)
        _improve(selection, current)
        delay = None if taken & LATE.keys() else slight_delay(steps)  # beside one, none is told
        aside = delay or other_curve(steps) or fine_bristles(steps)
        if aside is not None:
            selection.chosen, early = aside.fit, len(selection.steps)
            continue
        so_far = _of_shapes(selection.steps, selection.explained(current))
        near = functools.cache(functools.partial(acting, current.problem, current.x))
        bends = functools.cache(functools.partial(bend, current))
        steps = [_of_its_own(step, current, near, bends, taken, so_far) for step in steps]
        best = best_of(steps)
        if best is None and looks <= MOST_LOOKS and price(before) - price(current) > TIED_BIC:
            continue  # what is left looks different from a fit so much better
        selection.rivals.append(steps)
        selection.opening = selection.opening or steps
        enough = LESSER * _of_shapes(selection.steps, selection.explained(current), _local(current))
        if best is None or (selection.steps and not _enough(best.evidence, enough)):
            break
        early = len(selection.steps)
        selection.steps.append(best)
        selection.chosen = best.fit
    _straighten(selection)
    _reconsider(selection, search, selection.steps[:early])
    if selection.steps:
        _try_twins(selection, search)
    return selection


def _of_its_own(step: Step, before: Fit, near: Near, bends: Bends, taken: set[str], so_far: float) -> Step:
    """The step on top of `before`, refused where it only mends the shape of an effect that is `taken` already.

    What mends a shape is a twin of the effect, has its evidence where the effect acts, if that is in few places, or has
    a state of its own that nobody sees: a little spring mends anything. Nor is it needed where the effect's own curve
    would take as much if it might bend. How friction falls with speed depends on no place, and on no acceleration: what
    unseen data foretell there is another thing, however slowly the axis passes it.
    """
    if step.refused is not None or not taken:
        return step
    if _one_force(step.fit):
        return replace(step, refused="over this travel, a spring and so long a wave are one force")
    kin, little = taken & TWINS.get(step.guise.name, frozenset()) - EXACT, -step.evidence.bic < KIN * so_far
    other = (COORDINATE.get(step.guise.name) in WHERE or step.guise.name in EXACT) and foretold(step.evidence)
    shaped = [guise for guise in before.problem.guises if little and not (other and guise.name == CURVE)]
    local = [guise.name for guise in shaped if _mends(step, before, near(guise))]
    late = bool(kin & set(LATE)) or (step.guise.name in LATE and SOFT in kin)
    enough = _improves(step.evidence, late=late) if little else step.evidence.unseen <= HARDLY
    faint = not enough or not (step.evidence.z >= Z or told_elsewhere(step.evidence))
    bent = [name for name in sorted(taken) if -step.evidence.bic < MINOR * so_far and bends(name) > -step.evidence.bic]
    if not local and not (kin and faint) and not (little and step.guise.stiff) and not bent:
        return step
    whose = (local or bent)[0] if local or bent else min(kin or taken)
    return replace(step, refused=f"it may stand in for how {whose} differs from the catalogue's")


def _one_force(fitted: Fit) -> bool:
    """Whether a model holds a spring and a wave longer than the travel, whose sum may be either of them alone."""
    if "position_spring" not in fitted.names:
        return False
    problem = fitted.problem
    waves = [guise for guise in problem.guises if guise.wave is not None]
    periods = [guise.value(fitted.x[problem.slot(guise)], "period") for guise in waves]
    return any(period > problem.scales.travel for period in periods)


def _improves(evidence: Comparison, *, late: bool) -> bool:
    """Whether a step with little evidence beside its kin predicts so much better that it mends more than a shape.

    Beside a delay, or a delay beside a transmission, it must be proven: they are `late` alike.
    """
    both = math.sqrt(evidence.free_run * evidence.unseen)
    better = evidence.z > CERTAIN and both < BETTER and evidence.foreseen > FORESEEN
    return evidence.unseen <= PROVEN or ((better or told_elsewhere(evidence)) and not late)


def _mends(step: Step, before: Fit, near: Bools | None) -> bool:
    """Whether the step's evidence comes from where an effect acts, `near` (n,), if that is in few places."""
    told = step.evidence
    elsewhere = told_elsewhere(told) or nearer(told)
    if near is None or near.mean() > FEW:
        return told.z < Z and not (elsewhere or told_more_elsewhere(told))
    if told.z < Z_STRONG and not (foretold(told) and told.steady < BIC_STRONG) and not elsewhere:
        return True
    gained = step.fit.terms() - before.terms()
    return float(gained[near].sum()) > MENDS * float(gained.sum())


def _improve(selection: Selection, current: Fit) -> None:
    """Take over a better fit of the model that is chosen so far."""
    if not selection.steps:
        if current.problem is selection.baseline.problem:
            selection.baseline = current
    elif current is not selection.chosen:
        last = selection.steps[-1]
        better = last.evidence.bic + price(current) - price(selection.chosen)
        selection.steps[-1] = replace(last, fit=current, evidence=replace(last.evidence, bic=better))
    selection.chosen = current


def _straighten(selection: Selection) -> None:
    """Go back to eq. (1) where the effects that were found make another Stribeck exponent unnecessary."""
    bent = [guise for guise in selection.chosen.problem.guises if guise.name == CURVE]
    if not selection.steps or not bent:
        return
    straight = without(selection.chosen, bent[0])
    worse = price(straight) - price(selection.chosen)
    if worse < -BIC:
        last = selection.steps[-1]
        evidence = replace(last.evidence, bic=last.evidence.bic + worse)
        selection.steps[-1], selection.chosen = replace(last, fit=straight, evidence=evidence), straight


def _reconsider(selection: Selection, search: Search, early: Sequence[Step]) -> None:
    """Put each effect that was found `early` to the test once all else is in: is it still needed, and is it still it?

    Its twins compete, and whatever earned a name at any stage. A first name is chosen while the others are missing, or
    how friction falls with speed, and then shaped by what it stands in for. What has little left beside a twin, from
    few places, is not needed.
    """
    earned = {s.guise.name for stage in (selection.opening, *selection.rivals) for s in stage if s.refused is None}
    for step in early:
        rest = without(selection.chosen, step.guise)
        kin = TWINS.get(step.guise.name, frozenset())
        others = [other for other in selection.steps if other is not step]
        taken = {other.guise.name for other in others}
        rest, tried = search.explore(rest, kin | {step.guise.name} | earned, AGAIN, Stage.TEST)
        so_far = _of_shapes(others, selection.explained(rest))
        needed = max(-BIC, LESSER * _of_shapes(others, selection.explained(rest), _local(rest)))
        steps = [s for s in tried if s.refused is None and _enough(s.evidence, needed)]
        evidence = compare(rest, selection.chosen, search.unseen)
        index = selection.steps.index(step)
        mends = bool(kin & taken) and -evidence.bic < KIN * so_far and not agreed(evidence)
        if not steps and (mends or not _enough(evidence, needed)):
            del selection.steps[index], selection.rivals[index]
            selection.chosen = rest
            continue
        if steps and cost(steps[0].fit) < cost(selection.chosen):
            selection.steps[index], selection.chosen = steps[0], steps[0].fit
        else:  # what was tried now is a worse fit of the same, or less likely
            selection.steps[index] = replace(step, fit=selection.chosen, evidence=evidence)
        seen = [s.guise for s in tried]
        selection.rivals[index] = [*tried, *(s for s in selection.rivals[index] if s.guise not in seen)]


def _of_shapes(steps: list[Step], so_far: float, local: Collection[str] = ()) -> float:
    """The part of the evidence `so_far` of `steps` that may be for how their shapes differ from the catalogue's.

    Not that of effects that are `local`: what would mend those is refused for where its evidence comes from.
    """
    known = [step for step in steps if step.guise.name in EXACT or step.guise.name in local]
    return max(so_far + sum(step.evidence.bic for step in known), 0.0)


def _local(fitted: Fit) -> set[str]:
    """Effects of a model that act in one place, where the axis seldom is."""
    places = [guise for guise in fitted.problem.guises if guise.name in PLACES]
    found = {guise.name: acting(fitted.problem, fitted.x, guise) for guise in places}
    return {name for name, near in found.items() if near is not None and near.mean() <= FEW}


def _enough(evidence: Comparison, needed: float) -> bool:
    """Whether an effect beside others has so much evidence, or unseen data or free runs tell what steps hardly do.

    Those tell no shape that was bent to fit: it was bent to others.
    """
    return -evidence.bic >= needed or proven(evidence) or nearer(evidence) or told_in_most_places(evidence)


def _try_twins(selection: Selection, search: Search) -> None:
    """Fit the last effect's twins that no shortlist had room for: a name is sure only where its twins were tried."""
    index = len(selection.steps) - 1
    last, tried = selection.steps[index], {step.guise.name for step in selection.rivals[index]}
    untried = TWINS.get(last.guise.name, frozenset()) - tried - set(selection.chosen.names)
    if not untried & search.names:
        return
    rest = selection.baseline if len(selection.chosen.problem.guises) == 1 else without(selection.chosen, last.guise)
    _, steps = search.explore(rest, untried, AGAIN, Stage.TEST)
    selection.rivals[index] = [*steps, *selection.rivals[index]]
    best = next((step for step in steps if step.refused is None), None)
    if best is not None and cost(best.fit) < cost(selection.chosen):
        selection.steps[index], selection.chosen = best, best.fit


def without(fitted: Fit, guise: Guise) -> Fit:
    """The model refitted without one of its effects."""
    bare = trimmed(fitted, tuple(other for other in fitted.problem.guises if other is not guise))
    return fit(bare.problem, bare.x[None])
