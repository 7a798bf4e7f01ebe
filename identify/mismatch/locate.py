"""The coordinates a force may depend on, and where along its own a named effect acts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from identify.mismatch.residual import RESTING, acceleration_of
from identify.mismatch.result import Location, Quantity
from identify.preprocess import Samples, smooth_velocity
from plant.axis import Axis

Floats = NDArray[np.float64]

REACHED = 0.005, 0.995  # quantiles of a coordinate: where the axis has been
ANGLES = {"motor_angle", "pulley_angle"}  # turn together, with the position
WHERE = {"position", *ANGLES}  # coordinates of a place
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
    rate = np.diff(force, prepend=force[:1]) / samples.sample_time
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


def reach(coordinate: str, samples: Samples, axis: Axis) -> tuple[float, float]:
    """Where on a coordinate the axis has been, but for half a percent at each end."""
    low, high = np.quantile(coordinates(samples, axis)[coordinate], REACHED)
    return float(low), float(high)


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
        interval = reach(coordinate, samples, axis)
    return Location(coordinate, interval, share, float(norm.sf(z)))
