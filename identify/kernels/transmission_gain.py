"""Gains of the disturbance observer for machines of two masses, of which one is measured.

A rigid machine's gains move motor and load alike: a transmission that rings after a break-away nobody foretells would
be quieted by nothing but its damping, which a fit then makes too large. The steady-state Kalman gains of both masses
are from the discrete Riccati equation, by structure-preserving doubling (Chu, Fan, Lin & Wang 2004, Int. J. Control 77:
767-788). The latent force acts on the load; white noise between the masses, which a rigid machine would not feel,
stands for the jolts at break-away and reversal that no slow force follows.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from plant.kernels.laws import DAMPING, LANES, MASS, MOTOR_MASS, MOTOR_POSITION, STIFFNESS

Floats = NDArray[np.float64]

# Rows of the gains, the first four those of a rigid machine. In a gap both masses are moved alike, by the last three.
LOAD, LOAD_SPEED, LATENT, DECAY, MOTOR, MOTOR_SPEED_GAIN, ALIKE, ALIKE_SPEED, ALIKE_LATENT, GAINS = range(10)
JOLTS = 0.008  # s: white noise between the masses is as strong as the latent force, were that white over so long a time

STATES = 5  # y and v T_s of the load, of the motor, and d T_s^2
TERMS, SMALL = 8, 0.25  # of the series of the exponential, and the norm it is taken at: exact to 1e-11
DOUBLINGS, STEADY = 40, 1e-10  # at most, and the relative change of the covariance that ends them
RIGID = 1e9  # of k T_s^2/m and d T_s/m: beyond it the masses move alike
STEADYING = 1e-12  # of the noise of d: on all other states, so that none is certain


@njit(cache=True, nogil=True)
def _transition(load: float, motor: float, stiffness: float, damping: float, step: float, decay: float) -> Floats:
    """Of the state from sample to sample: the matrix exponential, d held in between. (STATES, STATES)."""
    k, c = stiffness * step * step, damping * step
    a = np.zeros((STATES, STATES))
    a[0, 1] = a[2, 3] = 1.0
    a[1, 0], a[1, 1], a[1, 2], a[1, 3], a[1, 4] = -k / load, -c / load, k / load, c / load, (load + motor) / load
    a[3, 0], a[3, 1], a[3, 2], a[3, 3] = k / motor, c / motor, -k / motor, -c / motor
    halvings = max(0, int(np.ceil(np.log2(np.abs(a).sum(axis=1).max() / SMALL))))
    a /= 2.0**halvings
    term, total = np.eye(STATES), np.eye(STATES)
    for i in range(1, TERMS + 1):
        term = term @ a / i
        total += term
    for _ in range(halvings):
        total = total @ total
    total[4, 4] = decay
    return total


@njit(cache=True, nogil=True)
def _covariance(transition: Floats, measured: int, noise: Floats) -> Floats:
    """Of the state before it is corrected, in steady state, of the sensor's variance. (STATES, STATES)."""
    one = np.eye(STATES)
    a, g, h = transition.T.copy(), np.zeros((STATES, STATES)), noise
    g[measured, measured] = 1.0
    for _ in range(DOUBLINGS):
        shrunk = np.linalg.inv(one + g @ h)
        ahead = a @ shrunk
        more = a.T.copy() @ (h @ shrunk) @ a
        g = g + ahead @ g @ a.T.copy()
        a = ahead @ a
        h = h + more
        if np.trace(more) <= STEADY * np.trace(h):
            break
    return h


@njit(cache=True, nogil=True)
def transmission_gains(block: Floats, rigid: Floats, observed: int, sample_time: float, machines: int) -> Floats:
    """Gains as `identify.kernels.machine_predictor.predict_machine` takes them of two masses.

    Args:
        block: the machines, see `plant.kernels.laws`. (rows * LANES,)
        rigid: gains of `identify.observer` of each. (5, LANES)
        observed: row of the measured position, `POSITION` or `MOTOR_POSITION`.
        sample_time: T_s. [s]
        machines: how many of the block are of interest; the others get the gains of the last of them.

    Returns:
        rows `LOAD` [1], `LOAD_SPEED` [1/s], `LATENT` [1/s^2], `DECAY` [1], `MOTOR` [1], `MOTOR_SPEED_GAIN` [1/s], and
        `ALIKE` [1], `ALIKE_SPEED` [1/s], `ALIKE_LATENT` [1/s^2] of a gap. (GAINS, LANES)
    """
    out = np.empty((GAINS, LANES))
    out[:4] = rigid[:4]
    out[MOTOR:ALIKE] = rigid[:2]
    out[ALIKE:] = rigid[:3]
    measured = 2 if observed == MOTOR_POSITION else 0
    for j in range(machines):
        load, motor, decay = block[MASS + j], block[MOTOR_MASS + j], rigid[3, j]
        stiffness, damping = block[STIFFNESS + j], block[DAMPING + j]
        lighter = min(load, motor)
        strength = rigid[4, j] * sample_time * sample_time
        soft = max(stiffness * sample_time, damping) * sample_time < RIGID * lighter
        if strength == 0.0 or not soft:
            continue
        noise = np.zeros((STATES, STATES))
        noise[4, 4] = strength * strength * (1.0 - decay * decay)
        for i in range(4):
            noise[i, i] = STEADYING * noise[4, 4]
        jolt = strength * strength * (load + motor) * (load + motor) * JOLTS / sample_time
        noise[1, 1] += jolt / (load * load)
        noise[3, 3] += jolt / (motor * motor)
        noise[1, 3] -= jolt / (load * motor)
        noise[3, 1] -= jolt / (load * motor)
        transition = _transition(load, motor, stiffness, damping, sample_time, decay)
        covariance = _covariance(transition, measured, noise)
        gain = covariance[:, measured] / (covariance[measured, measured] + 1.0)
        out[LOAD, j], out[LOAD_SPEED, j] = gain[0], gain[1] / sample_time
        out[MOTOR, j], out[MOTOR_SPEED_GAIN, j] = gain[2], gain[3] / sample_time
        out[LATENT, j] = gain[4] / (sample_time * sample_time)
    for j in range(machines, LANES):
        out[:, j] = out[:, machines - 1]
    return out
