"""Is a mass that is said to be known the mass that moves? A quick check for whoever writes an axis file."""

from __future__ import annotations

from identify.audit_finding import Finding
from identify.audit_fit import fit
from plant.axis import Axis
from plant.recording import Recording

SURE = 4.0  # standard errors
TRUSTED = 0.10  # of the mass: the quick fit was within 6 % on 120 healthy machines (tests/identify, seed 4301)
TOLD = 0.2  # part of the force's variance that must be explained before the fit says anything


def doubted_mass(recording: Recording, axis: Axis) -> Finding | None:
    """A warning where force per acceleration contradicts a mass that the axis file calls known; None otherwise.

    A mass that is wrong but believed makes all friction wrong, and every interval too narrow to show it.
    """
    result = fit(recording)
    if not axis.mechanics.inertia_known or result is None or result.mass <= SURE * result.mass_error:
        return None
    if result.force <= 0 or 1 - (result.residual / result.force) ** 2 < TOLD:
        return None
    said, margin = axis.mechanics.moving_mass, TRUSTED * result.mass + SURE * result.mass_error
    if abs(said - result.mass) <= margin:
        return None
    unit, what = axis.inertia_unit, "inertia" if axis.is_rotary else "moving mass"
    seen, expected = f"{result.mass:.3g} ± {margin:.1g} {unit}", f"{said:.3g} {unit}, known"
    text = (
        f"the axis file knows its {what} as {said:.3g} {unit}, but this recording moves like {seen}; friction fitted "
        "with a wrong mass is wrong and looks sure. If it was guessed, set inertia_known = false (axes init "
        "--mass-rough), and it is estimated too; if it was weighed, check force_per_torque and the drive's unit"
    )
    return Finding("warn", "known mass", seen, expected, None, text)
