"""The 200 random problems of the search study, and what counts as solving one.

The paper's problem (§4.4) with everything drawn anew: both readings, parameters ±30-50 % around the paper's, the sine
of §4.3, n = 2000, noise 1e-3 m (§4.6). Four unknowns in a box of ±60 %, start known; the criterion is eq. (4).
Problems in which the mass hardly moves are drawn again: any friction above the drive force would solve them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.criterion import FREE
from identify.paper_method import PaperProblem
from identify.preprocess import prepare
from plant.friction import StribeckFriction
from plant.presets import READINGS, paper_axis, paper_friction, paper_torque
from plant.recording import Recording
from plant.simulation import simulate

NOISE = 1e-3  # m
SAMPLES = 2000
BOX = 0.6
LEAST_TRAVEL = 0.05  # m
SUCCESS = 1.01  # times the best criterion anybody found


@dataclass(frozen=True, eq=False)
class Case:
    """One problem: the recording, its box (4,) each, and the truth (4,)."""

    recording: Recording
    axis: object
    low: np.ndarray
    high: np.ndarray
    truth: np.ndarray

    def problem(self) -> PaperProblem:
        """Fresh, so that nobody profits from another's caches."""
        return PaperProblem(prepare(self.recording, self.axis), self.axis, (self.low, self.high), np.zeros((1, 2)))


def draw(seed: int) -> Case:
    """Problem number `seed`; even ones read §4.3 literally, odd ones as the bump."""
    reading = READINGS[seed % 2]
    rng = np.random.default_rng([20050704, seed])
    axis = paper_axis(reading)
    nominal = paper_friction(reading).as_array
    torque = paper_torque(axis, samples=SAMPLES)
    while True:
        width = rng.uniform(0.3, 0.5)
        truth = nominal * rng.uniform(1 - width, 1 + width, 4)
        motion = simulate(axis, StribeckFriction(*truth), torque)
        if np.ptp(motion.position) > LEAST_TRAVEL:
            break
    position = motion.position + NOISE * rng.normal(size=SAMPLES)
    recording = Recording(motion.t, axis.mechanics.gain * torque, position, sample_time=axis.stream.sample_time)
    return Case(recording, axis, nominal * (1 - BOX), nominal * (1 + BOX), truth)


def criterion(problem: PaperProblem, x: np.ndarray) -> np.ndarray:
    """Eq. (4) of unknowns x (m, size). (m,)"""
    error = problem.errors(x, FREE)
    return np.einsum("nm,nm->m", error, error) / float(problem.samples.position @ problem.samples.position)
