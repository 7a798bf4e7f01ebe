"""How much of what is hidden can be seen: what friction, a constant and inertia do not take up, over the noise."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import curve_fit
from scipy.signal import butter, filtfilt

from .machine import HELD, POINT, Moved
from .plants import Plant

OWN_OFFSET = {"force_offset", "coulomb_asymmetry"}  # a constant would take them up
OWN_MASS = {"inertia_error", "torque_scale_error"}  # so would another mass
LEAST = 300  # samples in motion
STRIBECK_SHARES = np.array([0.01, 0.02, 0.04, 0.08, 0.16, 0.3])  # of the top speed, tried in turn


@dataclass(frozen=True)
class Seen:
    """Forces in motion, band-limited as a user would see them. [N]

    Attributes:
        rms: of the hidden force.
        projected: rms of what least squares on ordinary terms leave of it.
        rest: rms of what nobody can tell: noise and the wandering of the dry level.
    """

    rms: float
    projected: float
    rest: float


def see(plant: Plant, moved: Moved, effects: set[str], reading_delay: float, noise: float = 0.0) -> Seen | None:
    """Compare the force with what a machine without anything hidden would need; None: it hardly moves."""
    period, n = plant.sample_period, len(moved.position) - 1
    force = moved.current
    if plant.reported == HELD:
        force = moved.command
    elif plant.reported == POINT:
        force = np.r_[0.5 * (moved.command[1:] + moved.command[:-1]), moved.command[-1]]
    a = np.diff(moved.velocity) / period
    model = plant.mass * a + plant.weight + moved.friction[:-1]
    v = 0.5 * (moved.velocity[1:] + moved.velocity[:-1])
    rough, slowest = moved.rough[:-1], moved.slowest[:-1]
    moving = slowest > 0.004 * plant.v_max
    if reading_delay > 0:
        k = np.arange(n)
        late = k - reading_delay / period
        model, v, a = np.interp(late, k, model), np.interp(late, k, v), np.interp(late, k, a)
        moving &= np.interp(late, k, slowest) > 0.004 * plant.v_max
        moving &= np.sign(v) == np.sign(moved.velocity[:-1])
    moving[: int(0.2 / period)] = False
    if moving.sum() < LEAST:
        return None
    hidden = force[:-1] - model - rough
    k = np.arange(n)
    numerator, denominator = butter(2, min(25.0, 0.15 / period) * 2 * period)
    hidden = filtfilt(numerator, denominator, np.interp(k, k[moving], hidden[moving]))[moving]
    left = _left_over(plant, hidden, v[moving], a[moving], effects)
    rest = np.sqrt(np.mean(rough[moving] ** 2) + noise**2)
    return Seen(float(np.sqrt(np.mean(hidden**2))), float(left), float(rest))


def _left_over(plant, hidden, v, a, effects):
    """Rms of what the best of the least-squares fits leaves. [N]"""
    s = np.sign(v)
    columns = [s, v]
    if not effects & OWN_OFFSET:
        columns.append(np.ones(len(v)))
    if not effects & OWN_MASS:
        columns.append(a)
    every = max(1, len(v) // 20000)
    best = None
    for stribeck in plant.v_max * STRIBECK_SHARES:
        table = np.stack([*columns, s * np.exp(-np.abs(v) / stribeck)], 1)[::every]
        table = table / (np.abs(table).max(0) + 1e-12)
        found, *_ = np.linalg.lstsq(table, hidden[::every], rcond=None)
        rms = np.sqrt(np.mean((hidden[::every] - table @ found) ** 2))
        if best is None or rms < best:
            best = rms
    return best


def noise_force(plant: Plant, reading: float, force: float) -> float:
    """What noise of the position `reading` [m] and of the force [N] is as a force, to 20 Hz or 0.2 of the rate. [N]"""
    period = plant.sample_period
    band = min(20.0, 0.2 / period)
    of_position = plant.mass * (2 * np.pi) ** 2 * reading * np.sqrt(2 * period) * band**2.5 / np.sqrt(5)
    return float(np.hypot(of_position, force * np.sqrt(2 * band * period)))


def exponential_drop(plant: Plant, moved: Moved) -> dict[str, float] | None:
    """The exponential law nearest to the viscous coefficient as it fell; None where none fits."""
    t, fallen = np.arange(len(moved.viscous)) * plant.sample_period, moved.viscous / plant.viscous

    def law(t, level, drop, time):
        return level * (1 + drop * np.exp(-t / time))

    try:
        (_, drop, time), _ = curve_fit(law, t[::50], fallen[::50], p0=[1, 0.5, plant.duration / 5])
    except RuntimeError:
        return None
    return {"relative_drop": float(drop), "time_constant": float(time)}
