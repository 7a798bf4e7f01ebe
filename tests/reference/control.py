"""Loops that run inside the simulation: what a drive does with a quantised, noisy position at its own cycle."""

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from .physics import FAST

OPEN, PD, CASCADE, RELAY = 0.0, 1.0, 2.0, 3.0


@dataclass(frozen=True)
class Loop:
    """A position loop, in forces at the belt.

    Attributes:
        kind: PD, CASCADE (position P, speed PI) or RELAY (+-`stiffness` N, turned round where the position is further
            from the reference position than the reference speed, read as a length).
        stiffness: PD: N/m. CASCADE: 1/s. RELAY: N.
        damping: PD and CASCADE: N·s/m on the speed error.
        integral: CASCADE: N/m, integral of the speed error.
        bias: constant feed-forward, e.g. the weight; also what the drive gives before the first cycle. [N]
        limit: of the commanded force, with anti-windup. [N]
        position_step, force_step: resolution of sensor and command, 0 = none.
        period: cycle. [s]
        smoothing: time constant of the speed estimate. [s]
        mass: acceleration feed-forward. [kg]
        motor_side: the loop sees the motor instead of the load.
    """

    kind: float = PD
    stiffness: float = 2e4
    damping: float = 1e3
    integral: float = 0.0
    bias: float = 0.0
    limit: float = math.inf
    position_step: float = 0.0
    force_step: float = 0.0
    period: float = 1e-3
    smoothing: float = 2e-3
    mass: float = 0.0
    motor_side: bool = False

    def as_array(self) -> np.ndarray:
        """Numbers for `command_from`, in its order."""
        return np.array([
            self.kind, self.stiffness, self.damping, self.integral, self.bias, self.limit, self.position_step,
            self.force_step, self.period, self.smoothing, self.mass, float(self.motor_side),
        ])  # fmt: skip


NO_LOOP = np.zeros(12)


@njit(**FAST)
def on_grid(value, step):
    """Round to the resolution `step`; 0 = exact."""
    return step * np.round(value / step) if step > 0.0 else value


@njit(**FAST)
def command_from(loop, reference, x, noise, memory):
    """Force the loop commands now. memory: started, last position, speed, integral, direction of the relay."""
    seen = on_grid((x[2] if loop[11] > 0.0 else x[0]) + noise, loop[6])
    if memory[0] == 0.0:
        memory[0], memory[1], memory[2], memory[4] = 1.0, seen, 0.0, 1.0
    rate = (seen - memory[1]) / loop[8]
    memory[1] = seen
    memory[2] += (rate - memory[2]) * loop[8] / (loop[8] + loop[9])
    error = reference[0] - seen
    if loop[0] == RELAY:
        if abs(error) > reference[1]:
            memory[4] = 1.0 if error > 0.0 else -1.0
        return on_grid(loop[4] + memory[4] * loop[1], loop[7])
    feed = loop[4] + loop[10] * reference[2]
    if loop[0] == PD:
        force = feed + loop[1] * error + loop[2] * (reference[1] - memory[2])
        return on_grid(min(max(force, -loop[5]), loop[5]), loop[7])
    wanted = loop[1] * error + reference[1] - memory[2]
    integral = memory[3] + loop[3] * loop[8] * wanted
    force = feed + loop[2] * wanted + integral
    if abs(force) <= loop[5]:
        memory[3] = integral
    return on_grid(min(max(force, -loop[5]), loop[5]), loop[7])
