"""The automaton: explicit Runge-Kutta inside a mode, the instant of a change of mode located inside the step."""

import math
import zlib
from pathlib import Path

import numpy as np
from numba import njit

from .control import command_from
from .physics import (
    BRISTLE,
    FAST,
    INPUTS,
    MEMORY,
    STATES,
    V,
    belt_force,
    dry_level,
    hold_margins,
    pull_on_load,
    rates,
    rest_state,
)

IMPACT = 64  # parts of a step in which a hard contact is made or lost
UNSTABLE = 1.0  # largest (rate of the bristles) x (step) of one Runge-Kutta step; stability ends at 2.78


@njit(**FAST)
def runge_kutta(p, t, h, x, s, w, k, tmp, out):
    """One classical fourth-order step from x into out; k is (4, STATES) scratch."""
    rates(p, t, x, s, w, k[0])
    for i in range(STATES):
        tmp[i] = x[i] + 0.5 * h * k[0, i]
    rates(p, t + 0.5 * h, tmp, s, w, k[1])
    for i in range(STATES):
        tmp[i] = x[i] + 0.5 * h * k[1, i]
    rates(p, t + 0.5 * h, tmp, s, w, k[2])
    for i in range(STATES):
        tmp[i] = x[i] + h * k[2, i]
    rates(p, t + h, tmp, s, w, k[3])
    for i in range(STATES):
        out[i] = x[i] + h / 6.0 * (k[0, i] + 2.0 * (k[1, i] + k[2, i]) + k[3, i])


@njit(**FAST)
def mode_at_rest(p, t, x, w):
    """+1 or -1 where the load breaks away, 0 where friction holds it."""
    up, down = hold_margins(p, t, x, w)
    if up < 0.0:
        return 1.0
    return -1.0 if down < 0.0 else 0.0


@njit(**FAST)
def alarm(p, t, x, s, w):
    """Positive while mode s may go on: speed along s, or the smaller holding margin."""
    if s != 0.0:
        return s * x[V]
    up, down = hold_margins(p, t, x, w)
    return min(up, down)


@njit(**FAST)
def locate(p, t, h, x, s, w, k, tmp, out, first, last):
    """Fraction of the step at which `alarm` passes zero (Illinois false position); leaves the state there in out."""
    a, b, fa, fb = 0.0, 1.0, first, last
    part = 1.0
    for _ in range(30):
        part = (a * fb - b * fa) / (fb - fa)
        runge_kutta(p, t, part * h, x, s, w, k, tmp, out)
        f = alarm(p, t + part * h, out, s, w)
        if abs(f) <= 1e-12 * (abs(first) + abs(last)) or b - a < 1e-9:
            break
        if (f > 0.0) == (fa > 0.0):
            a, fa = part, f
            fb *= 0.5
        else:
            b, fb = part, f
            fa *= 0.5
    return part


@njit(**FAST)
def hybrid_step(p, t, h, x, s, w, k, tmp, out):
    """Advance x by h in place through as many modes as it takes; returns the mode at the end."""
    left = h
    for _ in range(50):
        if s == 0.0:
            x[V] = 0.0
            s = mode_at_rest(p, t, x, w)
        first = alarm(p, t, x, s, w)
        runge_kutta(p, t, left, x, s, w, k, tmp, out)
        last = alarm(p, t + left, out, s, w)
        if last >= 0.0:
            x[:] = out
            return s
        if first <= 0.0:  # broke away and fell back within one step: it rests
            s = 0.0
            runge_kutta(p, t, left, x, s, w, k, tmp, out)
            x[:] = out
            return s
        part = locate(p, t, left, x, s, w, k, tmp, out, first, last)
        x[:] = out
        t += part * left
        left *= 1.0 - part
        x[V] = 0.0
        if p.belt <= 0.0:
            x[3] = 0.0
        s = mode_at_rest(p, t, x, w) if s != 0.0 else mode_of_breakaway(p, t, x, w)
        if left <= 1e-15:
            return s
    return s


@njit(**FAST)
def mode_of_breakaway(p, t, x, w):
    """Direction of the smaller margin: at the located instant one of them is zero."""
    up, down = hold_margins(p, t, x, w)
    return 1.0 if up < down else -1.0


@njit(**FAST)
def bristle_steps(p, t, h, x, w, k, tmp, out):
    """Advance x by h in place; fast sliding over stiff bristles takes shorter steps."""
    _, carried, _ = pull_on_load(p, t, x, w)
    level = max(dry_level(p, t, x, np.sign(x[V]), x[MEMORY] if p.memory > 0.0 else abs(x[V]), carried, w), 1e-9)
    mass = p.load_mass if p.belt > 0.0 else p.load_mass + p.motor_mass
    fastest = p.bristle * (abs(x[V]) + 1e-3) / level + p.bristle_damping / mass
    parts = max(1, math.ceil(h * fastest / UNSTABLE))
    for i in range(parts):
        runge_kutta(p, t + i * h / parts, h / parts, x, 0.0, w, k, tmp, out)
        x[:] = out


@njit(**FAST)
def any_step(p, t, h, x, s, w, k, tmp, out):
    """Advance x by h in place, with or without bristles; returns the mode at the end."""
    if p.bristle > 0.0:
        bristle_steps(p, t, h, x, w, k, tmp, out)
        return s
    return hybrid_step(p, t, h, x, s, w, k, tmp, out)


@njit(**FAST)
def contact_step(p, t, h, x, s, w, k, tmp, out, saved):
    """Advance x by h in place; a step in which a gap opens or closes is done again in `IMPACT` parts."""
    if p.gap <= 0.0:
        return any_step(p, t, h, x, s, w, k, tmp, out)
    saved[:] = x
    side = np.sign(belt_force(p, x))
    end = any_step(p, t, h, x, s, w, k, tmp, out)
    if np.sign(belt_force(p, x)) == side:
        return end
    x[:] = saved
    for i in range(IMPACT):
        s = any_step(p, t + i * h / IMPACT, h / IMPACT, x, s, w, k, tmp, out)
    return s


@njit(**FAST)
def aim(w, t, stamps, command, outer, j, now, linear):
    """Set the inputs valid from t: command sample j (delayed), outer series at stamp `now`; linear or held."""
    w[0] = t
    w[2] = 0.0
    w[1] = command[max(j, 0)]
    width = stamps[now + 1] - stamps[now]
    for row in range(3):
        slope = (outer[row, now + 1] - outer[row, now]) / width
        w[3 + 2 * row] = outer[row, now] + slope * (t - stamps[now])
        w[4 + 2 * row] = slope
    return w


@njit(**FAST)
def lean(w, t, stamps, command, j, delay):
    """Linear torque between samples: value at t and slope, of the command as it was `delay` ago."""
    if j < 0 or j + 1 >= len(stamps):
        return
    slope = (command[j + 1] - command[j]) / (stamps[j + 1] - stamps[j])
    w[1] = command[j] + slope * (t - delay - stamps[j])
    w[2] = slope


@njit(**FAST)
def store(p, t, x, s, w, row):
    """Write what is observed at a stamp."""
    row[0], row[1], row[2] = x[0], x[1], x[2]
    row[3] = pull_on_load(p, t, x, w)[2]
    row[4] = s if p.bristle <= 0.0 else x[BRISTLE]
    row[5], row[6], row[7] = x[10], x[11], x[9]


def _compiled(source):
    @njit(cache=True, **FAST)
    def march(record, stamps, command, linear, outer, loop, reference, noise, start, settled, step, trace):
        """Run the machine over all stamps.

        stamps (n,), command (n,) read (open loop) or written (loop kind > 0), outer (3, n) force, level and factor,
        reference (3, n) position, speed, acceleration, noise (n,) of the position the loop sees, start (2,) position
        and speed, trace (8, n) written as `store` says.
        """
        p = record[0] if source else record[-1]  # `source` makes an edited equation a new key of numba's cache
        n = len(stamps)
        k, tmp, out, saved = np.zeros((4, STATES)), np.zeros(STATES), np.zeros(STATES), np.zeros(STATES)
        w, memory = np.zeros(INPUTS), np.zeros(8)
        w[0], w[1] = stamps[0], command[0]
        w[3], w[5], w[7] = outer[0, 0], outer[1, 0], outer[2, 0]
        if loop[0] > 0.0:
            w[1] = loop[4]  # the drive holds the weight before the loop starts
        x = rest_state(p, w, start[0], start[1], settled)
        s = np.sign(x[V])
        j = -1
        jump, p.step = p.step, 0.0  # switched on at its instant, which is a stop of the march
        for now in range(n):
            t = stamps[now]
            if jump != 0.0 and t >= p.step_time - 1e-12:
                p.step = jump
            if loop[0] > 0.0:
                command[now] = command_from(loop, reference[:, now], x, noise[now], memory)
            store(p, t, x, s, w, trace[:, now])
            if now == n - 1:
                break
            end = stamps[now + 1]
            while t < end - 1e-12:
                while j < now and stamps[j + 1] + p.delay <= t + 1e-12:
                    j += 1
                stop = end
                if j < now:
                    stop = min(stop, stamps[j + 1] + p.delay)
                if jump != 0.0 and t < p.step_time - 1e-12:
                    stop = min(stop, p.step_time)
                elif jump != 0.0:
                    p.step = jump
                aim(w, t, stamps, command, outer, j, now, linear)
                if j < 0 and loop[0] > 0.0:
                    w[1] = loop[4]
                if linear:
                    lean(w, t, stamps, command, j, p.delay)
                parts = max(1, math.ceil((stop - t) / step - 1e-9))
                h = (stop - t) / parts
                for i in range(parts):
                    s = contact_step(p, t + i * h, h, x, s, w, k, tmp, out, saved)
                t = stop
        return x

    return march


_FILES = [Path(__file__).with_name(name) for name in ("physics.py", "integrator.py", "control.py", "parameters.py")]
march = _compiled(zlib.crc32(b"".join(file.read_bytes() for file in _FILES)))
