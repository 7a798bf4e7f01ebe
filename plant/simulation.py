"""The front door of the simulator: checks its arguments, chooses the sub-steps, and marches the kernel."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plant.axis import Axis, TorqueHold
from plant.effects import EffectValues, Surroundings
from plant.errors import InputError, ParameterError
from plant.friction import StribeckFriction
from plant.kernels.population import march
from plant.machine import MOST_SUBSTEPS, Blocks, checked_values, plan
from plant.machine import march as march_blocks

Floats = NDArray[np.float64]

POSITION_TOLERANCE = 1e-5  # m or rad: a tenth of what a good position sensor resolves over the 20 s of §4.3


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """What the simulated machine did.

    Attributes:
        t: time stamps. [s] (n,)
        position: [m or rad] (n,)
        velocity: [m/s or rad/s] (n,)
        friction_force: friction (dry and viscous) over the sub-step that ends at the sample. [N; N·m rotary] (n,)
        substeps: sub-steps per sample that were taken.
    """

    t: Floats
    position: Floats
    velocity: Floats
    friction_force: Floats
    substeps: int


def simulate(
    axis: Axis,
    friction: StribeckFriction,
    torque: ArrayLike,
    *,
    sample_time: float | None = None,
    t: ArrayLike | None = None,
    hold: TorqueHold = TorqueHold.HOLD,
    effects: EffectValues | None = None,
    constant_force: float = 0.0,
    moving_mass: float | None = None,
    position0: float = 0.0,
    velocity0: float = 0.0,
    middle: float | None = None,
    substeps: int | None = None,
) -> Trajectory:
    """March eq. (5) under `torque` from a given start.

    Args:
        axis: the machine.
        friction: eq. (1).
        torque: motor torque at each sample, times `axis.mechanics.gain` the force at the belt. [N·m] (n,)
        sample_time: equidistant samples; the axis file's when neither it nor `t` is given. [s] > 0
        t: time stamps instead, strictly increasing. [s] (n,)
        hold: what a sample means until the next: held, linear, or the mean of the interval (marched as held).
        effects: named effects on top of the baseline: name -> parameter -> value, as in effects.md.
        constant_force: constant force on the friction side. [N]
        moving_mass: replaces M + J/R_c² [kg; kg·m² rotary] > 0; the weight stays M g.
        position0: position at the first sample. [m or rad]
        velocity0: velocity at the first sample. [m/s or rad/s]
        middle: y_m of position_dependent_friction and end_stop; None takes the middle of the axis' travel. [m or rad]
        substeps: sub-steps per sample; None doubles them until the position is settled to `POSITION_TOLERANCE`.

    Raises:
        InputError: an argument that cannot be used; says which, its value, and what is allowed.
    """
    force = axis.mechanics.gain * _finite("torque", torque, "N*m")
    times = _times(axis, len(force), sample_time, t)
    start, end = _pieces(force, hold)
    wanted = {} if effects is None else effects
    chosen = plan(Surroundings.of(axis, middle), tuple(wanted))
    values = checked_values(chosen, wanted)
    law = _laws(axis, friction.as_array[np.newaxis], constant_force, moving_mass)
    y0, v0 = _number("position0", position0, axis.position_unit), _number("velocity0", velocity0, "m/s")

    def blocks() -> Blocks:
        return chosen.blocks(friction.as_array[:, np.newaxis], values, mass=law[4], constant_force=constant_force)

    def run(count: int) -> Floats:
        fresh = blocks()
        fresh.place(y0, v0, float(force[0]))
        return march_blocks(fresh, times - times[0], start, end, count)[:, :, 0]

    if substeps is not None:
        count = _substeps(substeps)
        out = run(count)
    else:
        count, out = settle(run, blocks().substeps(float(np.diff(times).max(initial=0.0))))
    return Trajectory(times, out[0], out[1], out[2], count)


def simulate_population(
    axis: Axis,
    torque: ArrayLike,
    candidates: ArrayLike,
    *,
    sample_time: float | None = None,
    t: ArrayLike | None = None,
    hold: TorqueHold = TorqueHold.HOLD,
    constant_force: float | ArrayLike = 0.0,
    moving_mass: float | ArrayLike | None = None,
    position0: float | ArrayLike = 0.0,
    velocity0: float | ArrayLike = 0.0,
    substeps: int | None = None,
) -> Floats:
    """March eq. (5) for m candidates of the four-parameter baseline at once.

    Args:
        axis: the machine.
        torque: motor torque at each sample. [N·m] (n,)
        candidates: columns F_c [N], F_s [N], v_s [m/s], F_v [N·s/m]. (m, 4)
        sample_time: as in `simulate`. [s]
        t: as in `simulate`. [s] (n,)
        hold: as in `simulate`.
        constant_force: one for all, or one each. [N] (m,)
        moving_mass: one for all, or one each; None takes M + J/R_c². [kg; kg·m² rotary] (m,)
        position0: one for all, or one each. [m or rad] (m,)
        velocity0: one for all, or one each. [m/s or rad/s] (m,)
        substeps: sub-steps per sample; None takes the rule of `Blocks.substeps`.

    Returns:
        Positions [m or rad], shape (m, n).

    Raises:
        InputError: an argument that cannot be used; says which, its value, and what is allowed.
    """
    force = axis.mechanics.gain * _finite("torque", torque, "N*m")
    times = _times(axis, len(force), sample_time, t)
    _pieces(force[:1], hold)
    law = _laws(axis, _candidates(candidates), constant_force, moving_mass)
    m = law.shape[1]
    y, v = _each("position0", position0, m, "m"), _each("velocity0", velocity0, m, "m/s")
    steps = np.diff(times)
    if substeps is None:
        laid_out = plan(Surroundings.of(axis), ()).blocks(_candidates(candidates).T, np.empty((0, m)), mass=law[4])
        count = laid_out.substeps(float(steps.max(initial=0.0)))
    else:
        count = _substeps(substeps)
    positions = np.empty((len(force), m))
    march(force, steps, count, hold is TorqueHold.LINEAR, law, y, v, positions)
    return positions.T


def settle(run: Callable[[int], Floats], substeps: int, tolerance: float = POSITION_TOLERANCE) -> tuple[int, Floats]:
    """Double the sub-steps until the position moves by less than the tolerance, then return the finer run.

    Where the method is second order the finer run is three times better than that; where something begins inside a
    sub-step (a rest, a contact) it is first order, and this is just enough. The doubling before must have agreed too,
    to eight times the tolerance: near a tipping point two runs may agree by chance.

    Args:
        run: sub-steps per sample -> result whose first row is the position. (·, n)
        substeps: the first guess. >= 1
        tolerance: position error that is small enough. [m or rad]
    """
    before, last = run(max(substeps // 2, 1)), run(substeps)
    change = _change(before, last)
    while True:
        substeps *= 2
        before, last = last, run(substeps)
        earlier, change = change, _change(before, last)
        if (not change > tolerance and not earlier > 8.0 * tolerance) or 2 * substeps > MOST_SUBSTEPS:
            return substeps, last


def _change(before: Floats, after: Floats) -> float:
    return float(np.max(np.abs(after[0] - before[0])))


def _finite(name: str, values: ArrayLike, unit: str) -> Floats:
    array = np.ascontiguousarray(values, dtype=np.float64)
    if array.ndim != 1 or array.size == 0:
        raise InputError(f"{name} has shape {array.shape}: give one value per sample, shape (n,), n >= 1")
    if not np.isfinite(array).all():
        k = int(np.argmin(np.isfinite(array)))
        raise ParameterError(f"{name}[{k}]", float(array[k]), "finite", unit)
    return array


def _times(axis: Axis, n: int, sample_time: float | None, t: ArrayLike | None) -> Floats:
    if t is not None and sample_time is not None:
        raise InputError("t and sample_time are both given: give the time stamps t or the sample_time, not both")
    if t is None:
        period = axis.stream.sample_time if sample_time is None else sample_time
        if period is None:
            raise InputError(f"axis {axis.name} has no [stream] sample_time: give sample_time [s] or the time stamps t")
        if not (math.isfinite(period) and period > 0):
            raise ParameterError("sample_time", period, "> 0", "s")
        return period * np.arange(n, dtype=np.float64)
    times = _finite("t", t, "s")
    if len(times) != n:
        raise InputError(f"t has {len(times)} samples, torque has {n}: they must be equally many")
    if (np.diff(times) <= 0).any():
        k = int(np.argmax(np.diff(times) <= 0)) + 1
        raise ParameterError(f"t[{k}]", float(times[k]), f"later than t[{k - 1}] = {times[k - 1]:g}", "s")
    return times


def _pieces(force: Floats, hold: TorqueHold) -> tuple[Floats, Floats]:
    """Force just after each sample and just before the next. [N] (n - 1,) each."""
    match hold:
        case TorqueHold.HOLD | TorqueHold.MEAN:
            return force[:-1], force[:-1]
        case TorqueHold.LINEAR:
            return force[:-1], force[1:]
        case _:
            raise ParameterError("hold", str(hold), "hold, linear or mean: try each and keep the one that fits best")


def _laws(axis: Axis, candidates: Floats, constant_force: float | ArrayLike, mass: float | ArrayLike | None) -> Floats:
    """Rows F_c, F_s - F_c, 1/v_s, F_v, m_e, M g + F_0 of the population kernel. (6, m)."""
    m = len(candidates)
    masses = _each("moving_mass", axis.mechanics.moving_mass if mass is None else mass, m, axis.inertia_unit)
    if (masses <= 0).any():
        raise ParameterError("moving_mass", float(masses[masses <= 0][0]), "> 0", axis.inertia_unit)
    against = axis.mechanics.weight + _each("constant_force", constant_force, m, axis.force_unit)
    coulomb, static, stribeck, viscous = candidates.T
    return np.stack([coulomb, static - coulomb, 1.0 / stribeck, viscous, masses, against])


def _candidates(candidates: ArrayLike) -> Floats:
    array = np.asarray(candidates, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != 4 or not len(array):
        raise InputError(f"candidates has shape {array.shape}, but must be (m, 4): F_c, F_s, v_s, F_v")
    usable = np.isfinite(array) & (array >= 0) & ((array > 0) | (np.arange(4) != 2))
    if not usable.all():
        StribeckFriction(*array[np.argmin(usable.all(axis=1))].tolist())  # raises, naming the field
    return array


def _each(name: str, value: float | ArrayLike, m: int, unit: str) -> Floats:
    array = np.array(np.broadcast_to(np.asarray(value, dtype=np.float64), m) if np.ndim(value) == 0 else value)
    if array.shape != (m,):
        raise InputError(f"{name} has shape {array.shape}, but must be one number or shape ({m},)")
    return _finite(name, array, unit)


def _number(name: str, value: float, unit: str) -> float:
    if not math.isfinite(value):
        raise ParameterError(name, float(value), "finite", unit)
    return float(value)


def _substeps(substeps: int) -> int:
    if substeps != int(substeps) or substeps < 1:
        raise ParameterError("substeps", substeps, "a whole number >= 1 (per sample)")
    return int(substeps)
