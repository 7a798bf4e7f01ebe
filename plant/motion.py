"""A machine in its position loop, as real machines run: cascade controller, reference motion, and what is recorded.

The controller runs at its own rate, 1 kHz by default, and holds its force for a tick; a recording at the stream's rate
takes every tenth tick: position as it is then, torque as it is then ("sample") or averaged over the sample ("mean").
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from plant.axis import Axis, TorqueHold
from plant.effects import EffectValues, Surroundings
from plant.errors import ParameterError
from plant.friction import StribeckFriction
from plant.kernels import motion as kernel
from plant.machine import Blocks, checked_values, plan
from plant.profiles import Reference
from plant.recording import Recording
from plant.sensors import decimate

Floats = NDArray[np.float64]
TICKS = 10  # for which the sub-steps are counted together


@dataclass(frozen=True, slots=True)
class Cascade:
    """P position controller over a P or PI velocity controller, with feed-forward and a torque limit.

    Attributes:
        position_gain: velocity asked for per position error, K_v. [1/s] > 0
        velocity_gain: force at the belt per velocity error. [N·s/m] > 0
        integral_time: T_i of the velocity controller; None makes it a P controller. [s] > 0
        velocity_feedforward: share of the reference velocity. [1]
        acceleration_feedforward: share of m_e times the reference acceleration. [1]
        weight_feedforward: the weight of the axis as its file knows it is fed forward.
        torque_limit: at the motor; None has no limit. [N·m] > 0
        loop_time: [s] > 0
        encoder_resolution: step of the position that the controller sees; 0 sees position and velocity exactly. [m]
        velocity_filter: time constant of the velocity measured by differences. [s] >= 0
    """

    position_gain: float = 20.0
    velocity_gain: float = 3000.0
    integral_time: float | None = 0.02
    velocity_feedforward: float = 1.0
    acceleration_feedforward: float = 0.0
    weight_feedforward: bool = True
    torque_limit: float | None = None
    loop_time: float = 0.001
    encoder_resolution: float = 0.0
    velocity_filter: float = 0.0

    def __post_init__(self) -> None:
        """Check ranges."""
        above = [("position_gain", "1/s"), ("velocity_gain", "N*s/m"), ("loop_time", "s")]
        above += [(name, unit) for name, unit in (("integral_time", "s"), ("torque_limit", "N*m")) if self._has(name)]
        for name, unit in above:
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise ParameterError(f"cascade: {name}", getattr(self, name), "> 0", unit)
        for name, unit in (("encoder_resolution", "m"), ("velocity_filter", "s")):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) >= 0):
                raise ParameterError(f"cascade: {name}", getattr(self, name), ">= 0", unit)

    def _has(self, name: str) -> bool:
        return getattr(self, name) is not None

    def settings(self, axis: Axis) -> Floats:
        """The kernel's settings on `axis` as its file knows it."""
        m = axis.mechanics
        fed = m.weight if self.weight_feedforward else 0.0
        settings = np.zeros(kernel.SETTINGS)
        settings[kernel.POSITION_GAIN] = self.position_gain
        settings[kernel.VELOCITY_GAIN] = self.velocity_gain
        settings[kernel.INTEGRAL_RATE] = 0.0 if self.integral_time is None else 1.0 / self.integral_time
        settings[kernel.FEED_VELOCITY] = self.velocity_feedforward
        settings[kernel.FEED_MASS] = self.acceleration_feedforward * m.moving_mass
        settings[kernel.FEED_FORCE] = fed
        settings[kernel.FIRST_INTEGRAL] = 0.0 if self.integral_time is None else m.weight - fed
        settings[kernel.LIMIT] = math.inf if self.torque_limit is None else self.torque_limit * abs(m.gain)
        settings[kernel.ENCODER] = self.encoder_resolution
        settings[kernel.SMOOTHING] = self.loop_time / (self.loop_time + self.velocity_filter)
        return settings


@dataclass(frozen=True, slots=True, eq=False)
class MotionRun:
    """What the controlled machine did, at each tick of its controller.

    Attributes:
        t: [s] (n,)
        force: that the controller asked for, held until the next tick. [N] (n,)
        position: true, on the side of the sensor. [m or rad] (n,)
        velocity: true, there. [m/s or rad/s] (n,)
        friction_force: over the last sub-step. [N] (n,)
        wanted: reference position. [m or rad] (n,)
    """

    t: Floats
    force: Floats
    position: Floats
    velocity: Floats
    friction_force: Floats
    wanted: Floats


@dataclass(frozen=True, slots=True)
class ClosedLoop:
    """What moves an axis in a closed loop.

    Attributes:
        reference: where it should be.
        cascade: who sees to it.
        torque: what a recording takes of the loop's torque, "sample" or "mean".
    """

    reference: Reference
    cascade: Cascade = Cascade()
    torque: Literal["sample", "mean"] = "sample"

    def factor(self, sample_time: float) -> int:
        """Ticks of the controller per sample of the recording.

        Raises:
            ParameterError: the sample time is no multiple of the loop time.
        """
        ticks = sample_time / self.cascade.loop_time
        if round(ticks) < 1 or abs(ticks - round(ticks)) > 1e-6:
            allowed = f"a multiple of the controller's loop_time = {self.cascade.loop_time:g}"
            raise ParameterError("sample_time", sample_time, allowed, "s")
        return round(ticks)

    def hold(self, sample_time: float) -> TorqueHold:
        """What a recorded torque sample means: held where each tick is recorded, else mean or unknown."""
        if self.factor(sample_time) == 1:
            return TorqueHold.HOLD
        return TorqueHold.MEAN if self.torque == "mean" else TorqueHold.UNKNOWN


def simulate_motion(
    axis: Axis,
    friction: StribeckFriction,
    loop: ClosedLoop,
    duration: float,
    *,
    effects: EffectValues | None = None,
    known: Axis | None = None,
    constant_force: float = 0.0,
    substeps: int | None = None,
) -> MotionRun:
    """March `axis` in its loop for `duration` [s], from rest or motion at the reference's begin.

    Args:
        axis: the machine.
        friction: eq. (1).
        loop: reference and controller.
        duration: [s] >= loop_time
        effects: name -> parameter -> value, as in effects.md.
        known: the axis that the controller feeds forward, without its payload; None takes `axis`.
        constant_force: on the friction side. [N]
        substeps: per tick of the controller; None takes that of `substeps_per_tick`.

    Raises:
        InputError: a value that cannot be used; says which.
    """
    tick = loop.cascade.loop_time
    if not (math.isfinite(duration) and duration >= tick):
        raise ParameterError("duration", duration, f">= loop_time = {tick:g}", "s")
    t: Floats = tick * np.arange(round(duration / tick), dtype=np.float64)
    wanted = loop.reference.motion(t)
    chosen = plan(Surroundings.of(axis), tuple(effects or ()))
    values = checked_values(chosen, effects or {})
    blocks = chosen.blocks(friction.as_array[:, np.newaxis], values, constant_force=constant_force)
    blocks.place(float(wanted.position[0]), float(wanted.velocity[0]), axis.mechanics.weight)
    force, out = np.empty(len(t)), np.zeros((3, len(t)))
    kernel.closed_loop(
        blocks.b[0],
        blocks.laws,
        blocks.structure,
        t,
        np.stack(wanted).astype(np.float64),
        loop.cascade.settings(known or axis),
        float(blocks.delay[0]),
        substeps_per_tick(blocks, tick) if substeps is None else substeps,
        blocks.observed,
        force,
        out,
    )
    return MotionRun(t, force, out[0], out[1], out[2], wanted.position)


def substeps_per_tick(blocks: Blocks, tick: float) -> int:
    """Sub-steps for ticks of `tick` [s]: the rule of `Blocks.substeps`, whose least of two is for longer samples."""
    return -(-blocks.substeps(TICKS * tick) // TICKS)


def record_motion(run: MotionRun, loop: ClosedLoop, sample_time: float) -> Recording:
    """The recording that a drive makes of `run` at `sample_time` [s]; with velocity.

    Raises:
        ParameterError: the sample time is no multiple of the loop time.
    """
    factor = loop.factor(sample_time)
    fast = Recording(
        t=run.t,
        force=run.force,
        position=run.position,
        velocity=run.velocity,
        sample_time=loop.cascade.loop_time,
        loop="closed",
    )
    return decimate(fast, factor, loop.torque)
