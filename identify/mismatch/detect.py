"""What could still hide: the smallest size of each effect that these recordings would have shown."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from identify.mismatch.compare import Fit
from identify.mismatch.guise import Guise
from identify.mismatch.inverse import effect_force
from identify.mismatch.result import Hidden
from identify.mismatch.score import extend, swallowed

Floats = NDArray[np.float64]

NEEDED = 90.0  # expected evidence at which a name is given nine times of ten: the rule's 25, its z, and its luck


def detectable(fit: Fit, guises: list[Guise]) -> dict[str, Hidden]:
    """Per effect: size of its first parameter, and force, that would have been named with a power of 0.9."""
    error, slope = fit.problem.jacobian(fit.x, fit.found.gain)
    basis = swallowed(fit.problem, error, slope)
    variance = float(error @ error) / len(error)
    found: dict[str, Hidden] = {}
    for guise in guises:
        hidden = _smallest(fit, guise, error, basis, variance)
        if hidden is not None and (guise.name not in found or hidden.force_rms < found[guise.name].force_rms):
            found[guise.name] = hidden
    return found


def _smallest(fit: Fit, guise: Guise, error: Floats, basis: Floats, variance: float) -> Hidden | None:
    """The smallest size of one guise, at its most visible starting point; None where it shows nowhere."""
    starts = guise.scaled_starts()
    problem, x = extend(fit, guise, starts)
    with np.errstate(all="ignore"):
        change = problem.errors(x, fit.found.gain) - error[:, None]
    change = np.where(np.isfinite(change).all(axis=0), change, 0.0)
    change = change - basis @ (basis.T @ change)
    seen = np.einsum("ns,ns->s", change, change) / variance
    amplitude = guise.amplitude()
    if amplitude is None and guise.wave is None:
        enough = np.flatnonzero(seen >= NEEDED)
        if not len(enough):
            return None
        chosen = int(enough[np.argmin(seen[enough])])
        start = starts[chosen]
    else:
        chosen = int(np.argmax(seen))
        if seen[chosen] <= 0:
            return None
        start = starts[chosen].copy()
        stretch = float(np.sqrt(NEEDED / seen[chosen]))
        where = slice(-2, None) if amplitude is None or guise.wave is not None else slice(amplitude, amplitude + 1)
        start[where] *= stretch
        low, high = guise.bounds()
        if (np.abs(start[where]) > np.maximum(np.abs(low[where]), np.abs(high[where]))).any():
            return None
    parameter = guise.effect.parameters[0]
    if guise.wave is not None:
        parameter = next(p for p in guise.effect.parameters if p.name == guise.wave[0])
    index = guise.effect.parameters.index(parameter)
    value = float(guise.values(start[None])[index, 0])
    x[0, problem.slot(guise)] = start
    force, _ = effect_force(problem, x[0], guise)
    return Hidden(abs(value), parameter.unit_on(problem.axis), force)
