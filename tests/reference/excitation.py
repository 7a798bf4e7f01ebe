"""Excitation: torques for the open loop, motions for the closed loop."""

import math
from dataclasses import dataclass, field

import numpy as np

from .control import Loop


@dataclass(frozen=True)
class Torque:
    """Open loop: motor torque [N·m] at stamps t [s]; `hold` is "hold" or "linear" between them."""

    t: np.ndarray
    torque: np.ndarray
    hold: str = "hold"


@dataclass(frozen=True)
class Motion:
    """Closed loop: wanted position, speed and acceleration at the loop's stamps t [s]."""

    t: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    loop: Loop = field(default_factory=Loop)


def stamps(duration: float, period: float) -> np.ndarray:
    """0, period, ... up to duration [s]."""
    return np.arange(round(duration / period) + 1) * period


def sine(t, amplitude, frequency, phase=0.0):
    """Amplitude x sin."""
    return amplitude * np.sin(2 * math.pi * frequency * t + phase)


def multisine(t, amplitudes, frequencies, phases, modulation=0.0, modulation_frequency=0.03):
    """Sum of sines, its amplitude slowly modulated."""
    total = sum(a * np.sin(2 * math.pi * f * t + q) for a, f, q in zip(amplitudes, frequencies, phases, strict=True))
    return total * (1.0 + modulation * np.sin(2 * math.pi * modulation_frequency * t))


def square(t, amplitude, frequency):
    """+amplitude first, then -amplitude."""
    return np.where((t * frequency) % 1.0 < 0.5, amplitude, -amplitude)


def two_squares(t, amplitudes, frequencies):
    """Superposition of two squares (§4.5)."""
    return square(t, amplitudes[0], frequencies[0]) + square(t, amplitudes[1], frequencies[1])


def saw(t, amplitude, frequency):
    """Triangle between +-amplitude, starting at 0 upwards."""
    phase = (t * frequency + 0.25) % 1.0
    return amplitude * (1.0 - 4.0 * np.abs(phase - 0.5))


def staircase(t, amplitude, rng, shortest=0.3, longest=1.5):
    """Piecewise constant levels of alternating sign, lengths at random."""
    out, start, sign = np.zeros_like(t), t[0], 1.0
    while start <= t[-1]:
        end = start + rng.uniform(shortest, longest)
        out[(t >= start) & (t < end)] = sign * amplitude * rng.uniform(0.5, 1.0)
        start, sign = end, -sign
    return out


def point_to_point(start, goal, speed, acceleration, period, smooth):
    """Positions of one move [m] at `period`: trapezoid of speed, or the same with rounded ramps (S-curve)."""
    distance = abs(goal - start)
    speed = min(speed, math.sqrt(distance * acceleration))
    ramp, cruise = speed / acceleration, distance / speed - speed / acceleration
    t = np.arange(math.ceil((2 * ramp + cruise) / period) + 1) * period

    def travelled(u):  # distance on a ramp of length 1 that reaches speed 1
        u = np.clip(u, 0.0, 1.0)
        return u**3 - u**4 / 2 if smooth else u**2 / 2

    up = np.where(t < ramp, travelled(t / ramp) * ramp, ramp / 2 + np.minimum(t - ramp, cruise))
    down = np.where(t > ramp + cruise, ramp / 2 - travelled(1.0 - (t - ramp - cruise) / ramp) * ramp, 0.0)
    return start + math.copysign(1.0, goal - start) * speed * (up + down)


def journey(t, goals, speeds, accelerations, dwells, smooth=False, start=0.0):
    """Wanted position, speed, acceleration at t for a list of moves with dwells, repeated until t is full."""
    period, parts, here, total, i = t[1] - t[0], [], start, 0, 0
    while total < len(t):
        goal = goals[i % len(goals)]
        speed, acceleration = speeds[i % len(speeds)], accelerations[i % len(accelerations)]
        if abs(goal - here) > 1e-9:
            parts.append(point_to_point(here, goal, speed, acceleration, period, smooth))
            total += len(parts[-1])
        rest = round(dwells[i % len(dwells)] / period) + 1
        parts.append(np.full(rest, goal))
        total += rest
        here, i = goal, i + 1
    position = np.concatenate(parts)[: len(t)]
    return with_derivatives(position, period)


def wave(t, amplitude, frequency, centre=0.0):
    """Wanted position that follows a sine, starting gently."""
    ease = np.clip(t / (0.5 / frequency), 0.0, 1.0)
    ease = ease**2 * (3 - 2 * ease)
    return with_derivatives(centre + amplitude * ease * np.sin(2 * math.pi * frequency * t), t[1] - t[0])


def with_derivatives(position, period):
    """(position, speed, acceleration) by central differences."""
    velocity = np.gradient(position, period)
    return position, velocity, np.gradient(velocity, period)
