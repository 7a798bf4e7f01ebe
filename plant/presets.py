"""The paper's machine (§4): both readings of §4.3, and the constants the paper does not print.

M, J, R_c and R_m are ours, one documented choice per reading: M + J/R_c² = 25 kg, and 1/R_m such that the sine of
§4.3 on top of the holding torque moves the mass about ±0.2 m, as §4.5 says.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from plant.axis import Axis, Drive, Mechanics, Stream
from plant.errors import ParameterError
from plant.friction import StribeckFriction

Reading = Literal["paper-literal", "paper-bump"]
READINGS: tuple[Reading, ...] = ("paper-literal", "paper-bump")

COULOMB_FORCE = 90.0  # N, §4.3
STATIC_WORD = 60.0  # N, §4.3: F_s itself ("literal"), or the bump alpha2 = F_s - F_c ("bump")
STRIBECK_VELOCITY = 0.1  # m/s, §4.3
VISCOUS_COEFFICIENT = 180.0  # N s/m, §4.3
TORQUE_AMPLITUDE = 2.1  # N m, §4.3
TORQUE_FREQUENCY = 0.2  # Hz, §4.3
SAMPLE_TIME = 0.01  # s, §4.1
TRAVEL = (0.0, 2.0)  # m, §4.1
MASS_IN_TRANSLATION = 20.0  # kg, ours
PULLEY_RADIUS = 0.045  # m, ours
INERTIA = 5.0 * PULLEY_RADIUS**2  # kg m^2, ours: J/R_c² = 5 kg
FORCE_PER_TORQUE = {"paper-literal": 74.0, "paper-bump": 86.0}  # N per N m, ours: 1/R_m for ±0.2 m
RATED_TORQUE = 8.0  # N m, ours: the sine peaks at 4.8 N m


def _known(reading: str) -> str:
    if reading not in READINGS:
        raise ParameterError("reading", repr(reading), f"one of {', '.join(READINGS)}")
    return reading


def paper_friction(reading: Reading = "paper-literal") -> StribeckFriction:
    """Friction of §4.3: F_s = 60 N read literally, or as the bump above F_c (F_s = 150 N)."""
    static = STATIC_WORD if _known(reading) == "paper-literal" else COULOMB_FORCE + STATIC_WORD
    return StribeckFriction(COULOMB_FORCE, static, STRIBECK_VELOCITY, VISCOUS_COEFFICIENT)


def paper_axis(reading: Reading = "paper-literal") -> Axis:
    """The vertical guide way of §4.1 with M + J/R_c² = 25 kg and 1/R_m of 74 (literal) or 86 (bump) N per N·m."""
    gain = FORCE_PER_TORQUE[_known(reading)]
    mechanics = Mechanics(M=MASS_IN_TRANSLATION, J=INERTIA, Rc=PULLEY_RADIUS, Rm=1.0 / gain, travel=TRAVEL)
    return Axis(reading, mechanics, Drive(rated_force=RATED_TORQUE * gain), stream=Stream(SAMPLE_TIME))


def paper_torque(
    axis: Axis,
    *,
    amplitude: float = TORQUE_AMPLITUDE,
    frequency: float = TORQUE_FREQUENCY,
    samples: int = 2000,
    sample_time: float = SAMPLE_TIME,
) -> NDArray[np.float64]:
    """Motor torque [N·m] of §4.3, a sine of `amplitude` [N·m] and `frequency` [Hz] on top of the holding torque.

    Returns:
        Array of shape (samples,); sample k belongs to the time k * sample_time.
    """
    t: NDArray[np.float64] = sample_time * np.arange(samples, dtype=np.float64)
    sine: NDArray[np.float64] = np.sin(2.0 * np.pi * frequency * t)
    return axis.mechanics.weight / axis.mechanics.gain + amplitude * sine
