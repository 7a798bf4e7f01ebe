"""What the size of a named effect, or two of them together, may mean beside what they are called."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify.mismatch.guise import Guise
from identify.mismatch.result import FoundEffect
from identify.mismatch.rules import GAP, LATE
from identify.mismatch.wandering import PLACE, STEP
from plant.effects import find

STAMPS = "position may be stamped later than torque by {:.2g} s, or the drive be late: taken into account, not named"
MAYBE = "{}: there may be some, or none: taken into account, not named"
ORDERS = 3  # lags in series that a drive may have
AVERAGED = (0.5, 1.0)  # dead time over lag of what may be an averaged command; both are known to a third or so
ENDLESS = 30.0  # times a stiffness, or a limit: where its interval reaches so far up, nothing is known of it either
OF_MANY = 0.45  # of a step or a place, half-width: 4.4 standard deviations, for the best of many needs more than one
WIDE = 3.0  # times a size: an interval that reaches so far towards zero, and beyond, says that nothing is known of it


def may_be_absent(effect: FoundEffect) -> bool:
    """Whether the interval of the effect's size reaches zero, or of what absence is infinite, far up."""
    return any(low <= 0.0 <= high for _, low, high in _sizes(effect, absent=0.0)) or _endless(effect)


def _endless(effect: FoundEffect) -> bool:
    """Whether a stiffness or a limit may as well be so large that nothing of the effect is there."""
    return any(high > ENDLESS * value for value, _, high in _sizes(effect, absent=np.inf))


def may_be_rigid(effect: FoundEffect, guise: Guise) -> bool:
    """Whether a transmission may as well be as stiff as the stiffest that was looked for, and beyond: nobody asked."""
    if guise.swings is None:
        return False
    stiffness = guise.unknowns[0]
    interval = effect.parameters[stiffness.parameter].ci95
    return interval is not None and interval[1] >= stiffness.high


def may_be_touching(effect: FoundEffect, guise: Guise) -> bool:
    """Whether a gap may as well be as narrow as what friction itself gives: beside another effect, that is none."""
    interval = effect.parameters["gap"].ci95 if effect.name == GAP else None
    return interval is not None and interval[0] < guise.least


def unknown(effect: FoundEffect) -> bool:
    """Whether the interval of a size reaches far beyond zero, so that nothing is known of it: unseen data disagree."""
    towards = [(value, low if value > 0.0 else high) for value, low, high in _sizes(effect, absent=0.0)]
    return _endless(effect) or any(abs(value - end) > WIDE * abs(value) for value, end in towards)


def one_of_any(effect: FoundEffect) -> bool:
    """Whether a step or a place is so little known that one moment or place or another of wandering friction has such.

    The largest of the steps at all moments exceeds 3.5 standard deviations once in a hundred (Andrews 1993); of the
    places along a guide there are as many, and of their widths.
    """
    if effect.name not in (STEP, PLACE):
        return False
    return any(high - low > 2.0 * OF_MANY * abs(value) for value, low, high in _sizes(effect, absent=0.0))


def _sizes(effect: FoundEffect, absent: float) -> list[tuple[float, float, float]]:
    """Value and interval of each parameter at whose value `absent` the effect is not there."""
    names = [part.name for part in find(effect.name).parameters if part.absent == absent]
    known = [effect.parameters[name] for name in names if name in effect.parameters]
    return [(one.value, *one.ci95) for one in known if one.ci95 is not None]


def lags_in_series(effects: Sequence[FoundEffect]) -> bool:
    """Whether the dead time beside a lag is short enough for both to be some lags in series, a lag of higher order.

    The force's mean delay and its variance are those of n equal lags where the dead time is sqrt(n) - 1 of the lag.
    """
    ratio = _dead_time_per_lag(effects)
    return ratio is not None and ratio <= np.sqrt(ORDERS) - 1.0


def averaged(effects: Sequence[FoundEffect]) -> bool:
    """Whether a lag and a dead time may be one late command, the mean of the last while.

    The force's mean delay and its variance are those of a mean where the dead time is sqrt(3) - 1 of the lag.
    """
    ratio = _dead_time_per_lag(effects)
    return ratio is not None and AVERAGED[0] < ratio < AVERAGED[1]


def _dead_time_per_lag(effects: Sequence[FoundEffect]) -> float | None:
    """The dead time over the lag [1], where both are there."""
    size = {effect.name: effect.parameters[LATE[effect.name]].value for effect in effects if effect.name in LATE}
    return size["dead_time"] / size["actuator_lag"] if len(size) == len(LATE) else None


def taken_into_account(effect: FoundEffect) -> str:
    """What is said of an effect that may be absent: a lag may be stamps of the two channels that are apart."""
    late = LATE.get(effect.name)
    return MAYBE.format(effect.name) if late is None else STAMPS.format(effect.parameters[late].value)
