"""What is commanded: point-to-point motions with dwells, sums of sines, sweeps; position, velocity, acceleration."""

import numpy as np

KINDS = ("trap", "jerk", "random", "multisine", "sweep", "slowstart")
POINT_TO_POINT = ("trap", "slowstart", "random", "jerk")


def uniform(rng, low, high) -> float:
    """One number between."""
    return float(rng.uniform(low, high))


def log_uniform(rng, low, high) -> float:
    """One number between, its logarithm uniform."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def draw_motion(rng, kind, duration, period, low, high, v_max, a_max):
    """Position [m], velocity and acceleration every `period` [s] between `low` and `high`, within both limits."""
    if kind in POINT_TO_POINT:
        return _journeys(rng, kind, duration, period, low, high, v_max, a_max)
    t = np.arange(round(duration / period)) * period
    y = _sines(rng, t) if kind == "multisine" else _sweep(rng, t, duration, period)
    ramp = np.clip(t / 1.0, 0, 1)
    y = y * (ramp**3 * (10 - 15 * ramp + 6 * ramp**2))
    y = y / np.abs(y).max()
    size = 0.5 * (high - low)
    too_fast = max(np.abs(np.gradient(y * size, period)).max() / v_max, 1e-9)
    if too_fast > 1:
        size /= too_fast
    too_hard = np.abs(np.gradient(np.gradient(y * size, period), period)).max() / a_max
    if too_hard > 1:
        size /= too_hard
    position = 0.5 * (low + high) + size * y
    velocity = np.gradient(position, period)
    return position, velocity, np.gradient(velocity, period)


def _sines(rng, t):
    """Four slow sines, the higher the smaller."""
    ranges = ((0.06, 0.1), (0.14, 0.25), (0.3, 0.5), (0.55, 0.9))  # Hz
    frequencies = np.array([log_uniform(rng, *ends) for ends in ranges])
    amplitudes = np.array([1, 0.7, 0.3, 0.12]) * rng.uniform(0.7, 1.3, 4)
    phases = rng.uniform(0, 2 * np.pi, 4)
    angular = 2 * np.pi * frequencies[:, None]
    return (amplitudes[:, None] * np.sin(angular * t + phases[:, None])).sum(0)


def _sweep(rng, t, duration, period):
    """Slow, fast, slow; smaller the faster."""
    low = log_uniform(rng, 0.03, 0.06)
    high = min(1.6, log_uniform(rng, 0.5, 1.2))
    share = 0.5 - 0.5 * np.cos(2 * np.pi * t / duration * rng.choice([1, 2]))
    frequency = low * (high / low) ** share
    return np.sin(2 * np.pi * np.cumsum(frequency) * period) * (frequency / low) ** -0.25


def _journeys(rng, kind, duration, period, low, high, v_max, a_max):
    """From point to point, with a rest after each journey."""
    n, span = round(duration / period), high - low
    y = 0.5 * (low + high) if rng.random() < 0.5 else low + 0.05 * span
    position, velocity, acceleration = np.full(n, y), np.zeros(n), np.zeros(n)
    k, upwards = int(0.3 / period), True
    while k < n:
        upwards = not upwards
        target, v, a, rest = _next_journey(rng, kind, upwards, low, high, v_max, a_max)
        distance = target - y
        if abs(distance) < 0.03 * span:
            continue
        shape = _minimum_jerk if kind == "jerk" else _trapezoid
        piece = shape(y, distance, v, a, period)
        end, length = min(n, k + len(piece[0])), len(piece[0])
        for series, values in zip((position, velocity, acceleration), piece, strict=True):
            series[k:end] = values[: end - k]
        y = target
        k = k + length
        position[k:] = y
        k += int(rest / period)
    return position, velocity, acceleration


def _next_journey(rng, kind, upwards, low, high, v_max, a_max):
    """Where to, how fast, how hard, and how long to rest there."""
    span = high - low
    if kind == "trap":
        end = high - uniform(rng, 0, 0.06) * span if upwards else low + uniform(rng, 0, 0.06) * span
        target = uniform(rng, low, high) if rng.random() < 0.25 else end
        v = v_max * rng.choice([1, 0.8, 0.55, 0.3, 0.12])
        return target, v, a_max * uniform(rng, 0.6, 1), rng.choice([0.0, 0.2, 0.5, 1.0])
    target = uniform(rng, low, high)
    if kind == "slowstart":
        v = v_max * uniform(rng, 0.3, 1)
        return target, v, a_max * uniform(rng, 0.25, 0.5), log_uniform(rng, 0.05, 4)
    v = v_max * log_uniform(rng, 0.15, 1)
    return target, v, a_max * uniform(rng, 0.5, 1), rng.choice([0, 0, 0, 0.3])


def _minimum_jerk(y, d, v, a, period):
    """A polynomial of the fifth order."""
    total = max(1.875 * abs(d) / v, np.sqrt(5.78 * abs(d) / a))
    s = np.arange(int(total / period)) * period / total
    position = y + d * (10 * s**3 - 15 * s**4 + 6 * s**5)
    velocity = d / total * (30 * s**2 - 60 * s**3 + 30 * s**4)
    return position, velocity, d / total**2 * (60 * s - 180 * s**2 + 120 * s**3)


def _trapezoid(y, d, v, a, period):
    """Constant acceleration, constant speed, constant braking."""
    v = min(v, np.sqrt(abs(d) * a))
    speeding = v / a
    cruising = abs(d) / v - speeding
    total = 2 * speeding + cruising
    s = np.arange(int(total / period)) * period
    sign, a = np.sign(d), v / speeding
    first, second = s < speeding, s < speeding + cruising
    cruise = 0.5 * v * speeding + v * (s - speeding)
    position = np.where(first, 0.5 * a * s**2, np.where(second, cruise, abs(d) - 0.5 * a * (total - s) ** 2)) * sign + y
    velocity = sign * np.where(first, a * s, np.where(second, v, a * (total - s)))
    return position, velocity, sign * np.where(first, a, np.where(second, 0, -a))
