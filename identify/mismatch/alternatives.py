"""All sets of names that the recordings cannot tell from the chosen one."""

from __future__ import annotations

import itertools

from identify.mismatch.conclusion import Conclusion
from identify.mismatch.effect_sizes import averaged, lags_in_series
from identify.mismatch.result import FoundEffect
from identify.mismatch.rivals import fit_of
from identify.mismatch.rules import TIED_BIC, Step, beyond, cost, disputed, tied

EXACT = {"force_offset": "coulomb_asymmetry", "coulomb_asymmetry": "force_offset"}
WEIGHTLESS = {"inertia_error": "torque_scale_error", "torque_scale_error": "inertia_error"}  # where friction is free


def alternatives_of(found: Conclusion, effects: tuple[FoundEffect, ...]) -> tuple[tuple[str, ...], ...]:
    """The named set, then every set these data cannot tell from it."""
    chosen, selection = tuple(effect.name for effect in effects), found.selection
    sets, swaps = [chosen], []
    for step, rivals in zip(selection.steps, selection.rivals, strict=False):
        fair = [one for one in rivals if one.refused is None or one.small or disputed(step, one)]
        for rival in tied(step, fair):
            _add(sets, _constants(found, chosen, rival), step.guise.name, rival.guise.name)
            swaps.append((step.guise.name, rival.guise.name))
    for pair in itertools.combinations(dict.fromkeys(swaps), 2):
        _add_both(found, sets, *pair)
    names = [step.guise.name for step in selection.steps]
    extra = tuple(name for name in chosen if name not in names)
    late = set(names) - set(chosen)
    for other in selection.others:
        _append(sets, (*(step.guise.name for step in other.steps if step.guise.name not in late), *extra))
    offset = found.constant
    if offset is not None and offset.effect.name in chosen:
        for name in offset.names:
            _add(sets, chosen, offset.effect.name, name)
        if "position_spring" in chosen:  # a constant force beside a spring is where it rests
            _append(sets, tuple(name for name in chosen if name != offset.effect.name))
    exact = EXACT if found.axis.mechanics.weight > 0.0 else EXACT | WEIGHTLESS
    for name, twin in exact.items():
        for known in tuple(sets):
            _add(sets, known, name, twin)
    if lags_in_series(effects):
        sets.append(tuple(name for name in chosen if name != "dead_time"))
    if averaged(effects):
        sets.append(tuple(name for name in chosen if name != "actuator_lag"))
    return tuple(sets)


def _constants(found: Conclusion, chosen: tuple[str, ...], rival: Step) -> tuple[str, ...]:
    """`chosen` with the constant force that the model of a `rival` beside all other names needs, or without."""
    named = found.said
    lacks_some = len(rival.fit.names) < len(found.selection.chosen.names)
    if lacks_some or beyond(rival.fit) == (len(chosen) > len(named)):
        return chosen
    return (*chosen, "force_offset") if beyond(rival.fit) else tuple(name for name in chosen if name in named)


def _add(sets: list[tuple[str, ...]], chosen: tuple[str, ...], name: str, other: str) -> None:
    """Note `chosen` with `other` in place of `name`, once, where that makes sense."""
    if name in chosen and other not in chosen:
        _append(sets, tuple(other if one == name else one for one in chosen))


def _add_both(found: Conclusion, sets: list[tuple[str, ...]], one: tuple[str, str], other: tuple[str, str]) -> None:
    """Note the chosen set with two names swapped at once, where that is as likely."""
    instead = dict((one, other))
    swapped = tuple(instead.get(name, name) for name in sets[0])
    if len(instead) < 2 or not set(instead) <= set(sets[0]) or set(swapped) in map(set, sets):
        return
    chosen = found.selection.chosen
    both = fit_of(set(swapped), set(sets[0]), chosen, found.selection.rivals, found.ways)
    if both is not None and cost(both) < cost(chosen) + TIED_BIC:
        _append(sets, swapped)


def _append(sets: list[tuple[str, ...]], names: tuple[str, ...]) -> None:
    """Note `names`, once, where none of them is there twice."""
    if len(set(names)) == len(names) and set(names) not in map(set, sets):
        sets.append(names)
