"""Where effects with a memory may be present: bristles, gaps, springs, rests, warmth, one moment."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from identify.mismatch.guise import STIFF, Guise, Setting, Unknown, grid
from plant.effects.backlash import CONTACT_DAMPING_RATIO, CONTACT_RATE
from plant.effects.effect import Effect, Parameter, Surroundings

if TYPE_CHECKING:
    from plant.machine import Machine

Floats = NDArray[np.float64]

LIGHT = 3.0  # kg on a spring: lighter ones swing as fast on a softer one
STIFF_BELT, FASTEST = 1e6, 150.0  # N/m, Hz: what is stiffer swings no faster
SWINGS = 4.6, 9.2, 18.4, 36.8, 73.5, 147.0  # Hz: where the search for a transmission begins
DAMPED_SO = 0.045  # of the critical damping, there
GIVES = 0.3  # of the gap: flanks that give more are a soft transmission
FINER = 1.22  # ratio of one start of a gap to the next: one of another size is no start, what it does is not linear
NARROWEST, WIDEST = 3e-5, 9e-3  # m: starts between which every machine is asked
WIDE = 0.1  # of the travel: gaps of large machines may be wider
SLIP = 0.015  # of the recorded travel: so much of it may a contact take to break on a large machine
NARROW = 4e-5  # m: a gap no wider than this is none, friction itself gives as much

PARTED = 0.3  # of the inertia, at the motor, where nobody says
RUBS, RUBS_MUCH = 0.05, 0.4  # of the friction, at the motor: where the search begins
RUBBING = Parameter("motor_friction", "1", (0.0, 1.0), default=0.0, about="share of the friction", reported=False)
MOTOR_RUBS = Unknown("motor_friction", 0.1, 0.0, 0.6)


def bristles(e: Effect, s: Setting) -> list[Guise]:
    """Soft to hard, damped near critically; on harder ones the mass swings faster than half the sample rate."""
    soft, unit = max(1e3 * s.spring, s.force / (0.25 * s.travel)), 1e5 * s.spring
    hard = min(1e7 * s.spring, _stiffest(s, s.mass), s.force / (STIFF * s.metre))
    damping = max(0.6 * math.sqrt(unit * s.mass), 1e-9)
    unknowns = (
        Unknown("bristle_stiffness", unit, soft, hard, log=True),
        Unknown("bristle_damping", damping, 1e-3 * damping, 1e2 * damping, log=True, spread=1.5),
    )
    ways = [share * unit for share in (0.02, 0.06, 0.2, 0.6, 2.0, 6.0, 30.0)]
    rows = [(k, 0.6 * math.sqrt(k * s.mass)) for k in ways if soft < k < hard]
    return [Guise(e, unknowns, np.array(rows), stiff=True)] if rows else []


def backlash(e: Effect, s: Setting) -> list[Guise]:
    """A gap, where there are two masses; how fast they swing while its flanks touch is fitted beside it.

    Teeth, keys and couplings give a little. How much is no finding, but a hard contact imitates nothing that is soft,
    and leaves a spring or a delay to be named beside the gap. Where a weight keeps the flanks together, none is seen.
    """
    if _motor_share(s) is None or not s.reverses:
        return []
    widest = max(WIDEST, WIDE * s.travel)
    unknowns = (
        Unknown("gap", 3e-4, 1e-5, widest / 0.9, log=True),
        Unknown("contact_rate", 600.0, 100.0, CONTACT_RATE, log=True, spread=1.0),
        Unknown("contact_damping", 0.3, 0.02, 3.0, log=True, spread=1.0),
        MOTOR_RUBS,
    )
    count = math.ceil(math.log(widest / NARROWEST, FINER)) + 1
    widths = np.geomspace(NARROWEST, widest, count).tolist()
    ways = ([350.0, 600.0, 1500.0], RUBS), ([600.0], RUBS_MUCH)
    starts = np.concatenate([grid(widths, rates, [0.3], [rubs]) for rates, rubs in ways])
    return [_parted(Guise(soft_gap(e, s.peak), unknowns, starts, stiff=True, rugged=True, least=NARROW), s)]


def soft_gap(effect: Effect, most: float) -> Effect:
    """`effect`, a gap, with flanks that give under the force `most` [N], by a share of it; a belt takes their place."""

    def prepare(values: Floats, machine: Machine) -> Floats:
        belt = machine.stiffness != 0.0
        effect.prepare(values, machine)
        mass = machine.reduced_mass()
        stiffness = np.maximum(mass * values[1] ** 2, most / (GIVES * values[0]))
        machine.stiffness = np.where(belt, machine.stiffness, stiffness)
        machine.damping = np.where(belt, machine.damping, 2.0 * values[2] * np.sqrt(mass * stiffness))
        machine.motor_share = np.where(belt, machine.motor_share, values[3])
        return values[:0]

    any_size = (0.0, math.inf)
    rate = Parameter("contact_rate", "rad/s", any_size, default=CONTACT_RATE, reported=False)
    damping = Parameter("contact_damping", "1", any_size, default=CONTACT_DAMPING_RATIO, reported=False)
    return dataclasses.replace(effect, parameters=(*effect.parameters, rate, damping, RUBBING), prepare=prepare)


def compliance(e: Effect, s: Setting) -> list[Guise]:
    """A spring and its damping, where there are two masses that swing slower than half the sample rate."""
    motor = _motor_share(s)
    if motor is None:
        return []
    swings = motor * (1.0 - motor) * s.mass
    light = min(1.0, swings / LIGHT)
    stiffest = min(max(STIFF_BELT, (2.0 * math.pi * FASTEST) ** 2 * swings), _stiffest(s, swings))
    unknowns = (
        Unknown("stiffness", 3e4 * light, 1e3 * light, stiffest, log=True),
        Unknown(
            "damping", 30.0 * light, 0.3 * light, max(1e4, 2.0 * math.sqrt(stiffest * swings)), log=True, spread=2.0
        ),
    )
    rates = 2.0 * math.pi * np.array(SWINGS)
    stiff = swings * rates**2
    rows = np.column_stack([stiff, 2.0 * DAMPED_SO * swings * rates])[stiff < stiffest]
    if not len(rows):
        return []
    usual = _parted(Guise(e, unknowns, rows, stiff=True, swings=swings), s)
    return [_let_go(usual) if s.axis.mechanics.weight != 0.0 else usual]


def _let_go(guise: Guise) -> Guise:
    """A transmission that a weight hangs on; it need not hang at rest where a recording begins."""
    effect = guise.effect

    def prepare(values: Floats, machine: Machine) -> Floats:
        machine.bent, machine.hangs = np.zeros_like(values[2]), values[2]
        return effect.prepare(values, machine)

    hangs = Parameter("hangs", "1", (0.0, 1.0), default=1.0, about="share of the weight that bends it", reported=False)
    hanging = dataclasses.replace(effect, parameters=(*effect.parameters, hangs), prepare=prepare)
    unknowns = (*guise.unknowns, Unknown("hangs", 0.5, -0.5, 1.5, origin=1.0))
    starts = np.concatenate([np.insert(guise.starts, 2, share, axis=1) for share in (1.0, 0.0)])
    return dataclasses.replace(guise, effect=hanging, unknowns=unknowns, starts=starts)


def _motor_share(s: Setting) -> float | None:
    """Share of the inertia on the motor side, `PARTED` where a rotary axis does not tell; None: all is on one side."""
    share = Surroundings.of(s.axis).motor_share
    return PARTED if share is None and s.axis.is_rotary else share


def _parted(guise: Guise, s: Setting) -> Guise:
    """Two masses of which an axis file gives the sum (rotary: J carries it all); their shares are fitted beside them.

    The load answers the drive as the reduced mass on the spring says, and inside a gap as the motor's inertia does: of
    stiffness or width and this share the data tell little more than a product, and the intervals are as wide.
    """
    if Surroundings.of(s.axis).motor_share is not None:
        return guise
    effect, at = guise.effect, len(guise.effect.parameters)

    def prepare(values: Floats, machine: Machine) -> Floats:
        machine.part(values[at])
        return effect.prepare(values, machine)

    share = Parameter("motor_inertia", "1", (0.0, 1.0), default=PARTED, about="share of the inertia", reported=False)
    parted = dataclasses.replace(effect, parameters=(*effect.parameters, share), prepare=prepare)
    unknowns = (*guise.unknowns, Unknown("motor_inertia", 0.2, 0.03, 0.97, origin=PARTED, spread=1.0))
    starts = np.insert(guise.starts, guise.starts.shape[1], PARTED, axis=1)
    return dataclasses.replace(guise, effect=parted, unknowns=unknowns, starts=starts)


def _stiffest(s: Setting, mass: float) -> float:
    """Spring on which `mass` [kg] swings at half the sample rate. [N/m]."""
    return (math.pi / s.sample_time) ** 2 * mass


def dwell(e: Effect, s: Setting) -> list[Guise]:
    """A rise of the static force, where there are rests; how long the axis rested before nobody knows.

    Nor whether it falls with speed, as the rest of F_s does, or only with slip.
    """
    if s.rests < 0.1:
        return []
    unknowns = (
        Unknown("stiction_rise", 0.1 * s.force, 0.0, 2 * s.force),
        Unknown("time_constant", 1.0, 0.01, 100.0, log=True, spread=1.5),
        Unknown("age", 1.0, 0.0, 1.0),
        Unknown("slip", 5e-4 * s.metre, 2e-5 * s.metre, max(5e-3 * s.metre, SLIP * s.travel), log=True, spread=0.7),
    )
    starts = grid([0.5 * s.force], [0.1, 0.5, 3.0], [0.5], [5e-4 * s.metre])
    return [Guise(e, unknowns, starts, (("level_share", share),)) for share in (0.0, 1.0)]


def thermal(e: Effect, s: Setting) -> list[Guise]:
    """Viscous friction that falls with time."""
    unknowns = (
        Unknown("relative_drop", 0.3, -0.9, 5.0),
        Unknown("time_constant", s.duration, min(1.0, 0.1 * s.duration), 3600.0, log=True, spread=2.0),
    )
    return [Guise(e, unknowns, grid([0.1], [0.15 * s.duration, 0.5 * s.duration, 2.0 * s.duration]))]


def step(e: Effect, s: Setting) -> list[Guise]:
    """Dry friction from one moment on, at 24 moments; the static friction stays, or changes as much."""
    unknowns = (
        Unknown("step", 0.1 * s.force, -2 * s.force, 2 * s.force),
        Unknown("time", 0.03 * s.duration, 0.0, s.duration, spread=100.0),
    )
    times = np.linspace(0.0, s.duration, 26)[1:-1]
    starts = grid([0.05 * s.force], list(times))
    return [Guise(e, unknowns, starts, (("static_share", share),)) for share in (0.0, 1.0)]
