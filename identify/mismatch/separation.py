"""How far apart two models would stand after one more recording, by the statistic that the selection decides with.

A recording of the proposed motion is simulated with one model; the other is linearised around its fit, and may bend its
parameters as far as the recordings that exist allow. What it then still misses, over the variance of the prediction
errors, is the fall of the information criterion to expect: the same number that a name or a tie is decided by.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.criterion import FREE
from identify.mismatch.compare import Fit
from identify.mismatch.extended import ExtendedProblem
from identify.preprocess import Samples
from plant.axis import Axis
from plant.kernels import motion as loop
from plant.motion import Cascade, substeps_per_tick

Floats = NDArray[np.float64]

OMEGA = 2.0 * np.pi * 2.0  # rad/s, half the bandwidth of the simulated velocity loop: calm with a lag of 30 ms
TICK = 0.002  # s, about: cycle of the simulated loop
RIDGE = 1e-9  # of the normal matrix: keeps what nothing tells solvable


@dataclass(frozen=True, slots=True)
class Motion:
    """What a machine is told to do: forces of an open loop at each sample, or positions of a closed one at each tick.

    Attributes:
        words: the same for a person, with units.
        closed: True where `wanted` are positions.
        step: time between entries. [s]
        wanted: forces [N] or positions [m]. (n,)
        payload: known mass or inertia on top of the axis file's. [kg or kg m^2]
    """

    words: str
    closed: bool
    step: float
    wanted: Floats
    payload: float = 0.0

    @property
    def seconds(self) -> float:
        """How long it lasts. [s]."""
        return self.step * len(self.wanted)


@dataclass(frozen=True, slots=True, eq=False)
class Model:
    """A fit, and what the recordings that exist know about its unknowns.

    Attributes:
        fit: model, unknowns, observer.
        variance: of its prediction errors. [m²]
        normal: information on the first p unknowns, starts eliminated. (p, p)
    """

    fit: Fit
    variance: float
    normal: Floats

    @classmethod
    def of(cls, fit: Fit) -> Model:
        """Linearise a fit on its own samples."""
        problem = fit.problem
        error, slope = problem.jacobian(fit.x, fit.found.gain)
        variance = float(error @ error) / problem.samples.used + 1e-300
        full = slope.T @ slope / variance + np.diag(1.0 / problem.prior[1] ** 2)
        p = problem.p
        across = full[:p, p:]
        normal = full[:p, :p] - across @ np.linalg.pinv(full[p:, p:], hermitian=True) @ across.T
        return cls(fit, variance, normal)

    def on(self, samples: Samples, axis: Axis) -> ExtendedProblem:
        """The model on other samples, of the axis with its payload."""
        own = self.fit.problem
        mass = own.scales.mass + axis.mechanics.moving_mass - own.axis.mechanics.moving_mass
        moved = ExtendedProblem(
            samples,
            axis,
            own.guises,
            middle=own.middle,
            scales=dataclasses.replace(own.scales, mass=mass),
            first_state=np.array([[samples.position[0], 0.0]]),
            most_substeps=own.most_substeps,
            longest_substep=own.longest_substep,
        )
        return moved

    def unknowns(self) -> Floats:
        """Unknowns for one run that starts where it is told to. (p + 2,)"""
        return np.concatenate([self.fit.x[: self.fit.problem.p], np.zeros(2)])


def loaded(axis: Axis, payload: float) -> Axis:
    """The axis with a known payload."""
    if payload == 0.0:
        return axis
    name = "J" if axis.is_rotary else "M"
    mechanics = dataclasses.replace(axis.mechanics, **{name: getattr(axis.mechanics, name) + payload})
    return dataclasses.replace(axis, mechanics=mechanics)


def simulated(model: Model, motion: Motion, limit: float, origin: float) -> Samples | None:
    """What the machine of `model` would be recorded to do, without noise; None where it diverges.

    Args:
        model: the machine.
        motion: what it is told.
        limit: of the drive force. [N]
        origin: where an open-loop run starts. [m]
    """
    own = model.fit.problem
    axis = loaded(own.axis, motion.payload)
    sample_time = own.samples.sample_time
    if not motion.closed:
        force = np.clip(motion.wanted, -limit, limit)
        samples = _samples(force, np.full(len(force), origin), sample_time, own.samples.linear)
        problem = model.on(samples, axis)
        position = origin - problem.errors(model.unknowns()[None], FREE)[:, 0]
    else:
        every = max(1, round(sample_time / motion.step))
        force, position = _in_loop(model, motion, axis, limit)
        n = len(force) // every * every
        force, position = force[:n].reshape(-1, every).mean(axis=1), position[:n:every]
    if not np.isfinite(position).all():
        return None
    return _samples(force, position, sample_time, own.samples.linear and not motion.closed)


def _samples(force: Floats, position: Floats, sample_time: float, linear: bool) -> Samples:
    """One run without gaps."""
    n = len(force)
    steps = np.full(n, sample_time)
    steps[-1] = 0.0
    run, valid = np.zeros(n, dtype=np.int64), np.ones(n, dtype=np.bool_)
    t: Floats = sample_time * np.arange(n, dtype=np.float64)
    return Samples(t, force, position, steps, run, valid, sample_time, linear)


def _in_loop(model: Model, motion: Motion, axis: Axis, limit: float) -> tuple[Floats, Floats]:
    """Force and position of the machine under a calm position loop, at each tick. [N], [m] (n,) each"""
    own = model.fit.problem
    empty = _samples(np.zeros(2), np.full(2, motion.wanted[0]), motion.step, False)
    problem = model.on(empty, axis)
    blocks = problem.blocks(model.unknowns()[None])
    mass = float(problem.law(model.unknowns()[None])[4, 0])
    cascade = Cascade(
        position_gain=OMEGA / 2.0,
        velocity_gain=2.0 * OMEGA * mass,
        integral_time=4.0 / OMEGA,
        acceleration_feedforward=mass / own.axis.mechanics.moving_mass,
        torque_limit=limit / abs(axis.mechanics.gain),
        loop_time=motion.step,
    )
    t: Floats = motion.step * np.arange(len(motion.wanted), dtype=np.float64)
    velocity = np.gradient(motion.wanted, motion.step)
    reference: Floats = np.stack([motion.wanted, velocity, np.gradient(velocity, motion.step)]).astype(np.float64)
    blocks.place(float(motion.wanted[0]), 0.0, axis.mechanics.weight)
    force, out = np.empty(len(t)), np.zeros((3, len(t)))
    loop.closed_loop(
        blocks.b[0],
        blocks.laws,
        blocks.structure,
        t,
        reference,
        cascade.settings(axis),
        float(blocks.delay[0]),
        substeps_per_tick(blocks, motion.step),
        blocks.observed,
        force,
        out,
    )
    return force, out[0]


def apart_by(truth: Model, other: Model, samples: Samples, axis: Axis) -> float:
    """Fall of the criterion of `other` behind `truth` that a recording like `samples`, made by `truth`, would add. [1]

    `other` bends its unknowns as far as the recordings it was fitted to allow.
    """
    gain, p = truth.fit.found.gain, other.fit.problem.p
    there = truth.on(samples, axis)
    with np.errstate(all="ignore"):
        known = there.errors(truth.unknowns()[None], gain)[:, 0].copy()
        error, slope = other.on(samples, axis).jacobian(other.unknowns(), gain)
    missed = error - known
    if not (np.isfinite(missed).all() and np.isfinite(slope).all()):
        return 0.0
    normal = slope.T @ slope / truth.variance
    normal[:p, :p] += other.normal
    normal[p:, p:] += np.eye(2)
    score = slope.T @ missed / truth.variance
    ridge = RIDGE * np.diag(np.diag(normal))
    left = float(missed @ missed) / truth.variance - float(score @ np.linalg.solve(normal + ridge, score))
    n = len(missed)
    return n * float(np.log1p(max(left, 0.0) / n))
