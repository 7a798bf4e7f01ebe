"""Where the mismatch shows: along the named effect's own coordinate, or along the one that predicts unseen force."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from identify.mismatch.compare import Fit
from identify.mismatch.inverse import Unexplained, unexplained
from identify.mismatch.residual import RESTING, acceleration_of
from identify.mismatch.result import Location, Quantity
from identify.preprocess import Samples, smooth_velocity
from plant.axis import Axis

Floats = NDArray[np.float64]

SMOOTH_CUT = 8.0  # Hz: what position sensors resolve as force
BINS = 24  # along a coordinate
FEWEST = 8  # samples in a bin that predicts
BLOCKS = 20  # blocks that must agree
CERTAIN = 1e-3  # p-value below which a coordinate is named
RIVAL = 0.8  # of the best share: coordinates this close are named too
HALF = 0.5  # of the highest: where the map counts as being there
BURST = 3.0  # times the median: force in a second that stands out in time
LINE = 0.35  # share of the power in one line of the spectrum that makes it a frequency
COORDINATE = {
    "force_offset": "direction",
    "coulomb_asymmetry": "direction",
    "viscous_asymmetry": "velocity",
    "position_dependent_friction": "position",
    "rail_defect": "position",
    "presliding_hysteresis": "distance_since_reversal",
    "backlash": "distance_since_reversal",
    "transmission_compliance": "acceleration",
    "torque_ripple": "motor_angle",
    "pulley_eccentricity": "pulley_angle",
    "load_dependent_friction": "torque",
    "thermal_drift": "time",
    "quadratic_drag": "velocity",
    "position_spring": "position",
    "inertia_error": "acceleration",
    "torque_scale_error": "torque",
    "actuator_lag": "torque_rate",
    "dead_time": "torque_rate",
    "torque_saturation": "torque",
    "dwell_time_stiction": "dwell_time",
    "end_stop": "position",
    "step_change": "time",
}


def coordinates(samples: Samples, axis: Axis) -> dict[str, Floats]:
    """Every coordinate a force may depend on, at each sample. (n,) each."""
    velocity = smooth_velocity(samples)
    fastest = max(float(np.quantile(np.abs(velocity), 0.98)), 1e-12)
    direction = np.where(velocity > RESTING * fastest, 1.0, np.where(velocity < -RESTING * fastest, -1.0, 0.0))
    since_time, since_distance, dwell = _since_reversal(samples, direction)
    force = samples.force
    rate = np.gradient(force) / samples.sample_time
    mechanics = axis.mechanics
    return {
        "position": samples.position,
        "velocity": velocity,
        "direction": direction,
        "acceleration": acceleration_of(samples, velocity),
        "torque": force / mechanics.gain,
        "torque_rate": rate / mechanics.gain,
        "time": samples.t,
        "time_since_reversal": since_time,
        "distance_since_reversal": since_distance,
        "dwell_time": dwell,
        "motor_angle": np.mod(samples.position / mechanics.Rm, 2 * np.pi),
        "pulley_angle": np.mod(samples.position / mechanics.Rc, 2 * np.pi),
    }


def _since_reversal(samples: Samples, direction: Floats) -> tuple[Floats, Floats, Floats]:
    """Time [s] and distance [m] since the direction last changed, and the rest [s] before it. (n,) each."""
    n = len(samples)
    time, distance, dwell = np.zeros(n), np.zeros(n), np.zeros(n)
    last, turned, where, rest, rested = 0.0, samples.t[0], samples.position[0], 0.0, 0.0
    for k in range(n):
        if k and samples.run[k] != samples.run[k - 1]:
            last, turned, where, rest, rested = 0.0, samples.t[k], samples.position[k], 0.0, 0.0
        if direction[k] == 0.0:
            rest += samples.steps[k]
        elif direction[k] != last:
            last, turned, where, rested, rest = direction[k], samples.t[k], samples.position[k], rest, 0.0
        else:
            rest = 0.0
        time[k], distance[k], dwell[k] = samples.t[k] - turned, abs(samples.position[k] - where), rested
    return time, distance, dwell


def named_location(
    name: str, parameters: dict[str, Quantity], share: float, z: float, samples: Samples, axis: Axis
) -> Location:
    """Where a named effect acts, from its own parameters."""
    coordinate = COORDINATE.get(name, "time")
    low, high = float(samples.position.min()), float(samples.position.max())
    value = {key: quantity.value for key, quantity in parameters.items()}
    last = float(samples.t.max())
    velocity = float(np.abs(smooth_velocity(samples)).max())
    interval = {
        "position": (low, high),
        "time": (0.0, last),
        "velocity": (-velocity, velocity),
        "direction": (-1.0, 1.0),
        "motor_angle": (0.0, 2 * np.pi),
        "pulley_angle": (0.0, 2 * np.pi),
    }.get(coordinate, (0.0, 0.0))
    if name == "rail_defect":
        interval = (value["centre"] - 2 * value["width"], value["centre"] + 2 * value["width"])
    elif name == "end_stop":
        upper = value["position"] > 0.5 * (low + high)
        interval = (value["position"], high) if upper else (low, value["position"])
    elif name == "step_change":
        interval = (value["time"], last)
    elif name == "thermal_drift":
        interval = (0.0, min(last, 3 * value["time_constant"]))
    elif name == "backlash":
        interval = (0.0, value["gap"])
    elif name == "presliding_hysteresis":
        interval = (0.0, 0.005 * (high - low))
    if interval == (0.0, 0.0):
        reached = np.quantile(coordinates(samples, axis)[coordinate], [0.005, 0.995])
        interval = (float(reached[0]), float(reached[1]))
    return Location(coordinate, interval, share, float(norm.sf(z)))


@dataclass(frozen=True, slots=True)
class Found:
    """How much of the unexplained force a coordinate predicts on unseen data, and where along it the force is."""

    coordinate: str
    share: float
    p_value: float
    interval: tuple[float, float]


def locate(fit: Fit, samples: Samples, held_out: Samples) -> Location | None:
    """The coordinate along which force that nothing explains repeats, or None."""
    here, there = (unexplained(fit.problem, fit.x, part, SMOOTH_CUT) for part in (samples, held_out))
    if here is None or there is None:
        return None
    ours, theirs = coordinates(samples, fit.problem.axis), coordinates(held_out, fit.problem.axis)
    found = [_burst(here, samples), _line(here, samples)]
    found += [_mapped(name, here, ours[name], ours, there, theirs[name], theirs) for name in ours if name != "time"]
    known = sorted((f for f in found if f is not None and f.p_value < CERTAIN), key=lambda f: -f.share)
    if not known:
        return None
    best = known[0]
    close = tuple(f.coordinate for f in known[1:] if f.share > RIVAL * best.share)
    return Location(best.coordinate, best.interval, best.share, best.p_value, close)


def _mapped(
    name: str,
    here: Unexplained,
    ours: Floats,
    all_ours: dict[str, Floats],
    there: Unexplained,
    theirs: Floats,
    all_theirs: dict[str, Floats],
) -> Found | None:
    """Learn force against a coordinate here, even and odd half, and see how much of it that predicts there."""
    best: Found | None = None
    sign_here = all_ours["direction"][here.index]
    sign_there = all_theirs["direction"][there.index]
    for odd in (False, True):
        if name == "direction" and odd:
            continue
        factor_here = sign_here if odd else np.ones(len(sign_here))
        factor_there = sign_there if odd else np.ones(len(sign_there))
        x, y = ours[here.index], here.lacking * factor_here
        edges = np.unique(np.quantile(x, np.linspace(0, 1, BINS + 1)))
        if len(edges) < 3:
            continue
        bins = np.clip(np.digitize(x, edges) - 1, 0, len(edges) - 2)
        count = np.bincount(bins, minlength=len(edges) - 1)
        level = np.bincount(bins, y, minlength=len(edges) - 1) / np.maximum(count, 1)
        level[count < FEWEST] = 0.0
        unseen = np.clip(np.digitize(theirs[there.index], edges) - 1, 0, len(edges) - 2)
        truth = there.lacking
        gained = truth**2 - (truth - level[unseen] * factor_there) ** 2
        sums = np.add.reduceat(gained, np.linspace(0, len(gained), BLOCKS + 1).astype(int)[:-1])
        z = float(sums.mean()) / max(float(sums.std(ddof=1)) / np.sqrt(BLOCKS), 1e-300)
        share = float(gained.sum() / max(float(truth @ truth), 1e-300))
        if best is None or share > best.share:
            best = Found(name, share, float(norm.sf(z)), _where(level, edges))
    return best


def _where(level: Floats, edges: Floats) -> tuple[float, float]:
    """The stretch around the highest bin over which the map stays above half of it."""
    size = np.abs(level)
    top = int(np.argmax(size))
    low = high = top
    while low > 0 and size[low - 1] > HALF * size[top]:
        low -= 1
    while high < len(size) - 1 and size[high + 1] > HALF * size[top]:
        high += 1
    return float(edges[low]), float(edges[high + 1])


def _burst(here: Unexplained, samples: Samples) -> Found | None:
    """Seconds in which far more force is unexplained than usually."""
    second = np.floor(samples.t[here.index]).astype(int) + 10_000_000 * samples.run[here.index]
    keys, inverse = np.unique(second, return_inverse=True)
    power = np.bincount(inverse, here.lacking**2) / np.bincount(inverse)
    if len(keys) < 8:
        return None
    level = np.sqrt(power)
    usual = float(np.median(level))
    top = int(np.argmax(level))
    if level[top] < BURST * usual:
        return None
    low = high = top
    while low > 0 and level[low - 1] > HALF * level[top]:
        low -= 1
    while high < len(level) - 1 and level[high + 1] > HALF * level[top]:
        high += 1
    share = 1.0 - len(power) * usual**2 / float(power.sum())
    start = float(keys[low] % 10_000_000)
    return Found("time", share, float(norm.sf(level[top] / usual)), (start, float(keys[high] % 10_000_000) + 1.0))


def _line(here: Unexplained, samples: Samples) -> Found | None:
    """One frequency that holds much of the unexplained force and none of the motion's."""
    first = samples.run[here.index] == samples.run[here.index[0]]
    force = here.lacking[first] - here.lacking[first].mean()
    motion = samples.position[here.index][first]
    n = len(force)
    if n < 256:
        return None
    window = np.hanning(n)
    power = np.abs(np.fft.rfft(force * window)) ** 2
    moved = np.abs(np.fft.rfft((motion - motion.mean()) * window)) ** 2
    frequency = np.fft.rfftfreq(n, samples.sample_time)
    top = int(np.argmax(power[2:])) + 2
    near = slice(max(top - 2, 0), top + 3)
    share = float(power[near].sum() / power.sum())
    if share < LINE or moved[near].max() > 0.05 * moved.max():
        return None
    return Found("frequency", share, 1e-6, (float(frequency[top] - 2 / n), float(frequency[near][-1])))
