"""A machine with effects, ready to march: constants of eq. (5), laws, and the block that the kernel reads.

One `Plan` per set of effects, many candidates: simulator, closed loop, predictor and diagnosis all start here.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from plant.effects import EffectValues, find_all
from plant.effects.effect import Effect, Surroundings
from plant.errors import InputError
from plant.kernels import laws as row
from plant.kernels.laws import LANES, ROWS
from plant.kernels.machine import BENT_CURVE, HALF, SWITCHED, TWO_MASSES, WITH_BRISTLES, WITH_GAPS, YIELDING, run
from plant.kernels.shift import delay_pieces

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

STEP_PER_TIME_CONSTANT = 0.1  # sub-step over the shortest time constant; 2 or 3 sub-steps in the paper's case
FORGIVEN_PER_TIME_CONSTANT = 0.3  # the same where only one-step errors count
LONGEST_FINE_STEP = 2.5e-4  # s; two masses and bristles
MOST_SUBSTEPS = 1024  # per sample: beyond it a run does not converge, it is chaotic
TYPICAL_SPEED = 0.5  # m/s or rad/s, where none is given


@dataclass(slots=True)
class Machine:
    """m candidates in the making; `Effect.prepare` may change every field.

    Attributes:
        surroundings: what does not depend on the candidate.
        friction: rows F_c, F_s [N], v_s [m/s], F_v [N·s/m]. (4, m)
        mass: m_e. [kg] (m,)
        against: M g + constant force. [N] (m,)
        exponent: of |v|/v_s in eq. (1). [1] (m,)
        motor_mass: motor's part of `mass`; 0 while rigid. [kg] (m,)
        stiffness, damping, half_gap: of the transmission. [N/m], [N·s/m], [m] (m,)
        motor_share: of the friction, that rubs at the motor. [1] (m,)
        bent, hangs: shares of the drive force, and of M g + constant force, that bend the transmission where a
            predicted run begins. [1] (m,)
        hardening: c of a transmission whose stiffness is k (1 + c x²), stretched by x. [1/m²] (m,)
        bristle_stiffness, bristle_damping: LuGre. [N/m], [N·s/m] (m,)
        bristle_power: by how much more than 1 the power is with which bristles yield; 0 of LuGre. [1] (m,)
        delay: dead time of the input. [s] (m,)
        two_masses, bristles: structure.
    """

    surroundings: Surroundings
    friction: Floats
    mass: Floats
    against: Floats
    exponent: Floats = field(init=False)
    motor_mass: Floats = field(init=False)
    stiffness: Floats = field(init=False)
    damping: Floats = field(init=False)
    half_gap: Floats = field(init=False)
    motor_share: Floats = field(init=False)
    bent: Floats = field(init=False)
    hangs: Floats = field(init=False)
    hardening: Floats = field(init=False)
    bristle_stiffness: Floats = field(init=False)
    bristle_damping: Floats = field(init=False)
    bristle_power: Floats = field(init=False)
    delay: Floats = field(init=False)
    two_masses: bool = False
    bristles: bool = False

    def __post_init__(self) -> None:
        """Start rigid and without delay; effects replace these arrays, they do not write into them."""
        none = np.zeros(len(self.mass))
        none.flags.writeable = False
        self.bent = self.exponent = np.ones(len(self.mass))
        self.motor_mass = self.stiffness = self.damping = self.half_gap = self.hardening = none
        self.bristle_stiffness = self.bristle_damping = self.bristle_power = none
        self.delay = self.motor_share = self.hangs = none

    def split(self, effect: str) -> None:
        """Put the motor's inertia on its own side of the transmission, unless it is there; `effect` asks for it."""
        if not self.two_masses:
            self.part(self.surroundings.need_two_masses(effect))

    def part(self, share: Floats | float) -> None:
        """Put a `share` of the mass on the motor's side of the transmission, unless another effect has. [1]"""
        if not self.two_masses:
            self.two_masses, self.motor_mass = True, share * self.mass

    def reduced_mass(self) -> Floats:
        """Mass that oscillates between the two sides. [kg] (m,)"""
        reduced: Floats = self.motor_mass * (self.mass - self.motor_mass) / self.mass
        return reduced


@dataclass(frozen=True, slots=True, eq=False)
class Blocks:
    """m candidates as the kernel wants them. Addresses in `laws` belong to this process: do not send to another.

    Attributes:
        b: one block per `LANES` candidates; the last is filled up with copies. (ceil(m / LANES), rows * LANES)
        laws: phase, address, offset of parameters, offset of states. (l, 4)
        structure: for the kernel.
        observed: offset of the measured position, `POSITION` or `MOTOR_POSITION`; the speed is in the row after it
            where two masses are measured at the motor, else in row `SPEED`.
        delay: dead time of each candidate. [s] (m,)
        rate: fastest rate of each candidate. [1/s] (m,)
        added: fastest rate of its effects alone. [1/s] (m,)
    """

    b: Floats
    laws: Ints
    structure: int
    observed: int
    delay: Floats
    rate: Floats
    added: Floats

    @property
    def speed(self) -> int:
        """Offset of the measured position's speed."""
        return row.MOTOR_SPEED if self.observed == row.MOTOR_POSITION else row.SPEED

    @property
    def remembers(self) -> bool:
        """Whether there is more than position and speed: a second mass, bristles, a force under way."""
        return bool(self.structure & (TWO_MASSES | WITH_BRISTLES | SWITCHED))

    def put(self, offset: int, values: Floats | float) -> None:
        """Set one row, e.g. `laws.EXTRA`, to one value per candidate, (m,), or one for all."""
        self.b[:, offset : offset + LANES] = _lanes(np.broadcast_to(values, self.delay.shape), len(self.b))

    def get(self, offset: int) -> Floats:
        """Read one row. (m,)"""
        return self.b[:, offset : offset + LANES].reshape(-1)[: len(self.delay)].copy()

    def place(self, position: Floats | float, velocity: Floats | float, force: float) -> None:
        """Put the measured side at `position` [m], `velocity` [m/s]; the transmission carries `force` [N] at once."""
        self.put(row.POSITION, position)
        self.put(row.SPEED, velocity)
        if self.structure & TWO_MASSES:
            carried = force / self.get(row.STIFFNESS) + math.copysign(1.0, force) * self.get(row.HALF_GAP)
            shift = carried if self.observed == row.POSITION else -carried
            other = row.MOTOR_POSITION if self.observed == row.POSITION else row.POSITION
            self.put(row.MOTOR_POSITION, position)
            self.put(row.MOTOR_SPEED, velocity)
            self.put(other, position + shift)

    def substeps(self, longest: float) -> int:
        """Sub-steps for samples of at most `longest` seconds: a fraction of the shortest time constant.

        The midpoint step errs by the square of sub-step over time constant. Of many candidates the stiffest tenth does
        not count: a genetic search would pay for candidates it is about to throw away.
        """
        return max(2, self._substeps(longest, self.rate, STEP_PER_TIME_CONSTANT))

    def substeps_for_effects(self, longest: float) -> int:
        """The same for one-step errors, and for effects alone: how eq. (1) passes rest, an observer forgives."""
        return self._substeps(longest, self.added, FORGIVEN_PER_TIME_CONSTANT)

    def _substeps(self, longest: float, rate: Floats, share: float) -> int:
        step = share / max(float(np.sort(rate)[int(0.9 * (len(rate) - 1))]), 1e-9)
        if self.structure & (TWO_MASSES | WITH_BRISTLES):
            step = min(step, LONGEST_FINE_STEP)
        return int(np.clip(math.ceil(longest / step * (1.0 - 1e-9)), 1, MOST_SUBSTEPS))


@dataclass(frozen=True, slots=True)
class Plan:
    """A set of effects in known surroundings: from numbers to blocks.

    Attributes:
        surroundings: what does not depend on the candidate.
        effects: in the order in which their laws run.
    """

    surroundings: Surroundings
    effects: tuple[Effect, ...] = ()

    @property
    def parameters(self) -> tuple[tuple[str, str], ...]:
        """(effect, parameter) for each row of `values`, nuisances included."""
        return tuple((effect.name, p.name) for effect in self.effects for p in effect.parameters)

    def blocks(
        self,
        friction: Floats,
        values: Floats,
        *,
        mass: Floats | float | None = None,
        constant_force: Floats | float = 0.0,
        speed: float = TYPICAL_SPEED,
    ) -> Blocks:
        """Lay out m candidates; values are trusted (`Effect.values` checks them).

        Args:
            friction: rows F_c, F_s [N], v_s [m/s], F_v [N·s/m]. (4, m)
            values: one row per entry of `parameters`. (p, m)
            mass: m_e; None takes M + J/R_c². [kg] (m,)
            constant_force: on the friction side. [N] (m,)
            speed: typical speed, for the sub-steps. [m/s]
        """
        mechanics = self.surroundings.mechanics
        m = friction.shape[1]
        full = np.zeros(m)
        masses = full + (mechanics.moving_mass if mass is None else mass)
        machine = Machine(self.surroundings, friction, masses, mechanics.weight + constant_force + full)
        rate = np.maximum(abs(friction[1] - friction[0]) / friction[2], friction[3]) / masses
        added = full
        states: list[float] = []
        rows: list[Floats] = []
        table: list[tuple[int, int, int, int]] = []
        at = 0
        for effect in self.effects:
            mine, at = values[at : at + len(effect.parameters)], at + len(effect.parameters)
            if effect.vanishes(mine):
                continue
            first_row = sum(map(len, rows))
            rows.append(effect.prepare(mine, machine))
            added = np.maximum(added, effect.rate(mine, machine, speed))
            table += [(law.phase, law.address, first_row, len(states)) for law in effect.laws]
            states += effect.initial
        count, base = -(-m // LANES), ROWS + len(states)
        layout = np.zeros((base + sum(map(len, rows)), count * LANES))
        for offset, row_values in _constants(machine).items():
            layout[offset // LANES, :m] = row_values
        layout[row.SWITCH // LANES] = 1.0
        layout[ROWS:base, :m] = np.array(states)[:, np.newaxis]
        if rows:
            np.concatenate(rows, out=layout[base:, :m])
        layout[:, m:] = layout[:, m - 1 : m]
        b = layout.reshape(-1, count, LANES).transpose(1, 0, 2).reshape(count, -1).copy()
        laws = [(phase, address, (base + p) * LANES, (ROWS + x) * LANES) for phase, address, p, x in table]
        at_motor = machine.two_masses and self.surroundings.sensor_at_motor
        structure = TWO_MASSES * machine.two_masses + WITH_BRISTLES * machine.bristles
        structure += SWITCHED * bool(machine.delay.any()) + WITH_GAPS * bool((machine.half_gap > 0.0).any())
        structure += YIELDING * bool(machine.bristle_power.any())
        structure += BENT_CURVE * bool((machine.exponent != 1.0).any()) + LANES
        observed = row.MOTOR_POSITION if at_motor else row.POSITION
        fastest = np.maximum(rate, added)
        return Blocks(b, np.array(laws, np.int64).reshape(-1, 4), structure, observed, machine.delay, fastest, added)


def for_lanes(structure: int, count: int) -> int:
    """`structure` where only the first `count` lanes of a block are of interest."""
    return structure if count > HALF else structure - (LANES - HALF)


def plan(surroundings: Surroundings, names: tuple[str, ...]) -> Plan:
    """The plan for the effects called `names`.

    Raises:
        InputError: a name that is not known, or that occurs twice.
    """
    if len(set(names)) != len(names):
        raise InputError(f"an effect is named twice: {', '.join(names)}")
    return Plan(surroundings, find_all(names))


def checked_values(plan: Plan, effects: EffectValues) -> Floats:
    """Values in the order of `Plan.parameters`, defaults filled in, each checked. (p, 1)."""
    given: Mapping[str, Mapping[str, float]] = effects
    mechanics = plan.surroundings.mechanics
    numbers = [value for effect in plan.effects for value in effect.values(given[effect.name], mechanics)]
    return np.array(numbers, dtype=np.float64).reshape(-1, 1)


def march(blocks: Blocks, t: Floats, start: Floats, end: Floats, substeps: int) -> Floats:
    """March all candidates from where `Blocks.place` put them; leaves them at the last sample.

    Args:
        blocks: the machines.
        t: time stamps since the start of the recording. [s] (n,)
        start: drive force just after each sample. [N] (n - 1,)
        end: drive force just before the next. [N] (n - 1,)
        substeps: per sample, >= 1.

    Returns:
        Measured position [m], its velocity [m/s], friction force [N]: shape (3, n, m).
    """
    count, m = len(blocks.b), len(blocks.delay)
    out = np.empty((count, len(t), 3, LANES))
    for i, delays in enumerate(_lanes(blocks.delay, count)):
        force = drive_forces(t, start, end, delays)
        run(blocks.b[i], blocks.laws, blocks.structure, t, force, substeps, blocks.observed, out[i])
    return out.transpose(2, 1, 0, 3).reshape(3, len(t), count * LANES)[:, :, :m]


def drive_forces(t: Floats, start: Floats, end: Floats, delays: Floats) -> Floats:
    """Drive force as `kernels.machine.load` takes it: (n - 1, 2, 1) without dead times, else (n - 1, 5, lanes)."""
    if not delays.any():
        return np.ascontiguousarray(np.stack([start, end], axis=1)[:, :, np.newaxis])
    force = np.empty((len(start), 5, len(delays)))
    delay_pieces(t, np.ascontiguousarray(start), np.ascontiguousarray(end), delays, force)
    return force


def _constants(machine: Machine) -> dict[int, Floats]:
    coulomb, static, stribeck, viscous = machine.friction
    return {
        row.COULOMB: coulomb,
        row.BUMP: static - coulomb,
        row.INVERSE_STRIBECK: 1.0 / stribeck,
        row.EXPONENT: machine.exponent,
        row.VISCOUS: viscous,
        row.MASS: machine.mass - machine.motor_mass,
        row.AGAINST: machine.against,
        row.MOTOR_MASS: machine.motor_mass,
        row.STIFFNESS: machine.stiffness,
        row.DAMPING: machine.damping,
        row.HALF_GAP: machine.half_gap,
        row.MOTOR_SHARE: machine.motor_share,
        row.BENT: machine.bent,
        row.HANGS: machine.hangs,
        row.HARDENING: machine.hardening,
        row.BRISTLE_STIFFNESS: machine.bristle_stiffness,
        row.BRISTLE_DAMPING: machine.bristle_damping,
        row.BRISTLE_POWER: machine.bristle_power,
    }


def _lanes(values: Floats, count: int) -> Floats:
    """(m,) -> (count, LANES), filled up with the last candidate. A row of one value fills all."""
    padded = np.empty(count * LANES)
    padded[: len(values)] = values
    padded[len(values) :] = values[-1]
    return padded.reshape(count, LANES)
