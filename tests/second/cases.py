"""Blind recordings: a machine, something (or nothing) hidden in it at a size that shows, recordings, sealed labels.

All of it follows from one generator of random numbers. `write_case` writes only what a user would have.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

from .effects import EFFECTS, Sized, draw_effect
from .labels import Truth, labels
from .machine import HELD, Moved, run
from .measures import OWN_MASS, Seen, see
from .motion import KINDS, draw_motion, log_uniform, uniform
from .outside import draw_outside
from .parameters import record
from .plants import TWO_MASS, Plant, base_values, draw_plant
from .sensors import Table, draw_axis_file, draw_position_step, draw_sensors, draw_style, draw_table, file_name

# what must move how for it to show
MOTIONS = {
    "dwell_time_stiction": ("slowstart",),
    "torque_saturation": ("trap",),
    "quadratic_drag": ("trap", "random", "sweep"),
    "fan_cubic": ("trap", "random", "sweep"),
    "actuator_lag": ("multisine", "jerk", "random"),
    "dead_time": ("multisine", "jerk", "random"),
    "transmission_compliance": ("random", "trap"),
    "backlash": ("random", "jerk", "multisine"),
    "presliding_hysteresis": ("slowstart", "jerk", "random"),
    "inertia_error": ("random", "multisine", "sweep"),
    "load_dependent_friction": ("random", "jerk", "multisine"),
    "end_stop": ("trap",),
    "pendulum": ("jerk", "random"),
    "force_offset": ("trap", "slowstart"),
    "coulomb_asymmetry": ("slowstart", "trap"),
    "wiper_debris": ("random", "jerk", "trap"),
}
# what its author hid together
PAIRS = (
    ("rail_defect", "position_spring"),
    ("torque_ripple", "quadratic_drag"),
    ("end_stop", "position_dependent_friction"),
    ("step_change", "rail_defect"),
    ("load_dependent_friction", "thermal_drift"),
    ("actuator_lag", "position_spring"),
    ("dwell_time_stiction", "viscous_asymmetry"),
    ("inertia_error", "torque_ripple"),
    ("presliding_hysteresis", "step_change"),
    ("transmission_compliance", "quadratic_drag"),
)
# rms of what ordinary terms leave of it, in shares of the dry friction
TARGETS = {
    "dwell_time_stiction": (0.05, 0.09), "rail_defect": (0.07, 0.2), "end_stop": (0.08, 0.25),
    "torque_saturation": (0.06, 0.15), "presliding_hysteresis": (0.05, 0.12), "backlash": (0.06, 0.12),
    "transmission_compliance": (0.05, 0.12), "actuator_lag": (0.06, 0.15), "dead_time": (0.06, 0.15),
    "pendulum": (0.07, 0.15), "quadratic_drag": (0.06, 0.13), "fan_cubic": (0.07, 0.15),
}  # fmt: skip
ANY_TARGET, MASS_TARGET = (0.08, 0.28), (0.08, 0.25)
TRIALS = 6  # of a size


class UndrawableError(Exception):
    """This draw shows nothing, too much, or hardly moves; take the next."""


@dataclass(frozen=True)
class CaseSpec:
    """What to draw.

    Attributes:
        kind: single, pair, outside, smooth, rough (nothing hidden; the dry level wanders by under 0.3 %, by 1-2 %).
        names: of what is hidden: of `effects.EFFECTS`, or one of `outside.OUTSIDE`.
        variant: 1 = the other law where there are two (Maxwell slip, heating, late position), and other machines.
    """

    kind: str
    names: tuple[str, ...] = ()
    variant: int = 0


@dataclass(frozen=True)
class Case:
    """A drawn case: what a user has (lines of the axis file but its name, tables), and the sealed labels."""

    axis: list[str]
    tables: list[Table]
    labels: dict
    name: str = "axis"


@dataclass(frozen=True)
class Course:
    """Runs of one machine: motions, what the drive reads wrong [m], how the dry level wanders [1]."""

    plant: Plant
    motions: list[list[np.ndarray]]
    reading_noise: list[np.ndarray]
    rough: list[np.ndarray]

    @property
    def span(self) -> tuple[float, float]:
        """Ends of the commanded positions. [m]"""
        return min(one[0].min() for one in self.motions), max(one[0].max() for one in self.motions)

    def run(self, values: dict[str, float], count: int | None = None) -> list[Moved]:
        """Run the first `count` recordings, or all."""
        p, plant = record(values), self.plant
        return [
            run(p, motion, rough, noise, plant.drive_period, plant.substeps, plant.per_sample, plant.reported)
            for motion, rough, noise in list(zip(self.motions, self.rough, self.reading_noise, strict=True))[:count]
        ]


def draw_case(rng, spec: CaseSpec) -> Case:
    """Draw one case.

    Raises:
        UndrawableError: it does not show, hides nearly all else, hardly moves, or runs away.
    """
    hidden = set(spec.names)
    plant = draw_plant(rng, hidden, spec.variant)
    plant.motor_side = bool(hidden & TWO_MASS) and rng.random() < 0.35
    kinds = _draw_kinds(rng, spec, plant)
    base = base_values(rng, plant, hidden)
    motions = [_motion(rng, kind, plant, 0.5 if "dwell_time_stiction" in hidden else 1) for kind in kinds]
    wandering = _draw_wandering(rng, spec)
    step = draw_position_step(rng, plant)
    noise = [step * (0.1 if plant.reported == HELD else 0.01) * rng.standard_normal(len(m[0])) for m in motions]
    course = Course(plant, motions, noise, [_wander(rng, wandering, plant, len(m[0])) for m in motions])
    plant.stroke = course.span[1] - course.span[0]
    plant.peak_force = max(np.percentile(np.abs(one.current), 99.95) for one in course.run(base))
    try:
        sized = {name: _size(rng, name, course, base, spec.variant) for name in spec.names}
    except np.linalg.LinAlgError as error:
        raise UndrawableError("diverged") from error
    values = dict(base)
    for one in sized.values():
        values |= one.fields
    moved = course.run(values)
    peak = max(np.abs(one.current).max() for one in moved)
    if not (np.isfinite(peak) and all(np.isfinite(one.position).all() for one in moved)):
        raise UndrawableError("diverged")
    sensors, noise_force = draw_sensors(rng, plant, step, peak, bool(hidden))
    seen = [see(plant, one, hidden, values.get("reading_delay", 0.0), noise_force) for one in moved]
    _check(spec, plant, moved, seen, noise_force)
    style = draw_style(rng, plant, hidden)
    tables = [draw_table(rng, plant, sensors, style, one) for one in moved]
    axis = draw_axis_file(rng, plant, sensors, style, moved)
    truth = Truth(spec.kind, spec.names, kinds, course.span, sized, wandering, noise_force, seen)
    return Case(axis, tables, labels(truth, plant, moved, sensors, style))


def _draw_kinds(rng, spec, plant):
    """Motions of one recording, or of two shorter ones."""
    suited = KINDS
    for name in spec.names:
        if name in MOTIONS:
            suited = [kind for kind in suited if kind in MOTIONS[name]] or MOTIONS[name]
    count = 2 if rng.random() < 0.4 and not set(spec.names) & {"step_change", "brake_interval"} else 1
    if count == 2:
        plant.duration = max(float(np.ceil(plant.duration * 0.6 / 10) * 10), 30.0)
    return [str(kind) for kind in rng.choice(suited, count, replace=len(suited) < count)]


def _motion(rng, kind, plant, gentleness):
    length = round(plant.duration / plant.drive_period)
    length -= length % plant.per_sample
    drawn = draw_motion(rng, kind, plant.duration + 0.1, plant.drive_period, plant.low, plant.high, plant.v_max,
                        plant.a_max * gentleness)  # fmt: skip
    return [np.ascontiguousarray(series[:length]) for series in drawn]


def _draw_wandering(rng, spec):
    """Standard deviation by which the dry level wanders. [1]"""
    if spec.kind == "rough":
        return uniform(rng, 0.01, 0.02)
    if spec.kind == "smooth":
        return uniform(rng, 0, 0.003)
    return uniform(rng, 0.008, 0.015) if rng.random() < 0.2 else uniform(rng, 0, 0.003)


def _wander(rng, size, plant, n):
    """A slow walk that returns to its mean."""
    keep = np.exp(-plant.drive_period / log_uniform(rng, 3, 12))
    shocks = rng.standard_normal(n) * np.sqrt(1 - keep * keep)
    return size * lfilter([1], [1, -keep], shocks, zi=np.array([rng.standard_normal() * keep]))[0]


def _size(rng, name, course, base, variant) -> Sized:
    """Find the size at which ordinary terms leave as much as a target drawn for it."""
    plant = course.plant
    if name in EFFECTS:
        hidden = draw_effect(rng, name, plant, course.span, variant)
    else:
        hidden = draw_outside(rng, name, plant, course.span)
    target = uniform(rng, *TARGETS.get(name, ANY_TARGET))
    if name in OWN_MASS:
        target = uniform(rng, *MASS_TARGET)
    size = hidden.first
    for _ in range(TRIALS):
        values = base | hidden.of(size).fields
        seen = see(plant, course.run(values, 1)[0], {name}, values.get("reading_delay", 0.0))
        if seen is None or not np.isfinite(seen.projected):
            size *= 0.5
            continue
        share = seen.projected / plant.coulomb
        if abs(share / target - 1) < 0.15:
            break
        larger = min(hidden.most, size * float(np.clip((target / max(share, 1e-6)) ** 0.9, 0.3, 3)))
        if abs(larger / size - 1) < 0.01:
            break
        size = larger
    return hidden.of(size)


def _check(spec, plant, moved, seen: list[Seen | None], noise_force):
    """Refuse what no diagnosis could see, what drowns all else, and recordings that stand still."""
    if None in seen:
        raise UndrawableError("too little motion")
    projected = max(one.projected for one in seen)
    least = 0.03 if {"presliding_hysteresis", "backlash"} & set(spec.names) else 0.05
    if spec.names and projected / plant.coulomb < least:
        raise UndrawableError(f"only {projected / plant.coulomb:.1%} of the dry friction shows")
    if spec.names and projected < 3 * noise_force:
        raise UndrawableError("lost in noise")
    if spec.names and projected / plant.coulomb > 0.45:
        raise UndrawableError(f"{projected / plant.coulomb:.0%} of the dry friction")
    travels = [np.ptp(one.position) for one in moved]
    if min(travels) < 0.3 * max(travels) or min(_reversals(plant, one) for one in moved) < 5:
        raise UndrawableError("too few reversals, or travels too unlike")
    if max((np.abs(one.velocity) < 0.004 * plant.v_max).mean() for one in moved) > 0.6:
        raise UndrawableError("mostly at rest")


def _reversals(plant, moved):
    fast = moved.velocity[np.abs(moved.velocity) > 0.01 * plant.v_max]
    return int((np.diff(np.sign(fast)) != 0).sum())


def write_case(case: Case, folder: Path) -> Path:
    """Write what a user has, axis.toml and one CSV per recording, into `folder`; returns the axis file's path."""
    folder.mkdir(parents=True, exist_ok=True)
    for number, table in enumerate(case.tables):
        np.savetxt(folder / file_name(number), table.values, list(table.formats), ",", header=table.header, comments="")
    path = folder / "axis.toml"
    path.write_text("\n".join([f'name = "{case.name}"', *case.axis]) + "\n")
    return path
