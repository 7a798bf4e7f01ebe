"""The baseline model as a problem an optimiser can work on: scaled unknowns, bounds, weak priors, prediction errors.

Unknowns: the four friction parameters of eq. (1), a constant force on the friction side, the moving mass where the
axis file does not know it, and position and velocity at the start of each run. Forces are scaled with the largest drive
force seen, speeds and masses are logarithmic, so that a unit step means the same to every unknown.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from identify.kernels.predictor import WIDTH, predict
from identify.preprocess import Samples, smooth_velocity
from plant.axis import Axis

Floats = NDArray[np.float64]

LONGEST_SUBSTEP = 0.005  # s: 40 um over a free run of 20 s, far less in one-second runs; good enough to search
FINEST_SUBSTEP = 0.001  # s: 1 um over a free run of 20 s; the last polish and the intervals use it
OFFSET_PRIOR = 0.01  # of rated force, where mass and gravity are known (docs/identification.md)
DIFFERENCE = 1e-5  # of a scaled unknown: sqrt of the rounding of a one-step error


@dataclass(frozen=True)
class Scales:
    """Typical sizes in one recording: force [N], speed [m/s], travel [m], mass [kg]."""

    force: float
    speed: float
    travel: float
    mass: float


def scales_of(samples: Samples, axis: Axis) -> Scales:
    """Measure the sizes that scale the unknowns."""
    driving = samples.force - axis.mechanics.weight
    speed = float(np.quantile(np.abs(smooth_velocity(samples)), 0.98))
    travel = float(np.ptp(samples.position))
    return Scales(
        force=max(float(np.quantile(np.abs(driving), 0.99)), 1e-9),
        speed=max(speed, 1e-9),
        travel=travel,
        mass=axis.mechanics.moving_mass,
    )


class FrictionProblem:
    """Prediction errors of the baseline model for scaled unknowns x.

    The first `p` entries of x are F_c, F_s, log v_s, F_v, F_0 and, where unknown, log m_e, all scaled; then y and v of
    each run's first sample.
    """

    def __init__(
        self,
        samples: Samples,
        axis: Axis,
        *,
        scales: Scales | None = None,
        first_state: Floats | None = None,
        longest_substep: float = LONGEST_SUBSTEP,
    ) -> None:
        """Measure scales and first states (runs, 2) once, unless they are given; `longest_substep` in s."""
        self.samples, self.axis = samples, axis
        self.scales = scales_of(samples, axis) if scales is None else scales
        self._first_state = first_state
        self.estimates_mass = not axis.mechanics.inertia_known
        self.p = 6 if self.estimates_mass else 5
        self.substeps = max(1, int(np.ceil(samples.sample_time / longest_substep - 1e-9)))
        self._buffers: dict[int, Floats] = {}
        self._last: tuple[bytes, Floats, Floats] | None = None

    def refined(self, longest_substep: float = FINEST_SUBSTEP) -> FrictionProblem:
        """The same problem marched in finer steps: dearer, and right to the micrometre."""
        return FrictionProblem(
            self.samples,
            self.axis,
            scales=self.scales,
            first_state=self.first_state,
            longest_substep=longest_substep,
        )

    def on(self, samples: Samples, first_state: Floats | None = None) -> FrictionProblem:
        """The same model on other samples, in the same scales."""
        return FrictionProblem(samples, self.axis, scales=self.scales, first_state=first_state)

    def pinned(self, index: int, value: float) -> FrictionProblem:
        """The same problem with one scaled unknown held at `value`."""
        held = self.refined(self.samples.sample_time / self.substeps)
        low, high = (edge.copy() for edge in self.bounds)
        low[index] = high[index] = value
        held.bounds = low, high
        return held

    def masked(self, samples: Samples) -> FrictionProblem:
        """This very problem, steps and first states included, on samples of the same runs with others left out."""
        own = self.samples.sample_time / self.substeps
        return self.on(samples, self.first_state).refined(own)

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.p + 2 * self.samples.runs

    @cached_property
    def start_unit(self) -> tuple[float, float]:
        """Sizes of the start unknowns: position [m] and velocity [m/s]."""
        return 0.02 * self.scales.travel, 0.2 * self.scales.speed

    @cached_property
    def first_state(self) -> Floats:
        """Measured position and smoothed velocity at each run's start. (runs, 2)"""
        if self._first_state is not None:
            return self._first_state
        velocity = smooth_velocity(self.samples)
        return np.stack([self.samples.position[self.samples.first], velocity[self.samples.first]], axis=1)

    @cached_property
    def bounds(self) -> tuple[Floats, Floats]:
        """Lowest and highest scaled unknowns. (size,) each"""
        speed = np.log([2e-3, 3.0])
        low = [0.0, 0.0, speed[0], 0.0, -1.5]
        high = [1.5, 3.0, speed[1], 3.0, 1.5]
        if self.estimates_mass:
            low, high = [*low, -np.log(5.0)], [*high, np.log(5.0)]
        edge = np.full(2 * self.samples.runs, 5.0)
        return np.concatenate([low, -edge]), np.concatenate([high, edge])

    @cached_property
    def prior(self) -> tuple[Floats, Floats]:
        """Centre and standard deviation of the weak priors; they damp what a recording does not tell. (size,) each"""
        centre = np.zeros(self.size)
        spread = np.ones(self.size)
        centre[:4] = 0.4, 0.5, np.log(0.2), 0.4
        spread[:5] = 2.0, 2.0, 3.0, 3.0, 2.0
        if self.gravity_known:
            spread[4] = self.ordinary_constant / self.scales.force
        if self.estimates_mass:
            spread[5] = np.log(2.0)
        return centre, spread

    def prior_loss(self, x: Floats) -> Floats:
        """What the priors add to the loss of candidates x (m, size). (m,)"""
        centre, spread = self.prior
        away = (x - centre) / spread
        return np.asarray(np.einsum("mi,mi->m", away, away), dtype=np.float64)

    @property
    def gravity_known(self) -> bool:
        """True where weight is known, so that a constant force has a prior of zero."""
        mechanics = self.axis.mechanics
        return mechanics.weight > 0 and mechanics.inertia_known

    @property
    def ordinary_constant(self) -> float:
        """A constant force that any axis may have; beyond it, where weight is known, it is an effect. [N]."""
        return OFFSET_PRIOR * (self.axis.drive.rated_force or self.scales.force)

    def law(self, x: Floats) -> Floats:
        """Rows of the predictor's law for candidates x (m, >= p): F_c, F_s - F_c, 1/v_s, F_v, m_e, M g + F_0. (6, m)"""
        s, mechanics = self.scales, self.axis.mechanics
        m_e = s.mass * np.exp(x[:, 5]) if self.estimates_mass else np.full(len(x), s.mass)
        weight = mechanics.weight * (m_e / s.mass)
        return np.ascontiguousarray(
            [
                x[:, 0] * s.force,
                (x[:, 1] - x[:, 0]) * s.force,
                np.exp(-x[:, 2]) / s.speed,
                x[:, 3] * s.force / s.speed,
                m_e,
                weight + x[:, 4] * s.force,
            ]
        )

    def named(self, x: Floats) -> list[tuple[str, str, float, bool, float]]:
        """Name, unit, value, whether logarithmic, and scale of the first p unknowns of x (size,)."""
        s, axis = self.scales, self.axis
        force, viscous = s.force, s.force / s.speed
        viscous_unit = "N*m*s/rad" if axis.is_rotary else "N*s/m"
        rows = [
            ("coulomb_force", axis.force_unit, x[0] * force, False, force),
            ("static_force", axis.force_unit, x[1] * force, False, force),
            ("stribeck_velocity", f"{axis.position_unit}/s", np.exp(x[2]) * s.speed, True, 1.0),
            ("viscous_coefficient", viscous_unit, x[3] * viscous, False, viscous),
            ("constant_force", axis.force_unit, x[4] * force, False, force),
        ]
        if self.estimates_mass:
            rows.append(("moving_mass", axis.inertia_unit, np.exp(x[5]) * s.mass, True, 1.0))
        return [(name, unit, float(value), log, scale) for name, unit, value, log, scale in rows]

    def encode(self, values: Mapping[str, float]) -> Floats:
        """Scaled unknowns (size,) of parameter `values` by name; names left out take the prior's centre."""
        x = self.prior[0].copy()
        for index, (name, _, _, logarithmic, scale) in enumerate(self.named(x)):
            if name not in values:
                continue
            unit = {"stribeck_velocity": self.scales.speed, "moving_mass": self.scales.mass}.get(name, scale)
            x[index] = np.log(values[name] / unit) if logarithmic else values[name] / unit
        return np.clip(x, *self.bounds)

    @cached_property
    def start_units(self) -> Floats:
        """Sizes of the start unknowns of all runs. (2 runs, 1)"""
        return np.tile(self.start_unit, self.samples.runs)[:, None]

    def start(self, x: Floats) -> Floats:
        """Position and velocity at each run's start for candidates x (m, size). (2 runs, m)"""
        return np.ascontiguousarray(self.first_state.reshape(-1)[:, None] + x[:, self.p :].T * self.start_units)

    def errors(self, x: Floats, gain: Floats) -> Floats:
        """Prediction errors of candidates x (m, size) with gains (5,) or (5, m). (n, m) [m], a reused buffer."""
        m = len(x)
        padded = -(-m // WIDTH) * WIDTH
        fill = np.minimum(np.arange(padded), m - 1)
        x = x[fill] if padded > m else x
        gains = gain[:, fill] if gain.ndim == 2 else np.repeat(gain[:, None], padded, axis=1)
        error = self._buffers.get(padded)
        if error is None:
            error = self._buffers[padded] = np.empty((len(self.samples), padded))
        s = self.samples
        law, start = self.law(x), self.start(x)
        predict(*s.ends, s.position, s.steps, s.run, s.valid, self.substeps, law, start, gains, error)
        return error[:, :m]

    def losses(self, x: Floats, gain: Floats) -> Floats:
        """N log(mean square prediction error) plus priors of candidates x (m, size); inf where a run diverged. (m,)"""
        error = self.errors(x, gain)
        square = np.einsum("nm,nm->m", error, error)
        with np.errstate(invalid="ignore", divide="ignore"):
            loss = self.samples.used * np.log(square / self.samples.used + 1e-300)
        loss += self.prior_loss(x)
        return np.where(np.isfinite(loss), loss, np.inf)

    def jacobian(self, x: Floats, gain: Floats) -> tuple[Floats, Floats]:
        """Prediction errors (n,) and their derivatives (n, size) at x by forward differences, all lanes at once.

        Starts of all runs are moved together: a run's errors depend on its own start alone. The last answer is kept,
        for everything that is asked about an optimum begins with it; do not write into it.
        """
        asked = x.tobytes() + gain.tobytes()
        if self._last is None or self._last[0] != asked:
            self._last = asked, *self.differences(x, gain)
        return self._last[1], self._last[2]

    def differences(self, x: Floats, gain: Floats) -> tuple[Floats, Floats]:
        """The same, always anew."""
        p, step = self.p, DIFFERENCE
        sign = np.where(x + step > self.bounds[1], -1.0, 1.0)
        candidates = np.repeat(x[None], p + 3, axis=0)
        for i in range(p):
            candidates[1 + i, i] += sign[i] * step
        candidates[p + 1, p::2] += step
        candidates[p + 2, p + 1 :: 2] += step
        error = self.errors(candidates, gain)
        base = error[:, 0].copy()
        slope = (error[:, 1:] - base[:, None]) / step
        slope[:, :p] *= sign[:p]
        if self.samples.runs == 1:
            return base, slope
        jacobian = np.zeros((len(base), self.size))
        jacobian[:, :p] = slope[:, :p]
        rows = np.arange(len(base))
        jacobian[rows, p + 2 * self.samples.run] = slope[:, p]
        jacobian[rows, p + 2 * self.samples.run + 1] = slope[:, p + 1]
        return base, jacobian
