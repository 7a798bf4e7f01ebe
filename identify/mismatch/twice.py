"""A name that two recordings give, each fitted by itself: that stands in for agreement within one of them.

Or both ends of a single recording, each predicted by what was fitted to the rest of it.

A stop that is touched once a stroke has its evidence in few places of a recording, a gap whose state nobody knows
makes every free run worse, a drag is hardly felt in the slower of two motions. Chance is small and in few places, too;
but another recording does not have the same chance, of the same size at the same place. Each of the two is predicted
by what was fitted to the other: what they tell together was told by data that nothing was fitted to.
"""

from __future__ import annotations

import dataclasses
import math

from identify.mismatch.compare import ONCE
from identify.mismatch.conclusion import DRAG, Conclusion, overlap
from identify.mismatch.curve import CURVE
from identify.mismatch.effect_sizes import may_be_absent
from identify.mismatch.report_values import measured, quantities
from identify.mismatch.result import Quantity
from identify.mismatch.rules import (
    BIC,
    BIC_STRONG,
    FORESEEN,
    FORESEEN_Z,
    KNOWN,
    LATE,
    NEARER,
    OVERWHELMING,
    TIED_BIC,
    TIED_SHARE,
    Step,
    agreed,
    fills,
    lasting,
    misplacement,
)
from identify.mismatch.select import EXACT, Selection
from identify.mismatch.wandering import STEP

WITH_FORCE = EXACT | {"load_dependent_friction"}
WITH_ANGLE = {"torque_ripple", "pulley_eccentricity"}
BY_A_TENTH = 0.9  # of what a name leaves: physics in no catalogue that leaves less must be far less likely, too
BETTER = 0.9  # of the baseline's one-second error on unseen data: where more is left, all data must be far likelier


@dataclasses.dataclass(frozen=True, eq=False)
class Both:
    """One effect on top of the baseline in two conclusions, the likeliest way in each; None where it was unlikely."""

    steps: tuple[Step | None, Step | None]

    @property
    def told(self) -> list[Step]:
        """Those that are there."""
        return [step for step in self.steps if step is not None]

    @property
    def name(self) -> str:
        """Of the effect."""
        return self.told[0].guise.name

    @property
    def evidence(self) -> float:
        """Evidence of all data, fitted and unseen, in both. [1]"""
        return sum(map(_everywhere, self.told))

    @property
    def left(self) -> float:
        """One-second error on unseen data over the baseline's, geometric mean of both. [1]"""
        return math.prod(step.evidence.unseen for step in self.told) ** 0.5

    @property
    def sure(self) -> bool:
        """Whether unseen data of both speak for it, and fitted ones of each, or else unseen ones in most places.

        Or all of one recording, when fitted, in most places, and when predicted from the other.
        """
        told = [step.evidence for step in self.told]
        if len(told) < 2 or min(one.foreseen for one in told) < 0.0:
            return False
        enough = sum(one.foreseen for one in told) > 2.0 * FORESEEN or self.fills or self.frees
        if not enough or sum(one.bic for one in told) > BIC_STRONG:
            return False
        even = sum(one.foreseen_z for one in told) > FORESEEN_Z * 2.0**0.5  # standard errors of the sum of two
        turned = zip(told, reversed(told), strict=True)
        whole = any(one.bic < BIC_STRONG and agreed(one) and other.foreseen > 2.0 * FORESEEN for one, other in turned)
        return even or whole or max(one.bic for one in told) <= BIC_STRONG

    @property
    def lasts(self) -> bool:
        """Whether all data are far likelier without the best blocks, when fitted and when predicted, told twice."""
        told = [step.evidence for step in self.told]
        steady, again = sum(one.steady for one in told), sum(one.again for one in told)
        return steady < 2.0 * OVERWHELMING and again > -2.0 * OVERWHELMING

    @property
    def frees(self) -> bool:
        """Whether one-second runs of all data, fitted and unseen, end far nearer: steps hardly feel a soft force."""
        told = [step.evidence for step in self.told]
        runs = math.prod(one.free_run * one.unseen for one in told) ** 0.25
        return runs < NEARER and max(one.bic for one in told) < BIC and self.name not in ONCE

    @property
    def fills(self) -> bool:
        """Whether it fills a hole in both: then unseen data may be silent, as they are of a limit they do not reach."""
        return all(fills(step.evidence) for step in self.told)


def told_twice(first: Conclusion, turned: Conclusion) -> Conclusion | None:
    """The one name that leads in two conclusions together, neither of which stands by itself; None where none is sure.

    Args:
        first: fitted to the recordings before the last, which judges, or to the beginning of a single one.
        turned: with their roles exchanged, or fitted to the end.
    """
    both = _leader(first, turned)
    if both is None or not _agree((first, turned), both.told):
        return None
    ends = first.evidence.kind == "time"  # which have most of a recording in common
    if ends and any(map(_eclipsed, (first, turned), both.told)):
        return None
    found, step = min(zip((first, turned), both.told, strict=True), key=_preference)
    named = dataclasses.replace(step, refused=None)
    selection = Selection.beginning(named, found.selection.baseline, found.selection.opening)
    sure = dataclasses.replace(found, selection=selection, told_twice=True)
    if not sure.explains or any(map(may_be_absent, sure.effects)):
        return None
    if both.name == DRAG:  # or another curve of friction, which may be far likelier and predict no better
        return sure if both.left < BETTER else None
    better = sure.error_left < BETTER or _by_itself(found, step)
    return sure if better or lasting(step.evidence) or both.lasts or both.fills else None


def _preference(one: tuple[Conclusion, Step]) -> tuple[bool, float]:
    """First what stands by itself, then what predicts unseen data best."""
    found, step = one
    return not _by_itself(found, step), step.evidence.unseen


def _by_itself(found: Conclusion, step: Step) -> bool:
    """Whether a conclusion gives the name of a step without the other."""
    return found.explains and found.said == {step.guise.name}


def _leader(first: Conclusion, turned: Conclusion) -> Both | None:
    """What all data of both together make far likelier than any other name on top of the baseline; or None.

    Physics in no catalogue must only be less likely, unless it clearly predicts better: some of it acts in one place,
    and so does what is asked for here. But what is far behind something else in both, when fitted, is part of that.
    """
    if any(found.selection.aside - {CURVE, *LATE} or not found.selection.opening for found in (first, turned)):
        return None  # how friction bends, and slight delays, come beside anything
    ours, theirs = map(_likeliest, (first, turned))
    every = [Both((ours.get(name), theirs.get(name))) for name in {**ours, **theirs}]
    leader, *others = sorted(every, key=lambda both: -both.evidence)
    if leader.name == STEP or leader.name in first.outgrown | turned.outgrown or not leader.sure:
        return None
    least = leader.evidence - max(TIED_BIC, KNOWN * leader.evidence)
    for rival in others:
        if rival.evidence <= least or _equal(leader, rival):
            continue
        stranger = any(step.guise.depends is not None for step in rival.told)
        if not stranger or rival.left < BY_A_TENTH * leader.left:
            return None
    if all(map(_far_behind, (first, turned), leader.steps)):
        return None
    strange = (misplacement(step.fit, step.guise, step.evidence, step.acting, twice=True) for step in leader.told)
    return None if any(strange) else leader


def _far_behind(found: Conclusion, step: Step | None) -> bool:
    """Whether fitted data tell something else far better than a step, but for what happens in time."""
    lasting_ones = [
        one for one in found.selection.opening if one.guise.name not in ONCE and one.guise.depends != "time"
    ]
    most = max((-one.evidence.bic for one in lasting_ones), default=0.0)
    return step is None or -step.evidence.bic < TIED_SHARE * most


def _eclipsed(found: Conclusion, step: Step) -> bool:
    """Whether a conclusion is left with clearly more evidence for something else than for a step, but for moments.

    Its own force is left there, too, where it was chosen and did not stand: with the evidence it had in the end.
    """
    left = [one.evidence for one in found.nameless if one.coordinate != "time"]
    chosen = [other for other in found.selection.steps if found.said == {step.guise.name}]
    own = max(-one.evidence.bic for one in (step, *chosen))
    return max(left, default=0.0) > own + max(TIED_BIC, KNOWN * own)


def _likeliest(found: Conclusion) -> dict[str, Step]:
    """Name -> its likeliest way on top of the baseline, by all data; one that may be called so, if there is one."""
    ways = sorted(found.selection.opening, key=lambda step: (not step.misplaced, _everywhere(step)))
    return {step.guise.name: step for step in ways}


def _equal(one: Both, other: Both) -> bool:
    """Whether two names grow with the force, or turn with a shaft, and these data cannot tell them apart."""
    alike = any({one.name, other.name} <= names for names in (WITH_FORCE, WITH_ANGLE))
    return alike and abs(one.evidence - other.evidence) < 2.0 * TIED_BIC  # it is told in two


def _everywhere(step: Step) -> float:
    """Evidence of fitted and unseen data. [1]"""
    return step.evidence.foreseen - step.evidence.bic


def _agree(found: tuple[Conclusion, Conclusion], steps: list[Step]) -> bool:
    """Whether every size of one effect may be the same in both."""
    one, other = map(_sizes, found, steps)
    for name in one.keys() & other.keys():
        ours, theirs = one[name].ci95, other[name].ci95
        if ours is not None and theirs is not None and not overlap(ours, theirs):
            return False
    return True


def _sizes(found: Conclusion, step: Step) -> dict[str, Quantity]:
    """What a step measures, as the conclusion's last polish has it where the effect was chosen."""
    if step.guise.name not in found.said:
        return quantities(measured(step.fit), step.guise)
    return quantities(measured(found.final), found.final.problem.guise(step.guise.name))
