"""Does a recording agree with its axis file in sign, unit and scale? Judged by physics, before anything is fitted.

A vertical axis carries its weight; friction takes power and gives none; force makes the mass accelerate; travel, rated
force, sample time and resolutions are in the axis file. A window of a stream is judged in the same way as a file.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from identify import audit_channels
from identify.audit_causes import force_causes, named, position_causes
from identify.audit_finding import Finding, Severity, worst
from identify.audit_fit import Fit, fit
from plant.axis import Axis
from plant.recording import Recording

__all__ = ["Finding", "Severity", "audit_recording", "worst"]

SURE = 4.0  # standard errors
# Apparent inertia or weight over the axis file's: refused below, warned of below, warned of above, refused above.
# A payload may double the mass, and the axis file may count one of two fifths of it that is not there; its inertia is
# good to 15 %, or to a factor of two where it is but a start, and a balancer may carry most of a weight.
KNOWN_MASS = (1 / 2.0, 1 / 1.3, 1.6, 2.5)
ROUGH_MASS = (1 / 4.0, 1 / 3.0, 3.0, 5.0)
WEIGHT = (1 / 3.0, 1 / 1.6, 1.6, 2.5)
ROUGH_WEIGHT = (1 / 4.0, 1 / 3.0, 3.0, 5.0)
TWO = 2.0  # ratio that is refused where a channel bears it out
AGREE = 3.0  # ratio within which a channel's own step or velocity bears the inertia out
EXPLAINED = 0.5  # part of the force's variance below which force and motion do not belong together


def audit_recording(recording: Recording, axis: Axis) -> tuple[Finding, ...]:
    """Check every channel by itself, then force against motion.

    Returns:
        One finding per check that could be made, the worst first. `refuse` means: identified from this, the parameters
        would be wrong by a factor or a sign.
    """
    findings = audit_channels.findings(recording, axis)
    if not any(finding.severity == "refuse" and finding.check in ("samples", "clock") for finding in findings):
        findings += _physics(recording, axis)
    order = {"refuse": 0, "warn": 1, "ok": 2}
    return tuple(sorted(findings, key=lambda finding: order[finding.severity]))


def _physics(recording: Recording, axis: Axis) -> list[Finding]:
    result = fit(recording)
    if result is None:
        text = "too little motion to judge sign and scale of force and position; move the axis back and forth"
        return [Finding("warn", "motion", "no motion", "motion both ways", None, text)]
    swapped = _swapped(recording, axis, result)
    if swapped is not None:
        return [swapped]
    sign = _sign(axis, result)
    if sign.severity == "refuse":
        return [sign]  # what follows from a wrong sign would only confuse
    found = [sign, _weight(axis, result), _mass(recording, axis, result), _explained(axis, result)]
    return [finding for finding in [*found, _delay(recording, result)] if finding is not None]


def _swapped(recording: Recording, axis: Axis, result: Fit) -> Finding | None:
    """Force and position changed places: the force is then the double integral of the position."""
    if _explains(result) > 0.8 and 1 / 8 < result.mass / axis.mechanics.moving_mass < 8:
        return None
    other = fit(dataclasses.replace(recording, force=recording.position, position=recording.force))
    gain = abs(axis.mechanics.gain)
    for scale in {1.0, 1 / gain**2}:  # the edge has multiplied what it took for a torque
        if other is None or _explains(other) < 0.8 or not 1 / 3 < other.mass / scale / axis.mechanics.moving_mass < 3:
            continue
        return Finding(
            "refuse", "columns", "position drives force", "force drives position", "columns swapped",
            "force and position seem to be swapped: the other way round they fit the axis; check [[recording]] columns",
        )  # fmt: skip
    return None


def _explains(result: Fit) -> float:
    return 1 - (result.residual / result.force) ** 2 if result.force > 0 else 0.0


@dataclass(frozen=True, slots=True)
class _Signs:
    """Signs that are sure: of mass, friction and constant force; 0 where the recording does not say."""

    mass: int
    friction: int
    constant: int


def _signs(axis: Axis, result: Fit) -> _Signs:
    def sure(value: float, error: float, least: float) -> int:
        return 0 if abs(value) < max(SURE * error, least) else int(math.copysign(1, value))

    visible = 0.05 * result.force
    weight = axis.mechanics.weight
    return _Signs(
        mass=sure(result.mass, result.mass_error, 0.0) if _explains(result) > 0.2 else 0,
        friction=sure(result.friction, result.friction_error, visible),
        constant=sure(result.constant, result.constant_error, 0.3 * weight) if weight else 0,
    )


def _sign(axis: Axis, result: Fit) -> Finding:
    """Force must accelerate the mass forwards, friction must take power, weight must pull down."""
    signs = _signs(axis, result)
    unit = axis.force_unit
    seen = (
        f"inertia {result.mass:.3g} {axis.inertia_unit}, friction {result.friction:.3g} {unit}"
        f" at {result.speed:.3g} {axis.position_unit}/s"
        + (f", mean force {result.constant:.3g} {unit}" if signs.constant else "")
    )
    expected = "inertia and friction positive" + (", mean force upwards" if axis.mechanics.weight else "")
    turned = signs.mass < 0 or (signs.mass == 0 and signs.friction < 0)
    if turned and signs.constant:
        likely = "force has the wrong sign" if signs.constant < 0 else "position counts downwards"
    elif turned:
        likely = "force or position has the wrong sign"
    elif signs.constant < 0:
        likely = "both force and position count downwards"
    elif signs.friction < 0:
        return Finding(
            "warn", "friction power", f"friction {result.friction:.3g} {unit}", "friction > 0", None,
            f"friction seems to give power ({result.friction:.3g} {unit} at {result.speed:.3g} {axis.position_unit}/s) "
            "though the force accelerates the axis rightly: a delay between force and position, or another drive helps",
        )  # fmt: skip
    else:
        known = [name for name in ("mass", "friction", "constant") if getattr(signs, name)]
        return Finding(
            "ok", "sign", seen, expected, None, f"signs agree ({seen})" if known else "signs: nothing against"
        )
    which = {"force has the wrong sign": "force", "position counts downwards": "position"}.get(
        likely, "force or position"
    )
    return Finding(
        "refuse", "sign", seen, expected, likely,
        f"{likely}: {seen}, expected {expected}; turn it by a negative scale of {which} in the axis file",
    )  # fmt: skip


def _grade(ratio: float, limits: tuple[float, float, float, float], error: float = 0.0) -> Severity:
    """Of a ratio with a relative standard error: refused is what is beyond the limits for sure."""
    refused_below, warned_below, warned_above, refused_above = limits
    if ratio * (1 + SURE * error) < refused_below or ratio / (1 + SURE * error) > refused_above:
        return "refuse"
    return "ok" if warned_below <= ratio <= warned_above else "warn"


def _weight(axis: Axis, result: Fit) -> Finding | None:
    """The mean of the forces up and down at speed is the weight."""
    weight = axis.mechanics.weight
    if not weight or not math.isfinite(result.constant_error) or result.constant <= SURE * result.constant_error:
        return None
    ratio = result.constant / weight
    limits = WEIGHT if axis.mechanics.inertia_known else ROUGH_WEIGHT
    severity = _grade(ratio, limits, result.constant_error / result.constant)
    likely = None if severity == "ok" else named(ratio, force_causes(axis))
    seen, expected = f"{result.constant:.4g} N", f"about {weight:.4g} N (M g)"
    text = f"mean force up and down is {seen}, the axis file's weight {expected}"
    return Finding(severity, "weight", seen, expected, likely, _with(text, severity, ratio, "force", likely))


def _mass(recording: Recording, axis: Axis, result: Fit) -> Finding | None:
    """Force per acceleration is the inertia: a ratio of force scale and position scale."""
    if result.mass <= SURE * result.mass_error or _explains(result) < 0.2:
        return None
    ratio = result.mass / axis.mechanics.moving_mass
    limits = KNOWN_MASS if axis.mechanics.inertia_known else ROUGH_MASS
    severity = _grade(ratio, limits, result.mass_error / result.mass)
    agreeing = [w for w in audit_channels.witnesses(recording, axis) if 1 / AGREE < ratio / w < AGREE]
    if agreeing and not 1 / TWO < ratio < TWO:  # two that say the same
        severity, ratio = "refuse", agreeing[0]
    unit = axis.inertia_unit
    seen = f"{result.mass:.4g} {unit}"
    expected = f"about {axis.mechanics.moving_mass:.4g} {unit}"
    likely = None if severity == "ok" else _mass_cause(recording, axis, result, ratio)
    text = f"force per acceleration gives {seen}, the axis file {expected}"
    return Finding(severity, "inertia", seen, expected, likely, _with(text, severity, ratio, "inertia", likely))


def _mass_cause(recording: Recording, axis: Axis, result: Fit, ratio: float) -> str | None:
    """Name the channel: by the weight where there is one, else by travel, else both that would do."""
    by_force, by_position = named(ratio, force_causes(axis)), named(1 / ratio, position_causes(axis))
    weight = axis.mechanics.weight
    if weight and math.isfinite(result.constant_error):
        if _grade(max(result.constant / weight, 1e-12), WEIGHT) == "ok":
            return by_position
        return by_force
    travel = axis.mechanics.travel
    if travel is not None and np.ptp(recording.position) > 1.2 * (travel[1] - travel[0]):
        return by_position or by_force
    return "; or ".join(filter(None, (by_force, by_position))) or None


def _with(text: str, severity: Severity, ratio: float, what: str, likely: str | None) -> str:
    if severity == "ok":
        return text
    return f"{text}: off by a factor of {ratio:.3g}; " + (f"likely: {likely}" if likely else f"check the {what}'s unit")


def _explained(axis: Axis, result: Fit) -> Finding:
    part = max(_explains(result), 0.0)
    seen, expected = f"{100 * part:.0f} %", f">= {100 * EXPLAINED:.0f} %"
    text = (
        f"inertia, constant and plain friction explain {seen} of the force's variance; "
        f"{result.residual:.3g} {axis.force_unit} rms remain"
    )
    return Finding("ok" if part >= EXPLAINED else "warn", "force explained", seen, expected, None, text)


def _delay(recording: Recording, result: Fit) -> Finding | None:
    """Force and position must be of the same instant."""
    period = recording.period
    shifted = abs(result.delay) > 1.5 * period
    late = "position" if result.delay > 0 else "force"
    seen = f"{1e3 * abs(result.delay):.3g} ms" if shifted else "none to speak of"
    text = (
        f"the {late} comes {seen} late: force and position are not of the same instant"
        if shifted
        else "no delay between force and position to speak of"
    )
    return Finding("warn" if shifted else "ok", "delay", seen, f"< {1.5e3 * period:.3g} ms", None, text)
