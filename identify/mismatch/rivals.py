"""Fits of the sets of effects that the data cannot tell apart: what the next experiment has to separate."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from identify.mismatch.compare import Fit, block_z, fit, trimmed
from identify.mismatch.guise import Guise
from identify.mismatch.rules import TIED_BIC, TIED_Z, Step
from identify.mismatch.score import extend

Floats = NDArray[np.float64]

EXACT_TWINS = {"force_offset", "coulomb_asymmetry"}
MOST_RIVALS = 5  # sets that an experiment is made for; more are rare, and may cost a fit each


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class Rival:
    """A set of names and the fit that stands for it."""

    names: tuple[str, ...]
    fit: Fit


def rivals_of(
    chosen: Fit, sets: Sequence[tuple[str, ...]], stages: Sequence[Sequence[Step]], ways: Sequence[Guise]
) -> list[Rival]:
    """A fit for the chosen set and for each set tied with it; sets that cannot be fitted are left out.

    Args:
        chosen: the fit of the first set.
        sets: the chosen set, then those tied with it.
        stages: everything that was fitted in the search.
        ways: how each effect may be present in these recordings.
    """
    found = [Rival(tuple(sets[0]), chosen)]
    for names in sets[1 : MOST_RIVALS + 1]:
        fitted = fit_of(set(names), set(sets[0]), chosen, stages, ways)
        if fitted is not None:
            found.append(Rival(tuple(names), fitted))
    return found


def fit_of(
    names: set[str], named: set[str], chosen: Fit, stages: Sequence[Sequence[Step]], ways: Sequence[Guise]
) -> Fit | None:
    """The best known fit with these effects, or a fresh one that starts from what is known of each.

    What the `chosen` fit takes into account beside the effects that are `named` in it is beside these, too.
    """
    names = names | (set(chosen.names) - named)
    known = [step for stage in stages for step in stage if step.guise in step.fit.problem.guises]
    direct = [step.fit for step in known if set(step.fit.names) == names]
    if direct:
        return min(direct, key=lambda one: one.found.criterion)
    current = trimmed(chosen, tuple(guise for guise in chosen.problem.guises if guise.name in names))
    for name in sorted(names - set(current.names)):
        seen = [step for step in known if step.guise.name == name]
        if seen:
            best = min(seen, key=lambda step: step.fit.found.criterion)
            guise, starts = best.guise, best.fit.x[None, best.fit.problem.slot(best.guise)]
        else:
            offered = next((guise for guise in ways if guise.name == name), None)
            if offered is None or offered.stiff:
                if name == "force_offset" and not chosen.problem.gravity_known:
                    continue  # the baseline holds it already
                return None
            guise, starts = offered, _both_signs(offered)
        problem, x = extend(current, guise, starts)
        current = fit(problem, x)
    return fit(current.problem, current.x[None]) if current.problem.guises == () else current


def _both_signs(guise: Guise) -> Floats:
    """The first starting point, and the same with its amplitude reversed. (1 or 2, q)"""
    start = guise.scaled_starts()[:1]
    amplitude = guise.amplitude()
    if amplitude is None:
        return start
    other = start.copy()
    other[0, amplitude] *= -1.0
    return np.asarray(np.clip(np.concatenate([start, other]), *guise.bounds()), dtype=np.float64)


def still_tied(rivals: Sequence[Rival], sets: Sequence[tuple[str, ...]]) -> tuple[tuple[str, ...], ...]:
    """The `sets` without twins that break away from rest differently here, though they are one while sliding.

    A constant force and an asymmetry of the dry friction are listed beside each other by rule; where the recording
    holds rests enough to tell them apart, the rule gives way to the evidence.
    """
    chosen = rivals[0]
    kept = []
    for names in sets:
        rival = next((one for one in rivals if set(one.names) == set(names)), None)
        swapped = set(names) ^ set(chosen.names) == EXACT_TWINS
        if rival is not None and swapped and _told_apart(chosen.fit, rival.fit):
            continue
        kept.append(tuple(names))
    return tuple(kept)


def _told_apart(chosen: Fit, rival: Fit) -> bool:
    """Whether the evidence for the chosen model over the rival is strong, and comes from many places."""
    gained = chosen.terms() - rival.terms()
    price = (chosen.problem.p - rival.problem.p) * float(np.log(chosen.problem.samples.used))
    return 2.0 * float(gained.sum()) - price > TIED_BIC and block_z(gained) > TIED_Z
