"""What a finished selection means: does the name stand, and is it worth its risk."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from functools import cached_property, reduce

import numpy as np

from identify.mismatch.baseline import fit_baseline
from identify.mismatch.compare import ONCE, Comparison, Fit, brief_ratio, compare, fairest_ratio
from identify.mismatch.constant import Constant, constant_force
from identify.mismatch.curve import CURVE
from identify.mismatch.data import Evidence
from identify.mismatch.effect_sizes import may_be_absent, may_be_rigid, may_be_touching, one_of_any, unknown
from identify.mismatch.finish import clocks_apart, finished
from identify.mismatch.floors import no_better, within_reach
from identify.mismatch.guise import Guise, Setting
from identify.mismatch.inverse import Unexplained, unexplained
from identify.mismatch.locate import ANGLES, COORDINATE, WHERE
from identify.mismatch.nameless import SURE, Structure, simplest_first
from identify.mismatch.progress import Doing, Stage, Tell
from identify.mismatch.remains import Remains
from identify.mismatch.report_values import measured, quantities, second_opinion
from identify.mismatch.result import FoundEffect, Verdict
from identify.mismatch.rules import (
    BIC_STRONG,
    BREAK_AWAY,
    CLEARLY,
    CONVINCING,
    FORESEEN,
    HARDLY,
    HELD_OUT,
    LATE,
    LEAD,
    LESSER,
    MUCH,
    NO_NAME,
    PROVEN,
    SLACK,
    SOLVED,
    STILL,
    STRAY,
    TIED_SHARE,
    Z_STRONG,
    Step,
    Z,
    agreed,
    at_edge,
    beyond,
    clear_lead,
    cost,
    decided,
    everywhere,
    fills,
    finding,
    foretold,
    hardly_late,
    lasting,
    outdone,
    overwhelming,
    price,
    strong,
    told_in_most_places,
    unreached,
)
from identify.mismatch.select import EXACT, PLACES, Selection, without
from identify.mismatch.wandering import PLACE, one_of_many
from plant.axis import Axis
from plant.recording import Recording

REST = 0.0135  # of the dry friction: latent force beside a name, just above that of a complete model, above which ...
KEPT = 0.7  # ... and above which share of its former level, the name does not stand: it explains little
CONFIRMED = 0.15  # of the error on unseen data: names that leave no more need neither where unseen data agree on them
DIRTY = 2.0  # times as much: the rest, where names leave less than MUCH of the error on unseen data
LOUD = 0.03  # of the dry friction: latent force beside which nothing stands that leaves more than that of the error,
# but where fitted and unseen data are far likelier without the best blocks of either
LEFT = 0.4  # of a name's evidence: a nameless shape with more than this beside it, and the name does not stand; all
# of it for an event in time, which may come on top of anything, and for how the shape of a proven name differs
SLIGHT = 0.05  # of the dry friction: force of a name that friction which wanders imitates, where one looks twice for it
LITTLE = 0.5  # of a proven name's force, where it acts: a nameless shape of less is another matter
WORTH = 0.85  # of the baseline's one-second error on unseen data: names that leave more of it gain too little to be
# worth the risk of being wrong
MOST_RUNS = 0.2  # of it past the worst runs: there, likelier unseen data need not agree
ELSEWHERE = 100.0  # evidence for anything else that recordings may have in which a name that others have does not show
LITTLE_ELSE = 1 / 3  # of what names make of such recordings: what these tell of anything else, where one does not act
ACTED = 0.12  # of a sample: how well the log of a loop that runs faster tells when its torque acted, 95 %
PLACED = 0.1  # of the dry friction: what acts in one place and is more has not wandered there
TRACE = 0.005  # of the square of the force that all names take away: less beside another name is none
MOMENT = 1.5  # s: what is over sooner takes no name from what was there all the time
PASSING = 0.3  # of the longest recording: nor what is over sooner where unseen data tell that name
DRAG = "quadratic_drag"
BEYOND = 1.05  # times the largest force, or the range of positions, of what was fitted
TORN = 1.5  # times the error of the same model fitted to the held-out recording itself
TOLD_BETTER = 2.0  # times the evidence: so many more know better how an effect's own curve bends
USELESS = 1.0  # eq. (4): one-second predictions that are worse than none at all


@dataclasses.dataclass(frozen=True)
class Conclusion:
    """Everything a finished selection is written up from.

    Attributes:
        plain: the baseline everybody would fit; that of the selection may know friction from commissioning.
        told_twice: whether two recordings, each fitted by itself, gave this name (`twice.py`).
    """

    axis: Axis
    seed: int
    recordings: Sequence[Recording]
    evidence: Evidence
    setting: Setting
    selection: Selection
    ways: list[Guise]
    progress: Tell
    plain: Fit
    told_twice: bool = False

    @cached_property
    def final(self) -> Fit:
        """The chosen model after its last polish: what is reported of it."""
        return self.polished(self.selection.chosen)

    def polished(self, chosen: Fit) -> Fit:
        """`chosen` after a last polish."""
        self.progress(Doing(Stage.CONCLUSION, "last polish"))
        return finished(chosen, self.evidence.held_out, self.setting.native_time or self.setting.sample_time)

    @cached_property
    def constant(self) -> Constant | None:
        """The constant force, where it earned a name beside the chosen effects."""
        chosen = self.selection.chosen
        lacking = unexplained(chosen.problem, chosen.x, self.evidence.train)
        rest = 0.0 if lacking is None else float(np.sqrt(np.mean(lacking.lacking**2)))
        so_far = price(self.selection.baseline) - price(chosen)
        return constant_force(chosen, self.ways, rest, so_far)

    @cached_property
    def remains(self) -> Remains:
        """What is left without a name."""
        return Remains(self.axis, self.evidence, self.selection, self.bare, self.progress)

    @property
    def said(self) -> set[str]:
        """Names of the chosen effects."""
        return {step.guise.name for step in self.selection.steps}

    @property
    def told(self) -> set[str]:
        """Names that are told: of chosen effects that are known to be there, and of a constant force."""
        if self.verdict is not Verdict.EXPLAINED:
            return set()
        constant = {self.constant.effect.name} if self.constant is not None and self.offset_named else set()
        return {effect.name for effect in self.named} | constant

    @property
    def slight(self) -> bool:
        """Whether a name is no larger than what friction that wanders shows in some part of any recording."""
        return any(step.acting < SLIGHT * self.bare.dry_level for step in self.selection.steps)

    @property
    def blind(self) -> bool:
        """Whether free runs cannot judge the chosen effects: their state where a run starts is unknown (see rules)."""
        return any(step.guise.stiff for step in self.selection.steps)

    def pays(self) -> bool:
        """Whether the chosen effects predict unseen data so much better that naming them is worth it.

        A few runs that break away too early or too late may decide the contract's sum of squares. Past the worst of
        them the gain must be clear; that is enough in any case where the effects decide when the axis breaks away.
        Weak evidence is worth a name only where half of the error is gone.
        Where most of the latent force is explained, sample by sample, free runs need only be no worse; past the worst
        of them, where the fitted data alone are not overwhelming. Nor more where unseen data foretell the effects, or
        where brief runs solve what all data tell even without their best blocks, or where they cannot tell: of a limit
        that is not reached there.
        """
        final = self.final
        share = self.error_left
        if self._evidence < -BIC_STRONG and share > MUCH:
            return False
        if _beyond_reach(self.said, self._gained):
            return True
        if decided(self._gained):
            return share < HELD_OUT or fairest_ratio(self.everyday, final, self.evidence.held_out) < WORTH
        if self.plain is not self.selection.baseline and beyond(self.plain) and not beyond(final):
            return share < HELD_OUT  # the everyday baseline has the same force, without a name
        if self.said & set(ONCE) and share >= HELD_OUT:
            return False  # friction that wanders has moments that sample by sample evidence foretells
        past = self._past
        if _foretells(self._gained) or (foretold(self._gained) and self._gained.lacking < SOLVED and past < 1.0):
            return True
        if lasting(self._gained) and self._brief < PROVEN:
            return True
        sure = overwhelming(self._gained) and self._gained.lacking < MUCH
        if sure and (self._gained.unseen < 1.0 if self.blind else past < WORTH):
            return True
        most_runs = past < MOST_RUNS and share < WORTH and self._gained.foreseen > FORESEEN
        if share >= CLEARLY and not (most_runs or foretold(self._gained)):
            return False
        enough = WORTH if BREAK_AWAY & set(final.names) else CLEARLY
        still = self.selection.chosen.latent_force > STILL * self.bare.latent_force
        return share < (CLEARLY if still else WORTH) or past < enough

    @property
    def unpaid(self) -> bool:
        """Whether names stand, and fitted and unseen data are far likelier with them, but free runs gain too little."""
        return bool(self.selection.steps) and overwhelming(self._gained) and self.stands and not self.pays()

    @property
    def kept(self) -> bool:
        """Whether names with strong evidence stand: where they are not told, the other end may tell them, too."""
        return bool(self.selection.steps) and self._evidence > -BIC_STRONG and self.stands

    def repeats(self, other: Conclusion) -> bool:
        """Whether this gives the names that `other` found, and stands."""
        return self.verdict is Verdict.EXPLAINED and self.said == other.said

    @property
    def hinted(self) -> bool:
        """Whether unseen data would tell an effect of which the fitted ones know nothing: at another speed or load."""
        told = _of_names(self.selection.opening)
        return any(one.foreseen > CONVINCING and foretold(one) and one.unseen < WORTH for one in told)

    @property
    def outreached(self) -> bool:
        """Whether what judges asks for more force, or goes further, than anything that was fitted: a limit, a stop."""
        fitted, unseen = self.evidence.train, self.evidence.held_out
        more = np.abs(unseen.force).max() > BEYOND * np.abs(fitted.force).max()
        low, high = fitted.position.min(), fitted.position.max()
        margin = (BEYOND - 1.0) * (high - low)
        return bool(more or unseen.position.min() < low - margin or unseen.position.max() > high + margin)

    @property
    def foretells_name(self) -> bool:
        """Whether fitted data tell an effect strongly, and unseen ones clearly, or are silent on what fills a hole."""
        told = _of_names(self.selection.opening)
        return any((one.bic < BIC_STRONG and foretold(one)) or (fills(one) and one.foreseen >= 0.0) for one in told)

    @cached_property
    def error_left(self) -> float:
        """One-second error on unseen data that the names leave, over the baseline's. [1]."""
        return self.held_out(self.final) / max(self._error_to_beat, 1e-300)

    @cached_property
    def _past(self) -> float:
        """Errors on unseen data past the worst runs over those of what is to beat. [1]."""
        return fairest_ratio(self._to_beat, self.final, self.evidence.held_out)

    @cached_property
    def _brief(self) -> float:
        """The same of the shortest runs, the worst of them too. [1]."""
        return brief_ratio(self._to_beat, self.final, self.evidence.held_out)

    @cached_property
    def _to_beat(self) -> Fit:
        """The baseline before or after a last polish, no effect of the names: what predicts unseen data better."""
        return min(self.everyday, self.polished(self.everyday), key=self.held_out)

    @cached_property
    def _error_to_beat(self) -> float:
        """Its one-second error on unseen data. [1]."""
        return self.held_out(self._to_beat)

    @cached_property
    def bare(self) -> Fit:
        """The model without effects: the baseline, with the shift of the clock or the exponent that is no effect."""
        if not self.selection.aside:
            return self.selection.baseline
        bare = reduce(without, [step.guise for step in self.selection.steps], self.selection.chosen)
        late = [guise for guise in bare.problem.guises if guise.name in LATE]
        if not late or hardly_late(bare):
            return bare
        return without(bare, late[0])  # beside the effects it was too short to be told, without them it stands for one

    @property
    def everyday(self) -> Fit:
        """What names must predict better than: the baseline everybody would fit, or one with what is no effect."""
        return self.bare if self.selection.aside else self.plain

    @cached_property
    def stands(self) -> bool:
        """Whether the chosen effects survive unseen data and explain most of what there is to explain."""
        baseline, chosen = self.bare, self.selection.chosen
        if self.held_out(self.final) > USELESS:
            return False
        if self.blind and not foretold(self._gained) and self._gained.again < 0.0:
            return False
        before, after = baseline.latent_force, chosen.latent_force
        share = self.error_left
        loud = after > LOUD * baseline.dry_level and self._gained.lacking > PROVEN
        if share > MUCH and loud and not lasting(self._gained):
            return False
        if share > CONFIRMED or (share > PROVEN and not foretold(self._gained)):
            rest = REST * baseline.dry_level * (DIRTY if share < MUCH else 1.0)
            if after > rest and after > KEPT * before and not (overwhelming(self._gained) or _foretells(self._gained)):
                return False
            strays = self.held_out(self.final) > STRAY * self.own and not decided(self._gained)
            if strays or self._odder:
                return False
        asked = not self.blind and not decided(self._gained)
        if asked and fairest_ratio(baseline, chosen, self.evidence.held_out) >= HELD_OUT:
            return False
        explained = self._evidence
        beside = {"time"}
        if share < PROVEN:
            beside |= {COORDINATE.get(name, "time") for name in chosen.names}
            beside |= WHERE if beside & ANGLES else set()
        little = LITTLE * min(step.acting for step in self.selection.steps) if share < PROVEN else 0.0
        left = [s for s in self.remains.beside_names if not 0.0 < s.force < little and not self._passing(s)]
        solved = share < PROVEN and decided(self._gained) and self._gained.lacking < PROVEN
        return all(s.evidence < (1.0 if solved or s.coordinate in beside else LEFT) * explained for s in left)

    def _passing(self, found: Structure) -> bool:
        """Whether it came and went: beside a moment anything may be true, beside more what unseen data tell, too."""
        longest = PASSING * self.remains.duration if foretold(self._gained) else MOMENT
        return found.coordinate == "time" and found.interval[1] - found.interval[0] <= longest

    @cached_property
    def _evidence(self) -> float:
        """Evidence for the chosen effects together. [1]"""
        return price(self.bare) - price(self.selection.chosen)

    @cached_property
    def _gained(self) -> Comparison:
        """What speaks for the chosen effects together."""
        return compare(self.bare, self.selection.chosen, self.evidence.held_out)

    @property
    def _odder(self) -> bool:
        """Whether as many effects, one of which cannot be what it is called, are likelier than the chosen ones.

        On the fitted data, and on all where unseen ones are likelier with the chosen.
        """
        chosen, steps = self.selection.chosen, self.selection.steps
        for number, tried in enumerate(self.selection.rivals):
            best = steps[min(number, len(steps) - 1)]
            odd = [one for one in tried if one.misplaced and not outdone(one, best)]
            for one in odd:
                worse = cost(one.fit) + max(best.evidence.foreseen - one.evidence.foreseen, 0.0)
                if len(one.fit.names) <= len(chosen.names) and worse < cost(chosen) - clear_lead(one, best):
                    return True
        return False

    @cached_property
    def explains(self) -> bool:
        """Whether there is something to name, and its name is worth the risk."""
        if not self.selection.steps:
            return self.offset_named
        stands = not self._outshone if self.told_twice else self.stands and self.pays()
        return stands and bool(self.named) and not self._leans

    @property
    def _outshone(self) -> bool:
        """Whether some structure that is left has more evidence than the names, other than what happened in time."""
        left = [one for one in self.remains.beside_names if one.coordinate != "time"]
        return any(one.evidence > self._evidence for one in left)

    @property
    def _leans(self) -> bool:
        """Whether much of the evidence is for an effect that is not known to be there.

        Nor how channels are stamped, nor what any contact gives.
        """
        problem = self.final.problem
        given = {one.name for one in self.effects if may_be_touching(one, problem.guise(one.name))}
        known = {effect.name for effect in self.named} | set(LATE) | given
        unknown = [step for step in self.selection.steps if step.guise.name not in known]
        return any(-step.evidence.bic > LEFT * self._evidence for step in unknown)

    def or_constant(self) -> Conclusion:
        """This, or, where its names gain too little, the constant force that explains something without them.

        Or more than names that do not stand.
        """
        if not self.selection.steps or self.explains:
            return self
        bare = self.selection.baseline
        opening = self.selection.opening
        alone = dataclasses.replace(self, selection=Selection(bare, bare, rivals=[opening], opening=opening))
        if alone.constant is None or not (self.stands or alone.constant.evidence > self._evidence):
            return self
        return alone if alone.explains else self

    def holds_beside(self, first: Conclusion) -> bool:
        """Whether names found with the roles of the recordings exchanged stand, where `first` found none.

        What judges must clearly foretell them, in most places or where they leave little force or error, and be
        predicted so much better; and where it was fitted `first`, nothing else may be so much more evident, nor they be
        too small or too strange for their names. What does not act there only makes friction known better: nothing
        else may be evident beside that.
        """
        names = self.said
        if self.verdict is not Verdict.EXPLAINED or not names or names <= first.outgrown:
            return False
        told = self._gained
        solves = told.lacking < SOLVED or self.error_left < MUCH
        solved = told.foreseen > CONVINCING and told.again > FORESEEN and solves
        if not (foretold(told) or solved or (told.foreseen > FORESEEN and told.lacking < SOLVED)):
            return False
        opening = first.selection.opening
        ours = [step for step in opening if step.guise.name in names]
        if any(step.misplaced for step in ours):
            return False
        most = max((-step.evidence.bic for step in opening), default=0.0)
        own = max((-step.evidence.bic for step in ours), default=0.0)
        better = self.error_left < CLEARLY or (BREAK_AWAY & names and self._past < MUCH) or decided(told)
        hidden = most < max(LESSER * self._evidence, LITTLE_ELSE * told.foreseen)  # a limit may not be reached there
        hidden = hidden and (decided(told) or solved)
        return bool(better) and (hidden or own >= min(TIED_SHARE * most, most - ELSEWHERE))

    def confirms(self, other: Conclusion) -> bool:
        """Whether physics in no catalogue that `other` is left with is seen here, too, and at the same place."""
        if other.verdict is not Verdict.UNEXPLAINED:
            return False
        where = other.nameless[0].coordinate
        theirs = {one.like: one.interval for one in other.nameless if one.like and one.coordinate == where}
        ours = [step for step in self.selection.opening if step.refused == NO_NAME and step.guise.name in theirs]
        likely = [step for step in ours if step.evidence.bic < BIC_STRONG and step.evidence.foreseen > FORESEEN]
        return any(overlap(self.remains.where(step, where), theirs[step.guise.name]) for step in likely)

    def outlasts(self, other: Conclusion) -> bool:
        """Whether more is left here that lasts than `other` is left with that happens in time: friction has moods."""
        unknown = self.verdict is other.verdict is Verdict.UNEXPLAINED
        if not unknown or self.happened or not other.happened:
            return False
        return self.nameless[0].evidence > TOLD_BETTER * other.nameless[0].evidence

    @cached_property
    def outgrown(self) -> set[str]:
        """Names beside which physics in no catalogue explains much of what they explain: it is what they stand for."""
        names = self.said
        if not names:
            return names
        strangers = [one for one in self.remains.beside_names if one.like]
        return names if any(one.evidence >= LEFT * self._evidence for one in strangers) else set()

    def denies(self, names: set[str]) -> bool:
        """Whether unseen data have proven that what might have these `names` has another curve."""
        opening = self.selection.opening
        denied = {one.guise.name for one in opening if one.denied and one.evidence.unseen < PROVEN and strong(one)}
        return bool(names) and names <= denied

    @property
    def happened(self) -> bool:
        """Whether what is left without a name is an event in time: no other data are needed to say that."""
        return bool(self.nameless) and self.nameless[0].coordinate == "time"

    @property
    def spelled(self) -> bool:
        """Whether that is an equal force for a spell, which names found with other data may explain."""
        return self.happened and self.nameless[0].acting > 0.0

    @property
    def confirmed(self) -> bool:
        """Whether unseen data are sure of where what is left without a name shows."""
        return bool(self.nameless) and not self.happened and self.nameless[0].z > SURE

    @property
    def recognised(self) -> bool:
        """Whether physics in no catalogue explains what is left, and no effect of the catalogue would explain more."""
        if not self.nameless or not self.nameless[0].like:
            return False
        names = [step for step in self.selection.opening if step.guise.depends is None]
        return self.nameless[0].evidence >= max((-step.evidence.bic for step in names), default=0.0)

    def outdoes(self, other: Conclusion) -> bool:
        """Whether physics in no catalogue is likelier here than the names that `other` does not tell far more of."""
        if not self.recognised or other._evidence > TOLD_BETTER * self.nameless[0].evidence:
            return False
        ours = [step for step in self.selection.opening if step.guise.name in other.said and not step.misplaced]
        named = [-step.evidence.bic for step in ours]
        return self.nameless[0].evidence > (1.0 + LEAD) * max(named, default=0.0)

    @property
    def bent(self) -> set[str]:
        """Names of effects whose own curve, free to bend, is another's, where that is what is left without a name."""
        if not self.recognised:
            return set()
        opening, told = self.selection.opening, self.nameless[0].evidence
        return {one.guise.name for one in opening if one.denied and -one.evidence.bic >= told}

    def straightens(self, other: Conclusion) -> bool:
        """Whether a name stands that had another's curve in `other`, whose data told far less of it."""
        known = self.verdict is Verdict.EXPLAINED and bool(self.said) and self.said <= other.bent and not self.slight
        return known and self._evidence > TOLD_BETTER * other.nameless[0].evidence

    def outweighs(self, other: Conclusion) -> bool:
        """Whether names stand that have far more evidence than the moment which is the most that `other` can tell.

        What is less than how well shapes are known may have lasted all the while.
        """
        known = self.verdict is Verdict.EXPLAINED and bool(self.said) and not self.slight
        if not known or other.verdict is not Verdict.UNEXPLAINED or not other.happened or other.denies(self.said):
            return False
        moment = other.nameless[0]
        brief = moment.interval[1] - moment.interval[0] <= PASSING * other.remains.duration
        return self._evidence > (TOLD_BETTER if brief else 1.0 / LESSER) * moment.evidence

    @cached_property
    def torn(self) -> bool:
        """Whether one model, fitted to what was fitted, fails on held-out data that it fits if it may."""
        return self.astray > TORN

    @cached_property
    def astray(self) -> float:
        """One-second error of the everyday model on held-out data over that of the same fitted to them. [1]"""
        return self.held_out(self.everyday) / max(self.own, 1e-300)

    @cached_property
    def own(self) -> float:
        """One-second error on the held-out data of the baseline fitted to them. [1]."""
        return fit_baseline(self.evidence.held_out, self.axis, self.seed).short_run()

    @cached_property
    def offset_named(self) -> bool:
        """Whether a constant force earned its name.

        A force alone is in the baseline too, without a name; what it is read as must predict unseen data better. Nor
        may more be left than it explains: what acts in part of the travel has a mean that is no constant force.
        """
        offset = self.constant
        if offset is None or (self.selection.steps and may_be_absent(offset.effect)):
            return False
        left = [] if self.selection.steps else self.remains.beside_names
        if any(one.evidence >= LEFT * offset.evidence for one in left):
            return False
        error = self.held_out(offset.fit)
        most = HELD_OUT if offset.effect.name == "force_offset" else 1.0
        return error < most * self.held_out(self.selection.chosen) and error < USELESS

    @cached_property
    def nameless(self) -> list[Structure]:
        """What a baseline that nothing is named beside leaves, the most evident first."""
        found = self.remains.without_names
        if found:
            return simplest_first(found)
        if self.selection.steps:
            told = [] if self.stands else self.remains.refused_names
            return told or self._strayed
        return self.remains.odd or self._strayed or self.remains.rising

    @property
    def _strayed(self) -> list[Structure]:
        """The rest of a recording, where it is not as what was fitted of it would have it."""
        return self.remains.strayed(self.astray) if self.evidence.kind == "time" else []

    @cached_property
    def verdict(self) -> Verdict:
        """The answer in a word."""
        if self.explains:
            return Verdict.EXPLAINED
        return Verdict.UNEXPLAINED if self.nameless else Verdict.NO_MISMATCH

    def held_out(self, fitted: Fit) -> float:
        """Eq. (4) over one-second free runs on data the fit has not seen. [1]."""
        return fitted.on(self.evidence.held_out).short_run()

    @cached_property
    def named(self) -> tuple[FoundEffect, ...]:
        """The chosen effects that are known to be there, the largest share first."""
        there = filter(self._there, self.effects)
        return tuple(within_reach(effect, self.final.problem.guise(effect.name)) for effect in there)

    def _there(self, effect: FoundEffect) -> bool:
        """Whether a chosen effect is known to be there: by the interval of its size, or by unseen data.

        A lag makes data likelier where the stamps of the two channels are apart, too, and friction that wanders is
        predicted better from any moment on, in other recordings as well. Beside another effect, what foretells unseen
        data may be how its curve differs, and what takes no force away is nothing. What was large enough to be named
        while another was missing may not be once that is found.
        """
        guise, several = self.final.problem.guise(effect.name), len(self.selection.steps) > 1
        x, share = self.final.x[self.final.problem.slot(guise)], self.error_left
        least = finding(effect.name, dataclasses.replace(self._gained, unseen=share))
        if guise.oddity(x, least) is not None or at_edge(self.final, guise) or may_be_rigid(effect, guise):
            return False
        if several and may_be_touching(effect, guise):
            return False
        if share >= PROVEN and one_of_any(effect):
            return False
        if several and not (self._felt_beside_others(effect) and self._told_beside_others(effect)):
            return False
        if effect.name == DRAG and not self._beyond_the_curve(effect):
            return False
        if effect.name == PLACE and one_of_many(self.selection.chosen, self._all_for(effect)):
            return False
        if not may_be_absent(effect) or (several and self._seen_beside_others(effect)):
            return True
        if unknown(effect):
            return False
        solved = share < PROVEN and agreed(self._gained)
        if effect.name in ONCE and share < CONFIRMED and (solved or foretold(self._gained)):
            return True
        if several or effect.name in (*LATE, *ONCE):
            return False
        return share < PROVEN or foretold(self.selection.steps[0].evidence)

    def _beyond_the_curve(self, effect: FoundEffect) -> bool:
        """Whether a drag has more evidence than that friction falls with speed otherwise than in eq. (1), if it does.

        How it falls is known no better than by that: a curve with two terms leaves a little drag beside any exponent.
        """
        if CURVE not in self.selection.aside:
            return True
        return -self._told(effect).bic > price(self.selection.baseline) - price(self.bare)

    def _felt_beside_others(self, effect: FoundEffect) -> bool:
        """Whether an effect takes some of the force away, or at least half of the error on unseen data.

        What a little mass takes is above what forces are taken to, and what a first break-away takes is short; beside a
        gap, whose blows are most of the force, all data must be far likelier, and unseen ones predicted clearly better.
        """
        step = _named(self.selection.steps, effect.name)
        told = step.evidence
        sure = told_in_most_places(told) or (overwhelming(told) and told.z > Z_STRONG and told.unseen < CLEARLY)
        predicts = sure or (foretold(told) and told.unseen < MUCH) or _elsewhere(step, self.selection.steps)
        brief = effect.name in BREAK_AWAY or _exact(step)
        return predicts or brief or effect.share >= TRACE * self._taken

    def _told_beside_others(self, effect: FoundEffect) -> bool:
        """Whether unseen data agree on it, or are predicted better with it: friction that wanders has any a little.

        Of a place that is harder by more than it wanders, they need only be likelier: they pass it for a moment each.
        Nor more of what has no shape that could mend another's, where fitted ones agree. Of a limit that they do not
        reach, they know nothing. What comes late does so everywhere: the places must agree on it.
        """
        late = effect.name in LATE
        return any(
            (told.unseen <= HARDLY and (told.z >= Z or not late))
            or foretold(told)
            or unreached(effect.name, told)
            or (told.foreseen > FORESEEN and told.again > 0.0 and self._likelier_is_enough(effect))
            for told in self._ways_told(effect)
        )

    def _likelier_is_enough(self, effect: FoundEffect) -> bool:
        """Whether an effect acts in one place, with more force than friction wanders by there, or has but one shape."""
        step = _named(self.selection.steps, effect.name)
        return _exact(step) or (effect.name in PLACES and step.acting > PLACED * self.bare.dry_level)

    def _ways_told(self, effect: FoundEffect) -> Iterator[Comparison]:
        """What spoke for an effect when it was added, and what does beside the others as they ended: bent, or more."""
        yield self._told(effect)
        chosen = self.selection.chosen
        yield compare(without(chosen, chosen.problem.guise(effect.name)), chosen, self.evidence.held_out)

    def _all_for(self, effect: FoundEffect) -> float:
        """Evidence of fitted and of unseen data for an effect, beside the others as they ended. [1]"""
        told = self._gained if len(self.selection.steps) == 1 else list(self._ways_told(effect))[-1]
        return max(told.foreseen, 0.0) - told.bic

    def _seen_beside_others(self, effect: FoundEffect) -> bool:
        """Whether unseen data that the other names alone predict badly tell an effect, however wide its interval.

        What a single stroke tells has next to none; nor what grows on and on while the axis rests, how much in the end.
        There all data must be overwhelmingly likelier, and a quarter of the latent force gone.
        """
        told = self._told(effect)
        badly = min(told.foreseen, told.again) > FORESEEN and (told.unseen < CONFIRMED or everywhere(told))
        return effect.name not in LATE and (badly or (overwhelming(told) and told.lacking < SLACK))

    def _told(self, effect: FoundEffect) -> Comparison:
        """What speaks for an effect beside the other names."""
        return _named(self.selection.steps, effect.name).evidence

    @cached_property
    def effects(self) -> tuple[FoundEffect, ...]:
        """The chosen effects, the largest share first.

        Where the fitted data alone cannot tell whether one is there and unseen data speak for it, its sizes are those
        of both together; beside others, all data must be overwhelmingly likelier, or, beside what acts in one
        place, unseen ones likelier and predicted clearly better, for it may be how another's curve differs.
        """
        chosen, final = self.selection.chosen, measured(self.final)
        other = second_opinion(self.final, self.evidence.held_out)
        closed = self.recordings[-1].loop == "closed"
        stamped = ACTED * (self.setting.native_time or self.setting.sample_time) if closed else 0.0
        stamped, rests = float(np.hypot(stamped, clocks_apart(self.final))), self.setting.rests
        found = []
        for step in self.selection.steps:
            guise = next(g for g in chosen.problem.guises if g.name == step.guise.name)
            self.progress(Doing(Stage.CONCLUSION, f"share of {guise.name}"))
            rest = without(chosen, guise) if len(chosen.problem.guises) > 1 else self.selection.baseline
            share = self._share(rest)
            values = no_better(guise.name, quantities(final, guise, other), stamped, rests)
            effect = FoundEffect(guise.name, share, values, step.force_rms)
            told = step.evidence
            alone = len(self.selection.steps) == 1
            likely = told.foreseen > FORESEEN if alone else lasting(told) or _elsewhere(step, self.selection.steps)
            if (likely or self.told_twice) and may_be_absent(effect):
                values = no_better(guise.name, quantities(final, guise, other, pooled=True), stamped, rests)
                effect = dataclasses.replace(effect, parameters=values, pooled=True)
            found.append(effect)
        return tuple(sorted(found, key=lambda effect: -effect.share))

    @cached_property
    def _taken(self) -> float:
        """Part of the residual force's variance that all names take away; noise may be the rest. [1]."""
        return self._share(self.bare)

    @cached_property
    def _with_all(self) -> Unexplained | None:
        """What the chosen effects leave of the fitted data's force."""
        chosen = self.selection.chosen
        return unexplained(chosen.problem, chosen.x, self.evidence.train)

    def _share(self, rest: Fit) -> float:
        """Part of the residual force's variance, fitted data, that `rest` leaves and the chosen effects do not. [1]."""
        chosen, train = self.selection.chosen, self.evidence.train
        with_all, lacking = self._with_all, unexplained(rest.problem, rest.x, train)
        if with_all is not None and lacking is not None:
            left = float(np.sum(with_all.lacking**2) / max(float(np.sum(lacking.lacking**2)), 1e-300))
        else:  # two masses seen from the motor have no inverse: what the prediction errors tell
            left = float(np.exp((price(chosen) - price(rest)) / len(train)))
        return float(np.clip(1.0 - left, 0.0, 1.0))


def _elsewhere(step: Step, steps: Sequence[Step]) -> bool:
    """Whether fitted and unseen data second each other on one of `steps` that is no curve of the others: a drag.

    The others act in one place, and it everywhere.
    """
    others = {other.guise.name for other in steps} - {step.guise.name}
    told = strong(step) and step.evidence.foreseen > FORESEEN
    return told and set() < others <= PLACES and step.guise.name not in PLACES


def _exact(step: Step) -> bool:
    """Whether fitted data tell, in most places, an effect of one shape, which could mend no other's."""
    return step.guise.name in EXACT and step.evidence.z >= Z


def _named(steps: Sequence[Step], name: str) -> Step:
    """The step of this effect."""
    return next(step for step in steps if step.guise.name == name)


def _beyond_reach(names: set[str], told: Comparison) -> bool:
    """Whether the one name is of a limit that unseen data do not reach, and fitted ones agree on it."""
    (name, *others) = names
    return not others and unreached(name, told) and told.z > Z and told.free_run < CLEARLY


def _foretells(told: Comparison) -> bool:
    """Whether unseen data, with friction as it was then, are likelier and predicted better, and fitted ones agree."""
    return foretold(told) and told.z >= Z_STRONG and told.unseen < WORTH


def overlap(one: tuple[float, float], other: tuple[float, float]) -> bool:
    """Whether two intervals have a point in common."""
    return one[0] <= other[1] and other[0] <= one[1]


def _of_names(steps: list[Step]) -> list[Comparison]:
    """Evidence of those steps that may be called what they are: no physics in no catalogue, nothing odd."""
    return [step.evidence for step in steps if not step.misplaced and step.guise.depends is None]
