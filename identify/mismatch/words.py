"""What a diagnosis says in plain words, and which motion would settle what it leaves open."""

from __future__ import annotations

from identify.mismatch.curve import RISING
from identify.mismatch.result import Change, FoundEffect, Hidden, Location, Quantity

PLAIN = {
    "force_offset": "a constant force (tilt, gravity or mass error, drive or sensor offset)",
    "coulomb_asymmetry": "dry friction that differs with the direction",
    "viscous_asymmetry": "viscous friction that differs with the direction",
    "position_dependent_friction": "dry friction that grows along the travel",
    "rail_defect": "a place on the guide that runs harder or easier",
    "presliding_hysteresis": "friction memory around reversals (bristles bend before they slide)",
    "backlash": "free travel between motor and load",
    "transmission_compliance": "a soft transmission between motor and load",
    "torque_ripple": "a ripple over the motor's angle",
    "pulley_eccentricity": "a pulley that runs out of true",
    "load_dependent_friction": "dry friction that grows with the transmitted force",
    "thermal_drift": "viscous friction that falls as the machine warms up",
    "quadratic_drag": "drag that grows with the square of the speed",
    "position_spring": "a spring along the travel (cable chain, counterbalance)",
    "inertia_error": "a moving mass other than the axis file says",
    "torque_scale_error": "a torque constant other than the axis file says",
    "actuator_lag": "a drive that lags behind its command",
    "dead_time": "a dead time between torque and position",
    "torque_saturation": "a torque that is clipped",
    "dwell_time_stiction": "stiction that grows while the axis rests",
    "end_stop": "a bumper or hard stop at one end of the travel",
    "step_change": "dry friction that changed at one moment",
}

STRANGE = {  # physics that is in no catalogue (uncatalogued.py), as it is put where it would explain what is left
    "frictional_lag": "friction that sees the speed late",
    "creeping_spring": "a spring that gives way while it is held (a seal, a hose)",
    "cable_hysteresis": "a soft friction beside the sliding one (a cable chain, a seal)",
    "level_ripple": "dry friction that rises and falls along the travel",
    "fading_torque": "a torque constant that changes as the motor warms up",
    "uneven_gain": "a torque constant that is another for positive than for negative torque (an amplifier, a sensor)",
    "weakening_drive": "a torque constant that falls with speed (a weakened field, too little voltage)",
    "dead_band": "a drive that loses small forces (a dead band of its amplifier)",
    "saturating_drive": "a torque constant that falls with the torque itself (iron that saturates)",
    "gain_along": "a transmission that changes along the travel (a lever, a linkage, a rope drum)",
    "inertial_drag": "dry friction that grows with acceleration (an overhung mass that tilts, a brake)",
    "one_way_load": "a mass that moves along in one direction only (a payload that is carried one way)",
    "load_beyond": "a mass that moves along beyond one place only (a payload, a second carriage)",
    "load_later": "a mass that moves along from one moment on, or until then (a payload picked up or set down)",
    "loose_load": "a load that lies loose and slips where it is accelerated too fast",
    "dragged_load": "a mass that is dragged along late (oil in a housing, a viscous mount)",
    "overshooting_drive": "a drive whose force overshoots what it is told, or creeps up to it",
    "slew_limit": "a drive whose force changes no faster than so much (a ramp, too little voltage)",
    "one_way_pull": "a force along part of the travel in one direction of motion only (a hose, a wiper)",
    "swinging_load": "a part of the mass that swings or sways (a hanging load, a liquid, the frame)",
    "spring_with_play": "a spring behind a free travel (a cable chain, a worn pin)",
    "hanging_arm": "a weight that turns with the axis (an arm, an unbalance)",
    "viscous_along": "viscous friction that changes along the travel (grease that was pushed to its ends)",
    "film_memory": "dry friction that remembers how fast the axis has run (a film that builds up, heat)",
    "fresh_drag": "dry friction that each reversal raises and that wears off (a seal lip that turns over, a film)",
    "rested_grease": "friction that a rest raises and that motion works off (stiff grease, a brake that opens late)",
    "viscous_later": "viscous friction that changed at one moment (fresh grease, a tool that dips in)",
    "inertia_along": "a moving mass that changes along the travel (a linkage, a reel)",
    "level_step": "dry friction that is another past one place (a joint of the rail)",
    "picked_up_weight": "a force that sets in beyond one place (a weight or a chain that is carried along)",
    "push_in_place": "a push one way near one place (a latch, a brush, a magnet)",
    "detent": "a pull to one place from both sides, or away from it (a magnet, a notch)",
    "viscous_zone": "viscous friction in one place (old grease, an oil sump)",
    "sector_push": "a push in one sector of each turn (a notch, a splice)",
    "sector_rub": "dry friction in one sector of each turn (a damaged bearing)",
    "sector_loss": "torque that is lost in one sector of each turn of the motor (a pole, a winding)",
    "one_way_drag": "a drag above some speed in one direction of motion (a valve, a lip that lifts)",
    "level_in_band": "dry friction that is another in a band of speeds (a cover or a gear in resonance)",
    "drag_above_speed": "a drag that begins above some speed (a centrifugal brake, oil that is thrown)",
    "level_above_speed": "dry friction that is another above some speed (a film that carries, a guard that hums)",
}

IMITATED = (
    "Dry friction rises with speed and levels off (grease that thins, eddy currents), which is no friction of eq. (1):"
    " the fit imitates it with a static friction far below the sliding one. It depends on velocity, between {:.3g} and"
    " {:.3g}."
)
LIMITS = (  # what no recording of this kind can tell; on the page of a report and in docs/what-it-cannot-see.md
    "A constant force and dry friction that differs with the direction are the same while the axis slides.",
    "A wrong torque constant and a wrong mass are the same unless gravity or a payload tells them apart.",
    "A lag and a dead time are the same to first order; only rich, fast motion separates them.",
    "Backlash and a soft transmission hardly show with the sensor at the load and slow motion.",
    "Friction that bends with speed (square, root) is mostly swallowed by the Stribeck law unless speeds span decades.",
    "It looks for one effect of each name: two places on the rail are one name with a rest.",
    "Intervals (95 %) are conditional on the named model; they do not cover a wrong name.",
)


def explained(effects: tuple[FoundEffect, ...], alternatives: tuple[tuple[str, ...], ...], gain: float) -> str:
    """The finding in a sentence or two; `gain` is what is left of the held-out criterion. [1]."""
    parts = [f"{PLAIN.get(effect.name, effect.name)} ({_numbers(effect)})" for effect in effects]
    text = f"The baseline model leaves out {' and '.join(parts)}."
    if gain < 1.0:
        text += f" With it, the error on data the fit has not seen falls to {100 * gain:.2g} %."
    if len(alternatives) > 1:
        others = "; or ".join(" with ".join(names) for names in alternatives[1:])
        text += f" These recordings cannot tell it from {others}."
    return text


def changed(changes: tuple[Change, ...]) -> str:
    """What is different from commissioning, effects first."""
    parts = []
    for change in sorted(changes, key=lambda one: one.effect is None):
        unit = "" if change.unit == "1" else f" {change.unit}"
        span = f"{change.before:.3g} to {change.after:.3g}{unit}"
        if change.effect is None:
            parts.append(f"the {change.parameter.replace('_', ' ')} moved from {span}")
        else:
            verb = "is gone" if change.kind == "gone" else f"has {change.kind}"
            parts.append(
                f"{PLAIN.get(change.effect, change.effect)} {verb} ({change.parameter.replace('_', ' ')} {span})"
            )
    return f" Since commissioning, {'; '.join(parts)}." if parts else ""


def nothing_missing(latent: Quantity, detectable: dict[str, Hidden]) -> str:
    """No mismatch, and what would have been seen."""
    text = f"The baseline model is complete: what it leaves, {latent.value:.2g} {latent.unit}, does not repeat."
    seen = [
        f"{name.replace('_', ' ')} from {h.value:.2g}{'' if h.unit == '1' else f' {h.unit}'}"
        for name, h in list(detectable.items())[:3]
    ]
    return f"{text} These recordings would have shown, for example, {', '.join(seen)}." if seen else text


def unexplained(latent: Quantity, location: Location | None, like: str = "") -> str:
    """Structure is there, the catalogue does not hold it; physics that is in none may be `like` it."""
    if like == RISING and location is not None:
        return IMITATED.format(*location.interval)
    text = f"A force of about {latent.value:.2g} {latent.unit} is left that no effect of the catalogue explains."
    if location is None:
        return text + " It shows along no single coordinate."
    low, high = location.interval
    text += (
        f" It depends on {location.coordinate.replace('_', ' ')}, most between {low:.3g} and {high:.3g}"
        f" ({100 * location.share:.0f} % of it repeats there)."
    )
    return f"{text} Something like {STRANGE.get(like, like)} would explain it." if like else text


def constant(value: float, half: float, dry: float, unit: str) -> str:
    """A constant force `value` with the `half` of its interval beside the `dry` friction [unit], and what it may be."""
    return (
        f" The model has a constant force of {value:.3g} {unit} (95 %: ± {half:.1g}), {100 * abs(value) / dry:.0f} % of"
        " the dry friction: a tilt, an offset, friction that differs with the direction: alike while the axis slides."
    )


def denied(name: str, bent: str) -> str:
    """What is like the effect `name` but for how its curve is `bent`."""
    return f"{PLAIN.get(name, name)}, but {bent},"


def _numbers(effect: FoundEffect) -> str:
    """The first two parameters with unit."""
    shown = []
    for name, quantity in list(effect.parameters.items())[:2]:
        unit = "" if quantity.unit == "1" else f" {quantity.unit}"
        shown.append(f"{name.replace('_', ' ')} {quantity.value:.3g}{unit}")
    return ", ".join(shown)
