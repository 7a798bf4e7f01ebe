"""What can be hidden that no name of the catalogue describes, and the coordinate it depends on."""

import numpy as np

from .effects import Hidden, Sized
from .motion import uniform

# name -> coordinates (names of the diagnosis' contract) a sound diagnosis may give, the first being the author's own
COORDINATES = {
    "pendulum": ("frequency",),
    "cable_quadratic": ("position",),
    "fan_cubic": ("velocity",),
    "brake_interval": ("time",),
    "magnetic_detent": ("position",),
    "one_way_scrape": ("position",),
    "floor_vibration": ("time", "frequency"),
    "wiper_debris": ("distance_since_reversal", "time_since_reversal"),
}


def draw_outside(rng, name, plant, span) -> Hidden:
    """Draw what is hidden but its size."""
    return OUTSIDE[name](rng, float(rng.choice([-1, 1])), plant, span)


def interval(name: str, known: dict[str, float], span: tuple[float, float]) -> list[float] | None:
    """Where it acts, in the unit of its first coordinate; None where it acts everywhere."""
    if name == "cable_quadratic":
        return [known["start"], span[1]] if known["side"] > 0 else [span[0], known["start"]]
    if name == "brake_interval":
        return [known["start"], known["end"]]
    if name in ("magnetic_detent", "one_way_scrape"):
        reach = (2 if name == "magnetic_detent" else 1) * known["width"]
        return [known["centre"] - reach, known["centre"] + reach]
    return None


def _pendulum(rng, sign, plant, span):
    """A part of the load hangs and swings."""
    frequency = uniform(rng, 0.7, 1.3)

    def of(s):
        mass = min(s, 0.6) * plant.M
        fields = {"pendulum_mass": mass, "pendulum_frequency": 2 * np.pi * frequency, "pendulum_damping": 0.02,
                  "motor_mass": plant.mass - mass}  # fmt: skip
        return Sized(fields, {}, {"mass": mass, "frequency": frequency})

    return Hidden(0.15, 0.6, of)


def _cable_quadratic(rng, sign, plant, span):
    """A cable chain that is drawn out beyond a place, harder the farther."""
    start = 0.5 * (span[0] + span[1]) + sign * uniform(rng, -0.1, 0.1) * plant.stroke

    def of(s):
        coefficient = s * plant.coulomb / (plant.stroke / 2) ** 2
        fields = {"cable": coefficient, "cable_start": start, "cable_side": sign}
        return Sized(fields, {}, {"coefficient": coefficient, "start": start, "side": sign})

    return Hidden(0.8, 4.0, of)


def _fan_cubic(rng, sign, plant, span):
    """A fan: c v^3."""

    def of(s):
        coefficient = s * plant.coulomb / plant.v_max**3
        return Sized({"cubic_drag": coefficient}, {}, {"coefficient": coefficient})

    return Hidden(1.2, 6.0, of)


def _brake_interval(rng, sign, plant, span):
    """A brake that drags for a while."""
    start = plant.duration * uniform(rng, 0.15, 0.25)
    end = start + plant.duration * uniform(rng, 0.12, 0.2)

    def of(s):
        drag = s * plant.coulomb
        fields = {"brake": drag, "brake_start": start, "brake_end": end}
        return Sized(fields, {}, {"drag": drag, "start": start, "end": end})

    return Hidden(0.4, 2.0, of)


def _place(rng, plant, span):
    """A centre well inside the stroke, and a width. [m]"""
    centre = uniform(rng, span[0] + 0.3 * plant.stroke, span[1] - 0.3 * plant.stroke)
    return centre, uniform(rng, 0.04, 0.08) * plant.stroke


def _magnetic_detent(rng, sign, plant, span):
    """A magnet beside the way: an even force."""
    centre, width = _place(rng, plant, span)

    def of(s):
        peak = s * plant.coulomb
        fields = {"magnet": peak, "magnet_centre": centre, "magnet_width": width}
        return Sized(fields, {}, {"peak": peak, "centre": centre, "width": width})

    return Hidden(0.5, 2.0, of)


def _one_way_scrape(rng, sign, plant, span):
    """Drag at one place in one direction."""
    centre, width = _place(rng, plant, span)

    def of(s):
        drag = s * plant.coulomb
        fields = {"scrape": drag, "scrape_centre": centre, "scrape_width": width, "scrape_side": sign}
        return Sized(fields, {}, {"drag": drag, "centre": centre, "width": width, "side": sign})

    return Hidden(0.7, 2.0, of)


def _floor_vibration(rng, sign, plant, span):
    """A force clocked in time."""
    frequency = uniform(rng, 1.2, 3.1)

    def of(s):
        fields = {"vibration": s * plant.coulomb, "vibration_frequency": frequency, "vibration_phase": 1.0}
        return Sized(fields, {}, {"amplitude": s * plant.coulomb, "frequency": frequency})

    return Hidden(0.2, 1.0, of)


def _wiper_debris(rng, sign, plant, span):
    """A wiper that pushes more before it the farther it goes; it starts afresh at every reversal."""
    length = uniform(rng, 0.06, 0.15) * plant.stroke

    def of(s):
        fields = {"debris": s * plant.coulomb, "debris_length": length}
        return Sized(fields, {}, {"rise": s * plant.coulomb, "length": length})

    return Hidden(0.5, 1.5, of)


OUTSIDE = {
    "pendulum": _pendulum,
    "cable_quadratic": _cable_quadratic,
    "fan_cubic": _fan_cubic,
    "brake_interval": _brake_interval,
    "magnetic_detent": _magnetic_detent,
    "one_way_scrape": _one_way_scrape,
    "floor_vibration": _floor_vibration,
    "wiper_debris": _wiper_debris,
}
