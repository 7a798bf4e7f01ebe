"""A small machine of the tests: a mass under a position loop, Euler steps of 0.1 ms, whatever resists it."""

from collections.abc import Callable

import numpy as np

from plant.axis import Axis, Drive, Mechanics, Orientation, Sensor
from plant.recording import Recording

STEP = 1e-4  # s
HELD = 100  # steps between two commands
MECHANICS = Mechanics(orientation=Orientation.HORIZONTAL, M=8.0, J=1e-3, Rc=0.02, force_per_torque=50.0)
AXIS = Axis("small", MECHANICS, Drive(rated_force=200.0), Sensor(position_resolution=1e-6))
MASS = 10.5

Resistance = Callable[[float, float, float], tuple[float, float]]


def dry(v: float, coulomb: float = 20.0) -> float:
    """Stribeck friction and 15 N s/m. [N]"""
    return coulomb + 8.0 * np.exp(-abs(v) / 0.01) + 15.0 * abs(v)


def driven(
    seed: int,
    resists: Resistance,
    seconds: float = 20.0,
    delivers: Callable[[float, float], float] = lambda told, _: told,
    carries: Callable[[float, float, float], float] = lambda t, y, v: 0.0,
    swiftest: float = 0.4,
    travel: float = 0.4,
) -> Recording:
    """Moves between random places, torque held for 10 ms.

    Args:
        seed: of the places and of the noise.
        resists: friction level against the motion and force against growing positions [N], at time, place and speed.
        seconds: of motion.
        delivers: force of the drive [N] for what it is told, and at what place, asked at every step.
        carries: mass that moves along at that time, place and speed. [kg]
        swiftest: speed of the moves. [m/s]
        travel: of the moves. [m]
    """
    rng = np.random.default_rng(seed)
    goals = np.repeat(rng.uniform(0.0, travel, round(3 * seconds)), 60)
    y = v = wanted = force = total = 0.0
    rows = []
    for k in range(round(seconds / STEP)):
        if k % HELD == 0:
            wanted += np.clip(goals[k // HELD] - wanted, -swiftest * HELD * STEP, swiftest * HELD * STEP)
            total += (wanted - y) * 0.01
            force = np.clip(900.0 * (wanted - y) + 500.0 * total - 160.0 * v, -150.0, 150.0)
            rows.append((k * STEP, force, y))
        level, pull = resists(k * STEP, y, v)
        net = delivers(force, y) - pull
        if v == 0.0 and abs(net) <= level:
            continue
        way = np.sign(v) if v else np.sign(net)
        faster = v + STEP * (net - way * level) / (MASS + carries(k * STEP, y, v))
        v = 0.0 if faster * way < 0.0 else faster
        y += STEP * v
    t, force, y = np.array(rows).T
    return Recording(t, force, y + 1e-6 * rng.standard_normal(len(y)), sample_time=0.01, loop="closed")
