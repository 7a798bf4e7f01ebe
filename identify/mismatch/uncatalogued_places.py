"""Physics that is in no catalogue and acts in part of its coordinate: past a joint, in a zone, a sector, above a speed.

What looks like it in the catalogue is a defect, a ripple, an asymmetry; like all of `uncatalogued.py` it is located,
never named.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np
from numba import njit

from identify.mismatch.guise import PLACED_SPREAD, Guise, Setting, Unknown, grid
from plant.effects.effect import Effect, Parameter
from plant.kernels.cosine import cos_turns
from plant.kernels.exponential import exp_neg
from plant.kernels.laws import (
    DRIVE,
    FORCE,
    LANES,
    LEVEL,
    MIDDLE,
    MOTOR_MIDDLE,
    STAGE_LEVEL,
    TO_DRIVE,
    TO_STAGE,
    TO_STEP,
    VELOCITY,
    VISCOUS_BACKWARD,
    VISCOUS_FORWARD,
    Rows,
    law,
)
from plant.kernels.step import FASTMATH

TURN = 0.5 / math.pi
SIDES = (1.0, -1.0)
OPENS = 0.15  # of the speed from which on it drags: how sharply
FLAT = 0.15  # of the highest speeds: slower, friction falls as its own curve does
TURNS = 1.5  # of a wheel that must be seen, for a sector of it to be more than a place
WIDE, SNAPS = 1.5, 2.0  # widths of a bell, or of a sector, within which it acts; those of a pull to a place
BLUNT = 0.02  # of the speed above which a drag grows: how sharply it begins
BRAKES = 0.3, 0.9  # of the highest speeds, where it does: slower, it is viscous friction; faster, it hardly acts
BAND = 0.15  # of the highest speeds: what is wider than such a band is friction's own curve


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def past(x: float) -> float:
    """From 0 far below x = 0 to 1 far above it."""
    value: float = 0.5 * (1.0 + x / math.sqrt(1.0 + x * x))
    return value


@law(TO_STEP)
def _step_level(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        b[LEVEL + j] += p[j] * past((b[MIDDLE + j] - p[LANES + j]) / p[2 * LANES + j])


LEVEL_STEP = Effect(
    name="level_step",
    parameters=(
        Parameter("step", "N", (-1e3, 1e3), (-1e6, 1e6), absent=0.0, about="dF"),
        Parameter("place", "m", (-10.0, 10.0), (-1e9, 1e9), about="y_0"),
        Parameter("length", "m", (1e-4, 1.0), (1e-9, 1e6), about="of the transition"),
    ),
    laws=(_step_level,),
    source="dry friction that is another past a joint of the rail: preload, alignment",
)


@law(TO_STEP)
def _carry_on(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        b[FORCE + j] += p[j] * past((b[MIDDLE + j] - p[LANES + j]) / p[2 * LANES + j])


PICKED_UP = Effect(
    name="picked_up_weight",
    parameters=(
        Parameter("force", "N", (-1e3, 1e3), (-1e6, 1e6), absent=0.0, about="A"),
        *LEVEL_STEP.parameters[1:],
    ),
    laws=(_carry_on,),
    source="a weight, a chain or a gas spring that is carried along beyond one place",
)


@law(TO_STEP)
def _drag_in_zone(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        away = (b[MIDDLE + j] - p[LANES + j]) / p[2 * LANES + j]
        more = p[j] * exp_neg(away * away)
        b[VISCOUS_FORWARD + j] += more
        b[VISCOUS_BACKWARD + j] += more


VISCOUS_ZONE = Effect(
    name="viscous_zone",
    parameters=(
        Parameter("coefficient", "N*s/m", (-1e5, 1e5), (-1e9, 1e9), absent=0.0, about="B"),
        Parameter("centre", "m", (-10.0, 10.0), (-1e9, 1e9), about="y_0"),
        Parameter("width", "m", (1e-3, 1.0), (1e-9, 1e6), about="w"),
    ),
    laws=(_drag_in_zone,),
    source="viscous friction in one place: old grease, an oil sump, swarf",
)


@law(TO_STEP)
def _push_in_place(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        away = (b[MIDDLE + j] - p[LANES + j]) / p[2 * LANES + j]
        b[FORCE + j] += p[j] * exp_neg(away * away)


LATCH = Effect(
    name="push_in_place",
    parameters=(
        PICKED_UP.parameters[0],
        *VISCOUS_ZONE.parameters[1:],
    ),
    laws=(_push_in_place,),
    source="a push one way, in both directions of motion, near one place: a latch, a brush, a magnet",
)


@njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)
def _in_sector(turns: float, angle: float, sharpness: float) -> float:
    """1 in the middle of a sector of each turn, at `angle` [rad], and less away from it."""
    value: float = exp_neg(sharpness * (1.0 - cos_turns(turns - TURN * angle)))
    return value


@law(TO_STEP)
def _push_in_sector(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        b[FORCE + j] += p[j] * _in_sector(b[MIDDLE + j] / p[3 * LANES + j], p[LANES + j], p[2 * LANES + j])


@law(TO_STEP)
def _rub_in_sector(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        b[LEVEL + j] += p[j] * _in_sector(b[MIDDLE + j] / p[3 * LANES + j], p[LANES + j], p[2 * LANES + j])


_SECTOR = (
    Parameter("force", "N", (-1e3, 1e3), (-1e6, 1e6), absent=0.0, about="A"),
    Parameter("angle", "rad", (-math.pi, 3 * math.pi), about="of its middle, from where the position is 0"),
    Parameter("sharpness", "1", (0.5, 200.0), (1e-6, 1e6), about="of A exp(-k (1 - cos(angle)))"),
    Parameter("period", "m", (1e-4, 10.0), (1e-9, 1e9), reported=False, about="travel of a turn"),
)
NOTCH = Effect(
    name="sector_push",
    parameters=_SECTOR,
    laws=(_push_in_sector,),
    source="a notch, a splice, a bent tooth: a push in one sector of each turn",
)
RUB = Effect(
    name="sector_rub",
    parameters=_SECTOR,
    laws=(_rub_in_sector,),
    source="a damaged bearing sector, a wheel that rubs: dry friction in one sector of each turn",
)


@law(TO_DRIVE)
def _weaken_in_sector(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        inside = _in_sector(b[MOTOR_MIDDLE + j] / p[3 * LANES + j], p[LANES + j], p[2 * LANES + j])
        b[DRIVE + j] *= 1.0 - p[j] * inside


WEAK = Effect(
    name="sector_loss",
    parameters=(Parameter("relative_loss", "1", (-0.9, 0.9), absent=0.0, about="κ"), *_SECTOR[1:]),
    laws=(_weaken_in_sector,),
    order=20,
    source="a demagnetised pole, a burnt winding: torque that is lost in one sector of each turn of the motor",
)


@law(TO_STAGE)
def _open(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        onset = p[LANES + j]
        way = p[2 * LANES + j]
        speed = way * b[VELOCITY + j] if way != 0.0 else abs(b[VELOCITY + j])
        b[STAGE_LEVEL + j] += p[j] * past((speed - onset) / (OPENS * onset))


VALVE = Effect(
    name="one_way_drag",
    parameters=(
        Parameter("force", "N", (-1e3, 1e3), (-1e6, 1e6), absent=0.0, about="A"),
        Parameter("onset", "m/s", (1e-3, 10.0), (1e-9, 1e6), about="v_0"),
        Parameter("direction", "1", (-1.0, 1.0), about="+1 while the position grows"),
    ),
    laws=(_open,),
    source="drag above some speed in one direction of motion: a valve, a check flap, a lip that lifts",
)
LIFT = Effect(
    name="level_above_speed",
    parameters=VALVE.parameters,
    laws=(_open,),
    source="dry friction that is another above some speed, both ways: a carriage that floats, a guard that hums",
)


@law(TO_STEP)
def _snap(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        away = (b[MIDDLE + j] - p[LANES + j]) / p[2 * LANES + j]
        b[FORCE + j] += p[j] * away * exp_neg(0.5 * away * away - 0.5)


DETENT = Effect(
    name="detent",
    parameters=(
        Parameter("force", "N", (-1e3, 1e3), (-1e9, 1e9), absent=0.0, about="A, the largest"),
        Parameter("centre", "m", (-10.0, 10.0), (-1e9, 1e9), about="y_0"),
        Parameter("width", "m", (1e-4, 1.0), (1e-9, 1e6), about="w: from it to the largest pull"),
    ),
    laws=(_snap,),
    source="a pull to one place from both sides, or away from it: a magnet, a ball in a notch, a dip of the guide",
)


@law(TO_STAGE)
def _hum(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        away = (abs(b[VELOCITY + j]) - p[LANES + j]) / p[2 * LANES + j]
        b[STAGE_LEVEL + j] += p[j] * exp_neg(0.5 * away * away)


HUM = Effect(
    name="level_in_band",
    parameters=(
        Parameter("force", "N", (-1e3, 1e3), (-1e9, 1e9), absent=0.0, about="A"),
        Parameter("centre", "m/s", (1e-3, 10.0), (1e-9, 1e6), about="v_0"),
        Parameter("width", "m/s", (1e-4, 1.0), (1e-9, 1e6), about="w"),
    ),
    laws=(_hum,),
    source="dry friction that is another in a band of speeds: a cover, a seal or a gear in resonance",
)


@law(TO_STAGE)
def _govern(t: float, h: float, p: Rows, x: Rows, b: Rows) -> None:  # noqa: ARG001
    for j in range(LANES):
        onset = p[LANES + j]
        beyond = abs(b[VELOCITY + j]) - onset
        blunt = BLUNT * onset
        b[STAGE_LEVEL + j] += 0.5 * p[j] * (beyond + math.sqrt(beyond * beyond + blunt * blunt))


GOVERNOR = Effect(
    name="drag_above_speed",
    parameters=(
        Parameter("coefficient", "N*s/m", (-1e5, 1e5), (-1e9, 1e9), absent=0.0, about="c"),
        VALVE.parameters[1],
    ),
    laws=(_govern,),
    source="a drag that begins above some speed: a centrifugal brake, a fan that couples, oil that is thrown",
)
EFFECTS = (LEVEL_STEP, PICKED_UP, LATCH, VISCOUS_ZONE, NOTCH, RUB, WEAK, VALVE, LIFT, DETENT, HUM, GOVERNOR)


def placed(s: Setting) -> list[Guise]:
    """Every way in which physics that acts in part of its coordinate is tried in recordings of this setting."""
    across = (s.lowest + s.travel * np.linspace(0.08, 0.92, 8)).tolist()
    place = Unknown("place", 0.02 * s.travel, s.lowest, s.highest, origin=s.middle, spread=PLACED_SPREAD)
    length = Unknown("length", 0.02 * s.travel, 1e-3 * s.travel, 0.3 * s.travel, log=True, spread=1.5)
    width = Unknown("width", 0.1 * s.travel, 0.01 * s.travel, 0.5 * s.travel, log=True, spread=1.0)
    step = Unknown("step", 0.3 * s.force, -5.0 * s.force, 5.0 * s.force)
    unit = s.force / s.speed
    zone = Unknown("coefficient", 0.3 * unit, -30.0 * unit, 30.0 * unit)
    centre = dataclasses.replace(place, parameter="centre")
    widths = [share * s.travel for share in (0.03, 0.1, 0.25)]
    found = [
        Guise(LEVEL_STEP, (step, place, length), grid([0.1 * s.force], across, [0.01 * s.travel]), depends="position"),
        Guise(VISCOUS_ZONE, (zone, centre, width), grid([0.1 * unit], across, widths), depends="position"),
    ]
    force = Unknown("force", 0.3 * s.force, -5.0 * s.force, 5.0 * s.force)
    steps = grid([0.1 * s.force], across, [0.01 * s.travel])
    found.append(Guise(PICKED_UP, (force, place, length), steps, depends="position"))
    pushes = grid([0.1 * s.force], across, widths)
    found += [Guise(effect, (force, centre, width), pushes, depends="position") for effect in (LATCH, DETENT)]
    wheels = {"motor_angle": s.axis.mechanics.Rm, "pulley_angle": s.axis.mechanics.Rc}
    if math.isclose(*wheels.values()):
        del wheels["motor_angle"]
    angle = Unknown("angle", 0.2, -math.pi, 3 * math.pi, origin=math.pi, spread=PLACED_SPREAD)
    sharp = Unknown("sharpness", 10.0, 1.5, 200.0, log=True, spread=1.5)
    angles = (2.0 * math.pi * (np.arange(8) + 0.5) / 8.0).tolist()
    for coordinate, radius in wheels.items():
        turn = 2.0 * math.pi * radius
        if s.travel > TURNS * turn:
            starts = grid([0.1 * s.force], angles, [10.0])
            found += [
                Guise(effect, (force, angle, sharp), starts, fixed=(("period", turn),), depends=coordinate)
                for effect in (NOTCH, RUB)
            ]
    turn = 2.0 * math.pi * s.axis.mechanics.Rm
    if s.travel > TURNS * turn:
        loss = Unknown("relative_loss", 0.1, -0.9, 0.9)
        starts = grid([0.05], angles, [10.0])
        found.append(Guise(WEAK, (loss, angle, sharp), starts, fixed=(("period", turn),), depends="motor_angle"))
    onset = Unknown("onset", s.speed, 0.05 * s.speed, 10.0 * s.speed, log=True, spread=1.5)
    onsets = [share * s.speed for share in (0.3, 0.7, 1.2)]
    opening = grid([0.1 * s.force], onsets)
    ways = [Guise(VALVE, (force, onset), opening, fixed=(("direction", way),), depends="velocity") for way in SIDES]
    fast = dataclasses.replace(onset, low=FLAT * s.speed, spread=PLACED_SPREAD)
    onsets = (np.geomspace(0.2, 1.05, 12) * s.speed).tolist()
    lift = Guise(LIFT, (force, fast), grid([0.1 * s.force], onsets), fixed=(("direction", 0.0),), depends="velocity")
    middle = dataclasses.replace(fast, parameter="centre")
    band = Unknown("width", 0.05 * s.speed, 0.01 * s.speed, BAND * s.speed, log=True, spread=1.0)
    bands = grid([0.1 * s.force], onsets, [0.05 * s.speed])
    hum = Guise(HUM, (force, middle, band), bands, depends="velocity")
    begins = dataclasses.replace(onset, low=BRAKES[0] * s.speed, high=BRAKES[1] * s.speed, spread=PLACED_SPREAD)
    onsets = (np.linspace(*BRAKES, 5)[1:-1] * s.speed).tolist()
    governor = Guise(GOVERNOR, (zone, begins), grid([0.1 * unit], onsets), depends="velocity")
    return [*found, *ways, lift, hum, governor]


def interval(name: str, values: dict[str, float], reached: tuple[float, float], constant: float) -> tuple[float, float]:
    """Where on its coordinate, of which the recordings `reached` so much, this physics acts.

    A weight is where the `constant` force [N] beside it is not nearer to none than that with it.
    """
    low, high = reached
    if name == LEVEL_STEP.name:
        return min(values["place"], high), high
    if name == PICKED_UP.name and abs(constant + values["force"]) < abs(constant):
        return low, max(values["place"], low)
    if name == PICKED_UP.name:
        return min(values["place"], high), high
    if name in {VISCOUS_ZONE.name, LATCH.name, DETENT.name, HUM.name}:
        half = (SNAPS if name == DETENT.name else WIDE) * values["width"]
        return max(values["centre"] - half, low), min(values["centre"] + half, high)
    if name in {LIFT.name, GOVERNOR.name}:
        return min(values["onset"], high), max(high, -low)
    if name == VALVE.name:
        onset = min(values["onset"], max(abs(low), abs(high)))
        return (onset, max(high, onset)) if values["direction"] > 0.0 else (min(low, -onset), -onset)
    half = WIDE * math.sqrt(2.0 / values["sharpness"])
    middle = values["angle"] % (2.0 * math.pi)
    return middle - half, middle + half
