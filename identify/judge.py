"""Is a recording usable at all, and what did it fail to tell? Decisions with their reasons."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.criterion import noise_level
from identify.preprocess import Samples, smooth_velocity
from identify.result import Parameter
from plant.axis import Axis
from plant.recording import Recording

Floats = NDArray[np.float64]

FEWEST = 200  # samples: two seconds at 100 Hz
SLOWEST = 0.2  # s between samples: more tells neither a reversal nor a rest
CLOCK = 100.0  # times the axis file's sample time, or a part of it: stamps in another unit
STEPS = 20  # resolution steps of travel: less is not a motion
CURVE_KNOWN = 0.25  # relative half-width of friction at the median speed: more says nothing worth trending
DROWNED = 12.0  # standard deviations of the noise: white noise alone spans seven to eight
ONE_WAY = 0.1  # of the time in the commoner direction
SPEEDS = 3.0  # fastest over slowest
SLOW = 0.25  # of the fastest: where the Stribeck effect of most machines ends
MOVING = 0.05  # of the fastest speed: slower counts as rest


def unusable(recording: Recording, axis: Axis) -> str | None:
    """Why the samples cannot be used, or None."""
    if len(recording) < FEWEST:
        return f"{len(recording)} samples are too few: at least {FEWEST} are needed"
    for channel in ("t", "force", "position"):
        bad = np.flatnonzero(~np.isfinite(getattr(recording, channel)))
        if len(bad):
            return f"{len(bad)} of {len(recording)} samples of {channel} are not finite, the first is sample {bad[0]}"
    back = np.flatnonzero(np.diff(recording.t) <= 0)
    if len(back):
        k = int(back[0])
        return (
            f"time does not rise at {len(back)} samples, first from {recording.t[k]:g} s to {recording.t[k + 1]:g} s "
            f"at sample {k + 1}"
        )
    step = float(np.median(np.diff(recording.t)))
    expected = recording.sample_time or axis.stream.sample_time or step
    if step > SLOWEST or not expected / CLOCK < step < expected * CLOCK:
        said = "" if expected == step else f", not {expected:g} s as the axis file says"
        return f"samples are {step:g} s apart{said}: another unit? [[recording]] `scale = {{ t = 0.001 }}` is for ms"
    travel = float(np.ptp(recording.position))
    if travel <= STEPS * axis.sensor.position_resolution or travel == 0.0:
        return (
            f"the position moves by {travel:g} {axis.position_unit} only: the axis stood still or the sensor is frozen"
        )
    if float(np.ptp(recording.force)) == 0.0:
        return f"the drive force is constant at {recording.force[0]:g} {axis.force_unit}: the channel is frozen"
    return None


def too_broken(samples: Samples) -> str | None:
    """Why what is left after splitting at gaps and averaging is too little, or None."""
    if len(samples) < FEWEST:
        return (
            f"{len(samples)} samples are left after splitting at gaps and averaging to {samples.sample_time:g} s: "
            f"at least {FEWEST} are needed"
        )
    return None


def uninformative(
    samples: Samples, parameters: Mapping[str, Parameter], force: float, half_width: float, axis: Axis
) -> str | None:
    """What the window does not tell, why, and which motion would; None when friction at its usual speed is known.

    Args:
        samples: what was fitted.
        parameters: estimates, with `identifiable` and `hint` set.
        force: friction at the median speed of motion. [N]
        half_width: of its 95 % interval. [N]
        axis: for units.
    """
    travel, noise = float(np.ptp(samples.position)), noise_level(samples.position)
    if travel < DROWNED * noise:
        return (
            f"the position moves by {travel:.3g} {axis.position_unit} in noise of {noise:.2g} {axis.position_unit}: "
            "that is no motion; a force above the static friction, both ways, would tell"
        )
    if force > 0 and half_width <= CURVE_KNOWN * force:
        return None
    unknown = [name for name, parameter in parameters.items() if not parameter.identifiable]
    hints = [hint for name in unknown if (hint := parameters[name].hint) is not None]
    return (
        f"friction at the usual speed is {force:.3g} ± {half_width:.2g} {axis.force_unit}, "
        f"not known: {', '.join(unknown) or 'all'}; " + "; ".join(dict.fromkeys(hints))
    )


def with_hints(samples: Samples, parameters: Mapping[str, Parameter], axis: Axis) -> dict[str, Parameter]:
    """The parameters; those the window does not tell with why, and which motion would."""
    if all(parameter.identifiable for parameter in parameters.values()):
        return dict(parameters)
    seen = _seen(samples)
    return {
        name: parameter if parameter.identifiable else dataclasses.replace(parameter, hint=_hint(name, seen, axis))
        for name, parameter in parameters.items()
    }


@dataclass(frozen=True, slots=True)
class _Seen:
    """What motion the window held: samples in motion, share there and back, travel, slow and fast speeds, passes."""

    moving: int
    there: float
    back: float
    travel: float
    slow: float
    fast: float
    reversals: int
    slow_samples: int
    acceleration: float


def _seen(samples: Samples) -> _Seen:
    """Look at the smoothed speed."""
    velocity = smooth_velocity(samples)
    speed = np.abs(velocity)
    fastest = float(np.quantile(speed, 0.99))
    moving = speed > MOVING * fastest
    signs = np.sign(velocity[moving])
    same_run = np.diff(samples.run) == 0
    change = np.diff(velocity)[same_run] / samples.steps[:-1][same_run]
    slow, fast = np.quantile(speed[moving], [0.1, 0.9]) if moving.any() else (0.0, 0.0)
    return _Seen(
        moving=int(np.count_nonzero(moving)),
        there=float(np.mean(velocity > MOVING * fastest)),
        back=float(np.mean(velocity < -MOVING * fastest)),
        travel=float(np.ptp(samples.position)),
        slow=float(slow),
        fast=float(fast),
        reversals=int(np.count_nonzero(np.diff(signs))),
        slow_samples=int(np.count_nonzero(speed[moving] < SLOW * fastest)),
        acceleration=float(np.sqrt(np.mean(change**2))) if len(change) else 0.0,
    )


def _hint(name: str, seen: _Seen, axis: Axis) -> str:
    """Why a parameter is not known, in numbers, and which motion would inform it."""
    unit = f"{axis.position_unit}/s"
    one_way = min(seen.there, seen.back) < ONE_WAY * max(seen.there, seen.back)
    if one_way and name in ("coulomb_force", "static_force", "constant_force"):
        share = 100 * max(seen.there, seen.back) / max(seen.there + seen.back, 1e-9)
        return (
            f"the axis moved one way in {share:.0f} % of its motion, so friction and a constant force cannot be told "
            "apart; strokes of equal length both ways would tell"
        )
    if seen.moving < FEWEST:
        return f"only {seen.moving} samples show motion; continuous strokes over at least ten seconds would tell"
    if name == "moving_mass":
        return (
            f"accelerations of {seen.acceleration:.2g} {unit}^2 rms do not stand out; reversals at least twice as "
            "brisk would tell"
        )
    if name in ("static_force", "stribeck_velocity"):
        return (
            f"{seen.slow_samples} samples in {seen.reversals} reversals are in motion below "
            f"{SLOW * seen.fast / 0.9:.2g} {unit}; slow strokes, or a sine of low frequency just above the static "
            "friction, would tell"
        )
    if name in ("coulomb_force", "viscous_coefficient") and seen.fast < SPEEDS * seen.slow:
        return (
            f"the axis moved at {seen.slow:.2g} to {seen.fast:.2g} {unit} only; strokes at two speeds a factor of "
            f"{SPEEDS:g} apart would tell"
        )
    return (
        f"over {seen.travel:.3g} {axis.position_unit} it does not stand out of noise, inertia and other unknowns; "
        "longer strokes, a sine of low frequency with larger travel, or a longer recording would tell"
    )


def median_speed(samples: Samples) -> tuple[float, float]:
    """Median speed while moving, and the fastest (99 % quantile). [m/s]."""
    speed = np.abs(smooth_velocity(samples))
    fastest = float(np.quantile(speed, 0.99))
    moving = speed[speed > MOVING * fastest]
    return (float(np.median(moving)) if len(moving) else fastest), max(fastest, 1e-12)
