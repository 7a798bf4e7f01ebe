"""Physics of the drive that is in no catalogue: torque that is lost with speed, time, direction, or comes too slowly.

What looks like it in the catalogue is a torque constant, a drag, a lag; like all of `uncatalogued.py` it is located,
never named.
"""

from __future__ import annotations

import math

from identify.mismatch.guise import Guise, Setting, Unknown, grid
from plant.effects.effect import Effect, Parameter
from plant.kernels.exponential import exp_neg
from plant.kernels.laws import DRIVE, LANES, MOTOR_MIDDLE, RAMP, SPEED, TO_DRIVE, Rows, law

LEVELS = 10.0  # times bent: iron that levels off sooner, at a third of the peak, is another torque constant
SLOW, SLOWEST = (0.015, 0.04, 0.1, 0.25), 2.0  # s: so long the largest force may be on its way


@law(TO_DRIVE)
def _fade(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        b[DRIVE + j] *= 1.0 - p[j] * (1.0 - exp_neg(max(t, 0.0) / p[LANES + j]))


FADING_TORQUE = Effect(
    name="fading_torque",
    parameters=(
        Parameter("relative_loss", "1", (-0.9, 0.9), absent=0.0, about="κ"),
        Parameter("time_constant", "s", (1.0, 3600.0), (1e-3, 1e9), about="τ"),
    ),
    laws=(_fade,),
    order=10,
    source="magnets lose torque as they warm up",
)


@law(TO_DRIVE)
def _by_sign(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        b[DRIVE + j] += p[j] * abs(b[DRIVE + j])


UNEVEN_GAIN = Effect(
    name="uneven_gain",
    parameters=(Parameter("imbalance", "1", (-0.3, 0.3), (-1.0, 1.0), absent=0.0, about="e"),),
    laws=(_by_sign,),
    order=20,
    source="half-bridges or current sensors that differ: F_d (1 + e sgn F_d)",
)


@law(TO_DRIVE)
def _slew(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        goal = b[DRIVE + j]
        before = x[j] if x[j] == x[j] else goal
        most = p[j] * h
        step = min(max(goal - before, -most), most)
        part = abs(step) / most  # of the sub-step on its way, then it is there
        b[DRIVE + j] = before + step * (1.0 - 0.5 * part)
        b[RAMP + j] = step * part * (3.0 - 2.0 * part)
        x[j] = before + step


SLEW_LIMIT = Effect(
    name="slew_limit",
    parameters=(Parameter("rate", "N/s", (1.0, 1e6), (0.0, math.inf), absent=math.inf, about="dF/dt at most"),),
    laws=(_slew,),
    order=25,
    initial=(math.nan,),
    source="an amplifier that runs out of voltage, a ramp in the drive",
)


@law(TO_DRIVE)
def _weaken(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        fast = abs(b[SPEED + j]) / p[LANES + j]
        b[DRIVE + j] *= 1.0 - p[j] * fast * (1.0 + p[2 * LANES + j] * (fast - 1.0))


WEAKENING = Effect(
    name="weakening_drive",
    parameters=(
        Parameter("relative_loss", "1", (-0.9, 0.9), absent=0.0, about="κ, at the speed v_1"),
        Parameter("speed", "m/s", (1e-3, 10.0), (1e-9, 1e6), reported=False, about="v_1"),
        Parameter("square", "1", (0.0, 1.0), reported=False, about="1: with the square of speed, 0: with speed"),
    ),
    laws=(_weaken,),
    order=10,
    source="field weakening, back-EMF, eddy currents: a torque constant that falls with speed",
)


@law(TO_DRIVE)
def _swallow(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        swallowed = min(max(b[DRIVE + j], -p[j]), p[j])
        b[RAMP + j] = 0.0 if swallowed == b[DRIVE + j] else b[RAMP + j]
        b[DRIVE + j] -= swallowed


DEAD_BAND = Effect(
    name="dead_band",
    parameters=(Parameter("band", "N", (0.0, 1e3), (0.0, 1e9), absent=0.0, about="w: what is lost of any force"),),
    laws=(_swallow,),
    order=10,
    source="an amplifier with a dead band, a valve with overlap: F_d less what lies within ±w",
)


@law(TO_DRIVE)
def _saturate(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        share = b[DRIVE + j] / p[LANES + j]
        square = share * share
        bend = p[2 * LANES + j]
        b[DRIVE + j] *= 1.0 - p[j] * square * (1.0 + bend) / (1.0 + bend * square)


SATURATING = Effect(
    name="saturating_drive",
    parameters=(
        Parameter("relative_loss", "1", (-0.9, 0.9), absent=0.0, about="κ, at the force F_1"),
        Parameter("at", "N", (1.0, 1e6), (1e-9, 1e9), reported=False, about="F_1"),
        Parameter("bend", "1", (0.0, 10.0), (0.0, 1e9), reported=False, about="r: 0 with the square, more levels off"),
    ),
    laws=(_saturate,),
    order=10,
    source="iron that saturates: F_d less κ q² (1 + r) / (1 + r q²) of it, q = F_d / F_1",
)


@law(TO_DRIVE)
def _by_place(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        b[DRIVE + j] *= 1.0 + p[j] * (b[MOTOR_MIDDLE + j] - p[LANES + j])


GAIN_ALONG = Effect(
    name="gain_along",
    parameters=(
        Parameter("relative_slope", "1/m", (-10.0, 10.0), (-1e9, 1e9), absent=0.0, about="k"),
        Parameter("centre", "m", (-10.0, 10.0), (-1e9, 1e9), reported=False, about="y_m"),
    ),
    laws=(_by_place,),
    order=10,
    source="a lever, a linkage, a drum whose rope winds up: the transmission changes along the travel",
)


@law(TO_DRIVE)
def _overshoot(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        told = b[DRIVE + j]
        before = x[j] if x[j] == x[j] else told
        stays = h / p[LANES + j]
        left = exp_neg(stays)
        mean = (1.0 - left) / stays
        b[DRIVE + j] += p[j] * (told - before) * mean
        x[j] = told + (before - told) * left


OVERSHOOT = Effect(
    name="overshooting_drive",
    parameters=(
        Parameter("share", "1", (-0.9, 5.0), absent=0.0, about="a"),
        Parameter("time_constant", "s", (1e-3, 10.0), (1e-9, 1e6), about="τ, in which it settles"),
    ),
    laws=(_overshoot,),
    order=25,
    initial=(math.nan,),
    source="a drive whose current overshoots, or creeps up: F_d + a (F_d - F_d behind a lag)",
)
EFFECTS = (FADING_TORQUE, UNEVEN_GAIN, SLEW_LIMIT, WEAKENING, DEAD_BAND, SATURATING, GAIN_ALONG, OVERSHOOT)


def driven(s: Setting) -> list[Guise]:
    """Every way in which physics of the drive is tried in recordings of this setting."""
    fade = Unknown("time_constant", s.duration, 0.03 * s.duration, 10.0 * s.duration, log=True, spread=2.0)
    rate = Unknown("rate", s.force / 0.05, s.force / SLOWEST, s.force / s.sample_time, log=True, spread=2.0)
    loss = Unknown("relative_loss", 0.1, -0.9, 0.9)
    bend = Unknown("bend", 1.0, 0.03, LEVELS, log=True, spread=3.0)
    share = Unknown("share", 0.2, -0.6, 3.0)
    settles = Unknown("time_constant", 0.03, 0.3 * s.sample_time, 3.0, log=True, spread=1.5)
    slope = Unknown("relative_slope", 0.2 / s.travel, -1.8 / s.travel, 1.8 / s.travel)
    band = Unknown("band", 0.1 * s.force, 0.0, s.peak)
    return [
        Guise(FADING_TORQUE, (loss, fade), grid([0.05], [0.2 * s.duration, s.duration]), depends="time"),
        Guise(UNEVEN_GAIN, (Unknown("imbalance", 0.1, -0.5, 0.5),), grid([0.05]), depends="torque"),
        Guise(SLEW_LIMIT, (rate,), grid([s.force / time for time in SLOW]), depends="torque_rate"),
        Guise(DEAD_BAND, (band,), grid([0.03 * s.force, 0.1 * s.force]), depends="torque"),
        Guise(SATURATING, (loss, bend), grid([0.05], [0.1, 5.0]), fixed=(("at", s.peak),), depends="torque"),
        Guise(GAIN_ALONG, (slope,), grid([0.1 / s.travel]), fixed=(("centre", s.middle),), depends="position"),
        Guise(OVERSHOOT, (share, settles), grid([0.1], [0.01, 0.04, 0.2]), depends="torque_rate"),
        *(
            Guise(WEAKENING, (loss,), grid([0.05]), fixed=(("speed", s.speed), ("square", square)), depends="velocity")
            for square in (0.0, 1.0)
        ),
    ]
