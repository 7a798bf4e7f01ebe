"""Where effects of the drive, of speed and of direction may be present: mostly one number each."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

from identify.mismatch.guise import CLOCK, Guise, Setting, Unknown, grid
from plant.effects.effect import Effect

SHEET = 0.0075  # relative: how well data sheets know a torque constant or a mass; less is no finding
LOWEST = 0.03  # of the largest command: a loop that winds up asks for many times what the drive can give
REACHED = 1.15  # of the same: the rounded shoulder of a higher limit is a motor that gives less as it is told more


def offset(e: Effect, s: Setting) -> list[Guise]:
    """A constant force, where the baseline does not hold it already."""
    if s.free_offset:  # the baseline holds it already
        return []
    return [Guise(e, (Unknown("force", 0.1 * s.force, -2 * s.force, 2 * s.force),), grid([0.02 * s.force]))]


def ratio(
    parameter: str, unit: float, limit: float, start: float, least: float = 0.0
) -> Callable[[Effect, Setting], list[Guise]]:
    """One dimensionless amplitude between ± limit, no finding below `least`."""

    def make(e: Effect, s: Setting) -> list[Guise]:  # noqa: ARG001
        return [Guise(e, (Unknown(parameter, unit, -limit, limit),), grid([start]), least=least)]

    return make


def drag(e: Effect, s: Setting) -> list[Guise]:
    """Square of the speed."""
    unit = s.force / s.speed**2
    return [Guise(e, (Unknown("coefficient", 0.3 * unit, -3 * unit, 3 * unit),), grid([0.05 * unit]))]


def lag(parameter: str) -> Callable[[Effect, Setting], list[Guise]]:
    """A time between 0 and 0.2 s."""

    def make(e: Effect, s: Setting) -> list[Guise]:
        rows = [v for v in (0.5 * s.sample_time, 2 * s.sample_time, 0.03, 0.08) if v < 0.15]
        least = CLOCK * (s.native_time or s.sample_time)
        return [Guise(e, (Unknown(parameter, 0.02, 0.0, 0.2),), grid(rows), least=least)]

    return make


def saturation(e: Effect, s: Setting) -> list[Guise]:
    """A limit below the peak of the drive force: hard, or with a rounded shoulder that the peak may end in."""
    gain = abs(s.axis.mechanics.gain)
    peak = s.peak / gain
    limit = Unknown("limit", peak, LOWEST * peak, 1.02 * peak, log=True)
    hard = Guise(e, (limit,), grid([share * peak for share in (0.99, 0.97, 0.9, 0.8, 0.65, 0.5, 0.2)]))
    if "knee" not in {p.name for p in e.parameters}:
        return [hard]
    soft = (dataclasses.replace(limit, high=1.5 * peak), Unknown("knee", 0.3, 0.03, 1.0, log=True))
    starts = grid([1.0 * peak, 0.85 * peak, 0.65 * peak], [0.1, 0.4])

    def allows(values: dict[str, float]) -> str | None:
        times = values["limit"] / peak
        return f"with a limit of {times:.2g} times the largest command" if times > REACHED else None

    return [dataclasses.replace(hard, fixed=(("knee", 0.0),)), Guise(e, soft, starts, allows=allows)]


def inertia(e: Effect, s: Setting) -> list[Guise]:
    """More or less mass, weighing or not."""
    if not s.axis.mechanics.inertia_known:
        return []
    least = SHEET * s.mass
    unknown = Unknown("mass_error", 0.2 * s.mass, -0.6 * s.mass, 1.5 * s.mass)
    shares = [1.0, 0.0] if s.axis.mechanics.weight > 0 else [0.0]
    names = {p.name for p in e.parameters}
    if "weight_share" not in names:
        return [Guise(e, (unknown,), grid([0.03 * s.mass]), least=least)]
    return [Guise(e, (unknown,), grid([0.03 * s.mass]), (("weight_share", share),), least=least) for share in shares]
