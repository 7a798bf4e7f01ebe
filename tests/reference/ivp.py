"""Third opinion: SciPy's solve_ivp as a stick/slip machine with events, equations written down anew, nothing compiled.

Takes the drive force as a smooth function of time and stops only at its few events, so its errors have nothing in
common with those of a fixed-step march. Slow; for the baseline and the effects without memory of rests.
"""

import math

import numpy as np
from scipy.integrate import solve_ivp


class SmoothMachine:
    """Equations of effects.md for a `ReferencePlant` under a smooth command force(t) [N]."""

    def __init__(self, plant, force):
        self.plant, self.force = plant, force
        self.effects = {name: dict(values) for name, values in plant.effects.items()}
        self.bristles = "presliding_hysteresis" in self.effects
        self.two = "transmission_compliance" in self.effects

    def of(self, name, key, default=0.0):
        return self.effects.get(name, {}).get(key, default)

    def drive(self, t, y, lagged):
        """Force of the motor at the belt, and the ripple to subtract from it."""
        u = lagged if "actuator_lag" in self.effects else self.limited(t)
        u *= 1 + self.of("torque_scale_error", "relative_error")
        period = self.of("torque_ripple", "period", 1.0)
        ripple = self.of("torque_ripple", "amplitude") * math.cos(
            2 * math.pi * y / period + self.of("torque_ripple", "phase")
        )
        e, phase = self.of("pulley_eccentricity", "relative_eccentricity"), self.of("pulley_eccentricity", "phase")
        return u / (1 + e * math.cos(y / self.plant.Rc + phase)), ripple

    def limited(self, t):
        limit = self.of("torque_saturation", "limit", math.inf) * self.plant.gain
        return min(max(self.force(max(t - self.of("dead_time", "delay"), 0.0)), -limit), limit)

    def level(self, t, y, speed, direction, carried):
        """Dry friction in a direction."""
        p = self.plant
        coulomb = p.coulomb_force + (self.of("step_change", "step") if t > self.of("step_change", "time") else 0.0)
        dry = coulomb + (p.static_force - coulomb) * math.exp(-((speed / p.stribeck_velocity) ** p.stribeck_exponent))
        slope, middle = (self.of("position_dependent_friction", key) for key in ("relative_slope", "middle"))
        dry *= max(0.0, 1 + slope * (y - middle)) * (1 + self.of("coulomb_asymmetry", "asymmetry_ratio") * direction)
        dry += self.of("load_dependent_friction", "coefficient") * abs(carried)
        centre, width = self.of("rail_defect", "centre"), self.of("rail_defect", "width", 1.0)
        return max(0.0, dry + self.of("rail_defect", "amplitude") * math.exp(-((y - centre) ** 2) / (2 * width**2)))

    def pull(self, t, state):
        """(what moves the load against friction, what the transmission carries)."""
        y, v, ym, vm, _, lagged = state
        if self.two:
            belt = self.effects["transmission_compliance"]
            carried, ripple = belt["stiffness"] * (ym - y) + belt["damping"] * (vm - v), 0.0
        else:
            carried, ripple = self.drive(t, y, lagged)
        stop = max(0.0, y - self.of("end_stop", "position", math.inf)) * self.of("end_stop", "stiffness")
        spring = self.of("position_spring", "stiffness") * (y - self.of("position_spring", "rest_position"))
        return carried - ripple - self.plant.weight - self.of("force_offset", "force") - spring - stop, carried

    def smooth_friction(self, t, v, direction):
        drop, tau = self.of("thermal_drift", "relative_drop"), self.of("thermal_drift", "time_constant", 1.0)
        side = 1 + self.of("viscous_asymmetry", "asymmetry_ratio") * direction
        viscous = self.plant.viscous_coefficient * side * (1 + drop * math.exp(-t / tau))
        return viscous * v + self.of("quadratic_drag", "coefficient") * v * abs(v)

    def rates(self, t, state, mode):
        y, v, ym, vm, z, lagged = state
        pull, carried = self.pull(t, state)
        direction = math.copysign(1.0, v) if self.bristles else mode
        z_rate = 0.0
        if self.bristles:
            bristle = self.effects["presliding_hysteresis"]
            level = self.level(t, y, abs(v), direction, carried)
            z_rate = v - bristle["bristle_stiffness"] * abs(v) * z / level
            dry = bristle["bristle_stiffness"] * z + bristle["bristle_damping"] * z_rate
        else:
            dry = mode * self.level(t, y, abs(v), mode, carried)
        load = self.plant.M + self.of("inertia_error", "mass_error")
        motor = self.plant.J / self.plant.Rc**2
        a = 0.0
        if mode or self.bristles:
            a = (pull - dry - self.smooth_friction(t, v, direction)) / (load if self.two else load + motor)
        push, ripple = self.drive(t, ym, lagged)
        motor_a = (push - ripple - carried) / motor if self.two else 0.0
        lag_rate = (
            (self.limited(t) - lagged) / self.of("actuator_lag", "time_constant")
            if "actuator_lag" in self.effects
            else 0
        )
        return [v if mode or self.bristles else 0.0, a, vm if self.two else v, motor_a, z_rate, lag_rate]

    def margins(self, t, state):
        pull, carried = self.pull(t, state)
        up = self.level(t, state[0], 0.0, 1.0, carried) - pull
        return up, self.level(t, state[0], 0.0, -1.0, carried) + pull


def solve(plant, force, times, *, tolerance=1e-11):
    """Positions (n,) of the load at `times` from rest at 0, for a smooth command `force(t)` [N]."""
    machine = SmoothMachine(plant, force)
    breaks = [machine.of("step_change", "time")] if "step_change" in machine.effects else []
    state, t, mode = np.array([0.0, 0, 0, 0, 0, machine.limited(0.0)]), float(times[0]), 0.0
    method = "LSODA" if machine.bristles or machine.two else "DOP853"
    out = np.zeros(len(times))
    while t < times[-1]:
        if not machine.bristles and mode == 0.0:
            up, down = machine.margins(t, state)
            mode = 1.0 if up <= 0 and up < down else (-1.0 if down <= 0 else 0.0)
        end = min([b for b in breaks if b > t + 1e-12], default=times[-1])
        sol = solve_ivp(
            machine.rates, (t, end), state, method, args=(mode,), events=_events(machine, mode), dense_output=True,
            rtol=tolerance, atol=tolerance * 1e-2, max_step=0.02,
        )  # fmt: skip
        inside = (times >= t) & (times <= sol.t[-1] + 1e-12)
        out[inside] = sol.sol(np.minimum(times[inside], sol.t[-1]))[0]
        t, state = sol.t[-1], sol.y[:, -1].copy()
        if sol.status == 1:
            mode = _next_mode(machine, t, state, mode)
    return out


def _events(machine, mode):
    if machine.bristles:
        return None
    if mode:
        return [_terminal(lambda t, x, m: m * x[1])]
    return [_terminal(lambda t, x, m, side=side: machine.margins(t, x)[side]) for side in (0, 1)]


def _terminal(function):
    function.terminal, function.direction = True, -1.0
    return function


def _next_mode(machine, t, state, mode):
    up, down = machine.margins(t, state)
    if mode == 0.0:
        return 1.0 if up < down else -1.0
    state[1] = 0.0
    return 1.0 if up < 0 else (-1.0 if down < 0 else 0.0)
