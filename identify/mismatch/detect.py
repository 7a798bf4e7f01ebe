"""What could still hide: the smallest size of each effect that these recordings would have shown.

What an effect of a given size would add to the evidence is known from the predictor's response to it, past what the
baseline swallows; how much of that luck may take away, from how the recording's own errors happen to resemble the
response, block by block. The smallest size is the one that still earns its name with bad luck (`rules.refusal`), and
somewhat more.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.mismatch.compare import BLOCKS, Fit, block_sums
from identify.mismatch.guise import Guise
from identify.mismatch.inverse import effect_force
from identify.mismatch.result import Hidden
from identify.mismatch.rules import BIC_STRONG, SMALLEST, Z_STRONG, constant_of
from identify.mismatch.score import extend, spanned
from identify.mismatch.wandering import LEAST, STEP

Floats = NDArray[np.float64]

LUCK = 1.3  # standard deviations: nine times of ten, luck is not worse
SAFE = 1.6  # times that size: free runs and other names ask for more (9950-9961 of `make promises`: 69 % without it)
MARGIN = 2.0  # times the smallest size that may be named at all: it is found too small now and then
USUAL = 0.75  # of an effect's shapes (places, durations) show at the size that is told; the others are harder to see
GRID = np.geomspace(0.01, 100.0, 120)  # times a starting size: sizes that are looked at


def detectable(fit: Fit, guises: list[Guise]) -> dict[str, Hidden]:
    """Per effect: size of its first parameter, and force, that would have been named with a power of 0.9.

    An effect that no size would show surely is missing: one that the baseline's own constant takes for its own, one
    whose evidence comes from too few places.
    """
    error, slope = fit.problem.jacobian(fit.x, fit.found.gain)
    scene = _Scene(fit, error, spanned(slope), float(error @ error) / len(error))
    found: dict[str, Hidden] = {}
    for guise in guises:
        hidden = _constant(fit, guise) if guise.name == "force_offset" else _smallest(scene, guise)
        if hidden is not None and (guise.name not in found or hidden.force_rms < found[guise.name].force_rms):
            found[guise.name] = hidden
    return found


@dataclass(frozen=True, slots=True, eq=False)
class _Scene:
    """What the baseline leaves: its errors (n,), directions that it swallows (n, k), variance of the errors."""

    fit: Fit
    error: Floats
    basis: Floats
    variance: float

    def named(self, change: Floats, price: float) -> NDArray[np.bool_]:
        """Whether an effect with this response (n,) would be named at `GRID` times its size, with bad luck."""
        expected = block_sums(change**2)[:, None] * (0.5 * GRID**2 / self.variance)
        luck = block_sums(change * self.error)[:, None] * (GRID / self.variance)
        gained = expected.sum(axis=0) - LUCK * np.linalg.norm(luck, axis=0)
        spread = np.sqrt(expected.var(axis=0, ddof=1) + np.mean(luck**2, axis=0)) * np.sqrt(BLOCKS)
        return np.asarray((2.0 * gained - price > -BIC_STRONG) & (gained > Z_STRONG * spread), dtype=np.bool_)


def _constant(fit: Fit, guise: Guise) -> Hidden | None:
    """A constant force: its whole interval beyond what the axis file allows; None where the baseline has it free."""
    if not fit.problem.gravity_known:
        return None
    there, half = constant_of(fit)
    force = fit.problem.ordinary_constant + abs(there) + 2.0 * half  # it may be found that much nearer to none
    return Hidden(force, guise.effect.parameters[0].unit_on(fit.problem.axis), force)


def _smallest(scene: _Scene, guise: Guise) -> Hidden | None:
    """The smallest size of one guise that would be named in most of its shapes; None where there is none."""
    fit = scene.fit
    starts = guise.scaled_starts()
    problem, x = extend(fit, guise, starts)
    with np.errstate(all="ignore"):
        change = problem.errors(x, fit.found.gain) - scene.error[:, None]
        stays = np.abs(change).max(axis=0) <= np.ptp(problem.samples.position)  # a model that runs away shows nothing
    change = np.where(stays, change, 0.0)
    change = change - scene.basis @ (scene.basis.T @ change)
    price = guise.size * float(np.log(problem.samples.used))
    named = np.stack([scene.named(one, price) for one in change.T])
    amplitude = guise.amplitude()
    linear = amplitude is not None or guise.wave is not None
    if linear:
        times = np.array([GRID[_from(one)] if _from(one) < len(GRID) else np.inf for one in named])
        chosen = int(np.argsort(times)[int(np.ceil(USUAL * len(times))) - 1])
        start, stretch = starts[chosen].copy(), float(times[chosen])
        where = slice(-2, None) if guise.wave is not None or amplitude is None else slice(amplitude, amplitude + 1)
    else:  # a stiffness, a limit: the faintest start that would be named as it is
        enough = np.flatnonzero(named[:, int(np.argmin(np.abs(np.log(GRID))))])
        if not len(enough):
            return None
        chosen = int(enough[np.argmin(np.einsum("ns,ns->s", change, change)[enough])])
        start, stretch, where = starts[chosen].copy(), 1.0, slice(0, 0)
    if not np.isfinite(stretch):
        return None
    start[where] *= stretch
    x[0, problem.slot(guise)] = start
    rms, acting = effect_force(problem, x[0], guise)
    smallest = LEAST[0] if guise.name == STEP else SMALLEST
    least = MARGIN * max(smallest * fit.dry_level / max(acting, 1e-300), _least(guise, start))
    if linear:
        more = max(SAFE, least)
        start[where] *= more
        rms *= more
    elif least > 1.0:
        return None
    low, high = guise.bounds()
    if (np.abs(start[where]) > np.maximum(np.abs(low[where]), np.abs(high[where]))).any():
        return None
    parameter = guise.effect.parameters[0]
    if guise.wave is not None:
        parameter = next(p for p in guise.effect.parameters if p.name == guise.wave[0])
    index = guise.effect.parameters.index(parameter)
    value = float(guise.values(start[None])[index, 0])
    return Hidden(abs(value), parameter.unit_on(problem.axis), rms)


def _from(named: NDArray[np.bool_]) -> int:
    """Index of the smallest size from which on all are named; their number where the largest is not."""
    return 0 if named.all() else len(named) - int(np.argmin(named[::-1]))


def _least(guise: Guise, start: Floats) -> float:
    """How many times larger the first parameter must be to be a finding. [1]"""
    first = abs(float(guise.unknowns[0].value(start[:1])[0]))
    return guise.least / max(first, 1e-300)
