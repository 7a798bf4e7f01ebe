"""What is sealed: what was hidden, in the names and units of the diagnosis' contract, and how well it shows."""

from dataclasses import asdict, dataclass

import numpy as np

from .effects import EFFECTS, Sized, Span
from .machine import Moved
from .measures import Seen, exponential_drop
from .outside import COORDINATES, interval
from .plants import Plant
from .sensors import Sensors, Style

UNIT = 0.115  # of the dry friction is size 1, the middle of 8-15 %
YARD = 0.4  # m of travel for which the noise is told


@dataclass(frozen=True)
class Truth:
    """What only the simulator knows of a case.

    Attributes:
        kind, names: of the specification.
        motions: kind of motion of each recording.
        span: ends of the commanded positions. [m]
        sized: what is hidden, by name.
        wandering: standard deviation of the dry level. [1]
        noise_force: what the sensors' noise is as a force. [N]
        seen: what shows in each recording.
    """

    kind: str
    names: tuple[str, ...]
    motions: list[str]
    span: Span
    sized: dict[str, Sized]
    wandering: float
    noise_force: float
    seen: list[Seen]


def labels(truth: Truth, plant: Plant, moved: list[Moved], sensors: Sensors, style: Style) -> dict:
    """The sealed label; `severity_ratio` is one of squares, as the ratio of two criteria is."""
    hidden = {name: one for name, one in truth.sized.items() if name in EFFECTS}
    effects = {name: _plain(one.parameters) for name, one in hidden.items()}
    if "thermal_drift" in effects:  # the heating law as an exponential, where one fits
        effects["thermal_drift"].update(exponential_drop(plant, moved[0]) or {})
    projected, rest = max(one.projected for one in truth.seen), truth.seen[0].rest
    shapes = {name: one.shape for name, one in hidden.items() if one.shape}
    travel = float(max(np.ptp(one.position) for one in moved))
    position_noise = float(sensors.position_noise)
    return {
        "spec": {
            "size": projected / plant.coulomb / UNIT, "excitation": f"loop_{_one_word(truth.motions)}",
            "noise": _one_two_five(position_noise * YARD / travel), "period": plant.sample_period,
            "duration": plant.duration, "recordings": len(moved), "orientation": plant.axis,
            "shapes": "foreign" if shapes else "catalogue",
        },
        "expected": {"single": "explained", "pair": "explained", "outside": "unexplained"}.get(
            truth.kind, "no_mismatch"
        ),
        "effects": effects, "outside": _outside(truth), "shapes": shapes, "travel": travel,
        "severity_ratio": (projected**2 + rest**2) / max(rest, 1e-12) ** 2,
        "friction": {
            "coulomb_force": plant.coulomb, "static_force": plant.static, "stribeck_velocity": plant.stribeck,
            "viscous_coefficient": plant.viscous, "stribeck_exponent": plant.stribeck_exponent,
        },
        "details": {name: _plain(one.details) for name, one in hidden.items()},
        "motions": truth.motions, "mass": plant.mass, "motor_side": plant.motor_side,
        "inertia_known": style.inertia_known, "position_noise": position_noise, "noise_force": truth.noise_force,
        "wandering": truth.wandering, "seen": [asdict(one) for one in truth.seen],
    }  # fmt: skip


def _outside(truth):
    """What is outside the catalogue, the coordinates it depends on and the interval it acts in."""
    if truth.kind != "outside":
        return None
    (name,) = truth.names
    known = truth.sized[name].details
    where = interval(name, known, truth.span)
    return {"name": name, "parameters": _plain(known), "coordinates": list(COORDINATES[name]),
            "interval": where and [float(end) for end in where]}  # fmt: skip


def _one_word(motions):
    return motions[0] if len(set(motions)) == 1 else "mixed"


def _plain(known):
    return {key: float(value) for key, value in known.items()}


def _one_two_five(value: float) -> float:
    """The nearest of ..., 1e-6, 2e-6, 5e-6, 1e-5, ... so that tables can group by it."""
    decade = 10.0 ** np.floor(np.log10(value))
    nearest = min((1.0, 2.0, 5.0, 10.0), key=lambda one: abs(np.log(value / (one * decade))))
    return float(f"{nearest * decade:.1g}")
