"""Is a recording usable at all, and what did it fail to tell? Decisions with their reasons."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from identify.preprocess import Samples, smooth_velocity
from identify.result import Parameter
from plant.axis import Axis
from plant.recording import Recording

Floats = NDArray[np.float64]

FEWEST = 200  # samples: two seconds at 100 Hz
STEPS = 20  # resolution steps of travel: less is not a motion
CURVE_KNOWN = 0.25  # relative half-width of friction at the median speed: more says nothing worth trending
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
    samples: Samples, parameters: dict[str, Parameter], force: float, half_width: float, axis: Axis
) -> str | None:
    """What the window does not tell, why, and which motion would; None when friction at its usual speed is known.

    Args:
        samples: what was fitted.
        parameters: estimates, with `identifiable` set.
        force: friction at the median speed of motion. [N]
        half_width: of its 95 % interval. [N]
        axis: for units.
    """
    if force > 0 and half_width <= CURVE_KNOWN * force:
        return None
    unknown = [name for name, parameter in parameters.items() if not parameter.identifiable]
    velocity = smooth_velocity(samples)
    fastest = float(np.abs(velocity).max())
    there = float(np.mean(velocity > MOVING * fastest))
    back = float(np.mean(velocity < -MOVING * fastest))
    moving = int(np.count_nonzero(np.abs(velocity) > MOVING * fastest))
    if min(there, back) < 0.1 * max(there, back):
        why = "the axis moved one way, so friction and a constant force cannot be told apart"
        motion = "strokes of equal length both ways"
    elif moving < FEWEST:
        why = f"only {moving} samples show motion"
        motion = "continuous strokes over at least ten seconds"
    else:
        travel = float(np.ptp(samples.position))
        why = f"over {travel:.3g} {axis.position_unit} the friction does not stand out of noise and inertia"
        motion = "longer strokes, or a sine of low frequency with larger travel"
    return (
        f"friction at the usual speed is {force:.3g} ± {half_width:.2g} {axis.force_unit}, "
        f"not known: {', '.join(unknown) or 'all'}; {why}; {motion} would tell"
    )


def median_speed(samples: Samples) -> tuple[float, float]:
    """Median speed while moving, and the fastest (99 % quantile). [m/s]."""
    speed = np.abs(smooth_velocity(samples))
    fastest = float(np.quantile(speed, 0.99))
    moving = speed[speed > MOVING * fastest]
    return (float(np.median(moving)) if len(moving) else fastest), max(fastest, 1e-12)
