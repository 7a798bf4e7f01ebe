"""Healthy machines for judging the audit: a small integrator of its own, many axes at once, under position control."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from plant.axis import Axis, Drive, Mechanics, Orientation, Sensor, Stream
from plant.recording import Recording

PERIOD = 0.01
SUBSTEPS = 10


@dataclass(frozen=True)
class Healthy:
    axis: Axis
    recording: Recording


def healthy_axes(count: int, seed: int, samples: int = 2000) -> list[Healthy]:
    """`count` axes of all kinds with the flaws that healthy machines have, each with one recording.

    Inertia off by up to 15 % (a factor of two where it is declared rough), payload up to 30 %, 1 % constant force,
    per-mille force, 10 um or 0.1 mrad encoders with noise, force late by up to one sample, Stribeck friction of 1-15 %
    of rated force, sines, trapezoids and a walk over many speeds.
    """
    rng = np.random.default_rng(seed)
    kind = rng.integers(0, 3, count)  # vertical, horizontal, rotary
    mass = np.where(kind == 2, 10 ** rng.uniform(-4, 0, count), 10 ** rng.uniform(0.7, 2.3, count))
    length = np.where(kind == 2, rng.uniform(3, 30, count), rng.uniform(0.3, 3, count))
    fast = length * rng.uniform(0.2, 0.8, count)
    pull = fast * rng.uniform(2, 8, count)
    weight = np.where(kind == 0, mass * 9.81, 0.0)
    rated = 1.5 * (weight + mass * pull)
    coulomb = rated * rng.uniform(0.01, 0.12, count)
    peak = coulomb * rng.uniform(0.8, 1.6, count)
    stribeck = fast * rng.uniform(0.02, 0.2, count)
    viscous = coulomb * rng.uniform(0, 0.6, count) / fast
    offset = rated * rng.uniform(-0.01, 0.01, count)
    payload = np.where(rng.random(count) < 0.5, mass * rng.uniform(0, 0.3, count), 0.0)
    reference = _references(rng, count, samples, length, fast, pull)
    force, y, v = _control(
        reference,
        mass + payload,
        weight + np.where(kind == 0, 9.81 * payload, 0) + offset,
        coulomb,
        peak,
        stribeck,
        viscous,
    )
    late = rng.random(count) < 0.3
    force = np.where(late, np.vstack([force[:1], force[:-1]]), force)
    step = np.where(kind == 2, 1e-4, 1e-5)
    seen_y = np.round((y + rng.normal(0, 1, y.shape) * step) / step) * step
    counts = rated / 1000
    seen_force = np.round((force + rng.normal(0, 2, y.shape) * counts) / counts) * counts
    rough = rng.random(count) < 0.3
    said = mass * np.where(rough, 2 ** rng.uniform(-1, 1, count), rng.uniform(0.85, 1.15, count))
    said = np.where(kind == 0, mass * rng.uniform(0.9, 1.1, count), said)
    gain = np.where(kind == 2, 1.0, 10 ** rng.uniform(0.5, 2, count))
    t = PERIOD * np.arange(samples) + rng.normal(0, 0.02 * PERIOD, (count, samples))
    return [
        Healthy(
            Axis(
                f"axis-{i}",
                _mechanics(int(kind[i]), float(said[i]), float(gain[i]), float(length[i]), bool(rough[i])),
                Drive(float(rated[i]), float(counts[i])),
                Sensor(float(step[i])),
                Stream(PERIOD),
            ),
            Recording(
                t[i], seen_force[:, i], seen_y[:, i], v[:, i], np.full(samples, 30.0), sample_time=PERIOD, loop="closed"
            ),
        )
        for i in range(count)
    ]


def _mechanics(kind: int, mass: float, gain: float, length: float, rough: bool) -> Mechanics:
    travel = (-0.05 * length, 1.05 * length)
    if kind == 2:
        return Mechanics(Orientation.ROTARY, J=mass, travel=travel, inertia_known=not rough)
    orientation = Orientation.VERTICAL if kind == 0 else Orientation.HORIZONTAL
    return Mechanics(orientation, M=mass, Rc=0.045, Rm=1 / gain, travel=travel, inertia_known=kind == 0 or not rough)


def _references(rng, count, samples, length, fast, pull):
    """Position references (samples, count) within [0, length]: sines, trapezoids, and strokes at several speeds."""
    t = PERIOD * np.arange(samples)
    out = np.empty((samples, count))
    for i in range(count):
        match rng.integers(0, 3):
            case 0:
                omega = fast[i] / (0.45 * length[i])
                out[:, i] = length[i] * (0.5 - 0.45 * np.cos(omega * t))
            case shape:
                y, at, speeds = [], 0.0, fast[i] * (np.ones(1) if shape == 1 else np.array([1.0, 0.5, 0.25, 0.1]))
                k = 0
                while len(y) < samples:
                    target = length[i] * (0.9 if at < 0.5 * length[i] else 0.1) * rng.uniform(0.9, 1.0)
                    stroke = _stroke(abs(target - at), speeds[(k // 2) % len(speeds)], pull[i])
                    y += list(at + np.sign(target - at) * stroke) + [target] * int(rng.integers(0, 40))
                    at, k = target, k + 1
                out[:, i] = y[:samples]
    return out


def _stroke(distance, speed, acceleration):
    speed = min(speed, np.sqrt(distance * acceleration))
    up, whole = speed / acceleration, distance / speed + speed / acceleration
    t = np.arange(0, whole, PERIOD)
    return np.where(
        t < up,
        0.5 * acceleration * t**2,
        np.where(t < whole - up, speed * (t - up / 2), distance - 0.5 * acceleration * (whole - t) ** 2),
    )


def _control(reference, mass, weight, coulomb, peak, stribeck, viscous):
    """PD control with feed-forward at `PERIOD`, semi-implicit friction with sticking at `SUBSTEPS` steps."""
    omega, h = 2 * np.pi * 4, PERIOD / SUBSTEPS
    target_v = np.gradient(reference, PERIOD, axis=0)
    target_a = np.gradient(target_v, PERIOD, axis=0)
    y, v = reference[0].copy(), np.zeros(reference.shape[1])
    force, positions, velocities = (np.empty_like(reference) for _ in range(3))
    for k in range(len(reference)):
        drive = mass * (target_a[k] + omega**2 * (reference[k] - y) + 1.4 * omega * (target_v[k] - v)) + weight
        force[k], positions[k], velocities[k] = drive, y, v
        for _ in range(SUBSTEPS):
            dry = coulomb + (peak - coulomb) * np.exp(-np.abs(v) / stribeck)
            free = v + h * (drive - weight) / mass
            v = np.sign(free) * np.maximum(np.abs(free) - h * dry / mass, 0) / (1 + h * viscous / mass)
            y = y + h * v
    return force, positions, velocities
