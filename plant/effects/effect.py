"""What an effect is: a name, parameters with unit and bounds, and laws that change the machine of eq. (5).

Written without numba, so that names, units and bounds can be read without starting the compiler.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from plant.axis import Axis, Mechanics, Orientation
from plant.errors import InputError, ParameterError

if TYPE_CHECKING:
    from plant.kernels.laws import Law
    from plant.machine import Machine

Floats = NDArray[np.float64]

ROTARY_UNITS = {
    "N": "N*m",
    "m": "rad",
    "1/m": "1/rad",
    "N/m": "N*m/rad",
    "N*s/m": "N*m*s/rad",
    "N*s^2/m^2": "N*m*s^2/rad^2",
    "N*s/m^3": "N*m*s/rad^3",
    "kg": "kg*m^2",
}


def unit_on(unit: str, axis: Axis) -> str:
    """A unit of linear axes as it is on `axis`: N*m, rad and so on where it is rotary."""
    return ROTARY_UNITS.get(unit, unit) if axis.is_rotary else unit


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter of an effect.

    Attributes:
        name: as in JSON results (effects.md).
        unit: on a linear axis, in ASCII.
        plausible: engineering prior of effects.md, the bounds of a search.
        allowed: what the law can be evaluated with; outside it is an error.
        absent: value at which the effect is not there; None for a parameter that says nothing about its size.
        default: used where a user gives none: a number, or computed from the mechanics. None: must be given.
        reported: False for a nuisance (a phase) that results leave out.
        about: the meaning in words.
    """

    name: str
    unit: str
    plausible: tuple[float, float]
    allowed: tuple[float, float] = (-math.inf, math.inf)
    absent: float | None = None
    default: float | Callable[[Mechanics], float] | None = None
    reported: bool = True
    about: str = ""

    def unit_on(self, axis: Axis) -> str:
        """The unit on `axis`: N*m, rad and so on where it is rotary."""
        return unit_on(self.unit, axis)

    def check(self, value: float, effect: str) -> float:
        """Return `value`, or say which parameter of which effect is out of range."""
        low, high = self.allowed
        finite = math.isfinite(value) or value == self.absent
        if finite and low <= value <= high:
            return float(value)
        if low == -math.inf and high == math.inf:
            wanted = "finite"
        elif high == math.inf:
            wanted = f">= {low:g}"
        else:
            wanted = f"from {low:g} to {high:g}"
        raise ParameterError(f"{effect}.{self.name}", float(value), wanted, self.unit)


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What a law must know beside its parameters.

    Attributes:
        mechanics: constants of eq. (5).
        middle: y_m, middle of the recorded travel. [m or rad]
        motor_share: share of the moving mass on the motor's side of the transmission, J/R_c² over M + J/R_c². [1]
        sensor_at_motor: True when the position is measured at the motor.
    """

    mechanics: Mechanics
    middle: float = 0.0
    motor_share: float | None = None
    sensor_at_motor: bool = False

    @classmethod
    def of(cls, axis: Axis, middle: float | None = None) -> Surroundings:
        """Take them from the axis file; the middle is that of the travel where the recording's is not given."""
        m = axis.mechanics
        travel = m.travel or (0.0, 0.0)
        share = None
        if m.orientation is not Orientation.ROTARY and m.M > 0 and m.J > 0:
            share = 1.0 - m.M / m.moving_mass
        return cls(m, 0.5 * (travel[0] + travel[1]) if middle is None else middle, share, axis.sensor.side == "motor")

    def need_two_masses(self, effect: str) -> float:
        """The motor's share of the inertia, or say why `effect` cannot be modelled."""
        if self.motor_share is None:
            raise InputError(
                f"{effect} needs inertia on both sides of the transmission: the axis file must give M > 0 (load side) "
                f"and J > 0 (motor side), it gives M = {self.mechanics.M:g} kg and J = {self.mechanics.J:g} kg*m^2"
            )
        return self.motor_share


def as_given(values: Floats, machine: Machine) -> Floats:  # noqa: ARG001
    """The default of `Effect.prepare`: the laws read the parameters as they are."""
    return values


def no_rate(values: Floats, machine: Machine, speed: float) -> Floats:  # noqa: ARG001
    """The default of `Effect.rate`: nothing in the effect is faster than the baseline."""
    return np.zeros(values.shape[1])


def nothing_more(values: Mapping[str, float], friction: Floats) -> dict[str, tuple[float, str]]:  # noqa: ARG001
    """The default of `Effect.derive`: no further reported quantities."""
    return {}


@dataclass(frozen=True, slots=True)
class Effect:
    """A named effect (effects.md).

    Attributes:
        name: the contract's name.
        parameters: in the order of effects.md, nuisances last.
        laws: compiled laws; empty where `prepare` says it all.
        order: laws of one phase run in ascending order.
        initial: initial values of the effect's states; NaN lets the law choose at its first call.
        prepare: (values (p, m), machine) -> rows that the laws read (k, m); may change constants of the machine.
        rate: (values (p, m), machine, typical speed [m/s]) -> fastest rate of the effect, for the sub-steps. [1/s] (m,)
        derive: (values by name, friction (4,)) -> further reported quantities: name -> value, unit on a linear axis.
        source: where the equation is from.
    """

    name: str
    parameters: tuple[Parameter, ...]
    laws: tuple[Law, ...] = ()
    order: int = 50
    initial: tuple[float, ...] = ()
    prepare: Callable[[Floats, Machine], Floats] = as_given
    rate: Callable[[Floats, Machine, float], Floats] = no_rate
    derive: Callable[[Mapping[str, float], Floats], dict[str, tuple[float, str]]] = nothing_more
    source: str = ""

    def values(self, given: Mapping[str, float], mechanics: Mechanics) -> tuple[float, ...]:
        """Complete `given` with defaults and check it, in the order of `parameters`.

        Raises:
            InputError: a name that is not a parameter, or one that is missing.
            ParameterError: a value out of range.
        """
        known = [p.name for p in self.parameters]
        for name in given:
            if name not in known:
                raise InputError(f"{self.name} has no parameter {name}: it has {', '.join(known)}")
        return tuple(p.check(_value(p, given, mechanics, self.name), self.name) for p in self.parameters)

    def vanishes(self, values: Floats) -> bool:
        """True when `values` (p, m) or (p,) leave nothing of the effect: it is then not run at all."""
        sized = False
        for row, parameter in zip(values, self.parameters, strict=True):
            if parameter.absent is not None:
                sized = True
                if not (row == parameter.absent).all():
                    return False
        return sized


def _value(parameter: Parameter, given: Mapping[str, float], mechanics: Mechanics, effect: str) -> float:
    if parameter.name in given:
        return given[parameter.name]
    if parameter.default is None:
        raise InputError(f"{effect} needs {parameter.name} [{parameter.unit}]")
    return parameter.default(mechanics) if callable(parameter.default) else parameter.default
