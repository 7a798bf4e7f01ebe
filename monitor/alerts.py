"""What an alert says to the person who has to act: priority, consequence, cause, action, evidence in words. Pure."""

from __future__ import annotations

from typing import Any

from monitor.advice import advice
from monitor.channels import PARTS
from monitor.findings import Kind
from monitor.times import UNITS, iso, span

SCHEMA_VERSION = 1
RIVALS, NOTICEABLE = 2, 0.005  # causes always shown, and the score from which others are
SHAPE_WORDS = {
    "dry friction": "about the same at every speed",
    "Coulomb level": "about the same at every speed but the lowest",
    "viscous friction": "growing with speed",
    "low-speed friction": "mostly at low speed",
    "film": "up at low speed and down at high speed, or the reverse",
    "less friction": "about the same at every speed, downwards",
    "torque scale": "in proportion to every force, weight or inertia included",
    "payload": "in the weight carried, hardly in friction",
    "outside force": "the same push in both directions, hardly in friction",
    "temperature": "with speed, as temperature does",
    "left-out physics": "in what the model cannot explain",
}


def compose(
    site: str, axis: str, kind: Kind, occurrence: int, state: str, since_ns: int, evidence: dict[str, Any]
) -> dict[str, Any]:
    """The alert as published and stored.

    Args:
        site: where.
        axis: whose.
        kind: what it is about.
        occurrence: how often it was raised; with the others it makes the id.
        state: of ISA-18.2.
        since_ns: event time at which it was raised. [ns]
        evidence: of `findings.Finding`.
    """
    words = advice(kind, evidence.get("cause"))
    return {
        "schema_version": SCHEMA_VERSION,
        "id": f"{site}/{axis}/{kind.value}/{occurrence}",
        "site": site,
        "axis": axis,
        "kind": kind.value,
        "state": state,
        "priority": words.priority,
        "since": iso(since_ns),
        "since_ns": since_ns,
        "consequence": words.consequence,
        "likely_cause": words.likely_cause,
        "recommended_action": words.recommended_action,
        "time_to_act": time_to_act(words.time_to_act, evidence),
        "text": explain(axis, kind, evidence) + _pace(evidence),
        "evidence": evidence,
    }


def _pace(evidence: dict[str, Any]) -> str:
    """What an alert rests on less of than usual."""
    every = evidence.get("hop_stretched", 1)
    return f" Identification is behind: only every {every}th window is made." if every > 1 else ""


def time_to_act(usual: str, evidence: dict[str, Any]) -> str:
    """From the projection where there is one, else what is usual for the kind."""
    remaining = evidence.get("remaining") or {}
    if remaining.get("days") is None:
        return usual
    return f"before {remaining['days_low']:.0f} days are over: the limit may be reached then"


def explain(axis: str, kind: Kind, evidence: dict[str, Any]) -> str:
    """The finding in a few sentences with its numbers."""
    match kind:
        case Kind.JAM:
            where = f"{evidence['speed']:.3g} {evidence['speed_unit']}"
            numbers = f"{evidence['before']:.3g} to {evidence['now']:.3g} {evidence['unit']}"
            return f"{axis}: friction at {where} rose from {numbers} within one window"
        case Kind.STALE:
            silence = span(evidence["silent_ns"])
            return f"{axis}: nothing received for {silence}; latest sample {iso(evidence['last_ns']) or 'never'}"
        case Kind.OPERATING_POINT if evidence.get("cause") in ("not covered", "speed range"):
            return _explain_unknown(axis, evidence)
        case Kind.DATA_QUALITY if "reason" in evidence:
            return _explain_data(axis, evidence)
        case Kind.MODEL_MISMATCH if "finding" in evidence:
            return f"{axis}: {evidence['finding']}"
    return _explain_change(axis, kind, evidence) if "speeds" in evidence else f"{axis}: {kind.value}"


def _explain_data(axis: str, evidence: dict[str, Any]) -> str:
    if "audit" in evidence:
        return f"{axis}: refused, not identified ({evidence['windows']} windows so far): {evidence['reason']}"
    if not evidence["windows"]:
        return f"{axis}: not watched: {evidence['reason']}"
    what = "have more faults than usual" if "shares" in evidence else "cannot be used"
    return f"{axis}: {evidence['windows']} windows in a row {what}: {evidence['reason']}"


def _explain_unknown(axis: str, evidence: dict[str, Any]) -> str:
    """Why wear cannot be judged where the axis works now."""
    if evidence["cause"] == "speed range":
        low, high = evidence["speeds"][0], evidence["speeds"][-1]
        unit = evidence["speed_unit"]
        return (
            f"{axis}: {evidence['windows']} windows in a row do not cover the speeds of the baseline "
            f"({low:.3g} to {high:.3g} {unit}; fastest now {evidence['fastest']:.3g} {unit}): wear cannot be judged"
        )
    units = {"temperature": "degC", "load": "kg"}
    where = ", ".join(
        f"{name} {value:.3g} {units[name]} (baseline {evidence['covered'][name][0]:.3g} to "
        f"{evidence['covered'][name][1]:.3g})"
        for name, value in evidence["conditions"].items()
    )
    unsure = "knows nothing" if evidence["uncertain"] > 1.0 else f"is unsure by {evidence['uncertain']:.0%}"
    return (
        f"{axis}: {evidence['indicator']} is {evidence['relative']:+.0%} off at {where}. There the baseline "
        f"{unsure}, so this is no finding of wear"
    )


def _explain_change(axis: str, kind: Kind, evidence: dict[str, Any]) -> str:
    """What changed, by how much, and which causes compete."""
    since = f"over {span(evidence['until_ns'] - evidence['since_ns'])} ({_count(evidence['windows'], 'window')})"
    said = [f"{axis}: {_numbers(evidence)} {since}."]
    shape = SHAPE_WORDS.get(evidence["shape"], f"in {evidence['shape']}")
    scores = sorted(evidence["rivals"].items(), key=lambda one: -one[1])
    shown = [(name, score) for place, (name, score) in enumerate(scores) if place < RIVALS or score >= NOTICEABLE]
    rivals = ", ".join(f"{name} {score:.0%}" for name, score in shown)
    said.append(f"The change is {shape}: {rivals}.")
    if evidence["shape"] == "torque scale":
        said.append(f"As if the torque were read {evidence['size']:+.0%}.")
    if kind is Kind.WEAR:
        said.append(remaining_words(evidence["remaining"]))
    corrected = " and ".join(evidence["corrected_for"]) or "nothing"
    said.append(
        f"Baseline: {_count(evidence['baseline_windows'], 'window')}{_over(evidence)}, known to "
        f"{evidence['baseline_error']:.1%}, windows scatter by {evidence['baseline_scatter']:.1%}, corrected for "
        f"{corrected}; threshold for at most "
        f"{_count(evidence['false_alarms_per_axis_year'], 'false alarm')} per axis-year."
    )
    return " ".join(said)


def _over(evidence: dict[str, Any]) -> str:
    """What time the baseline spans; alerts of older versions do not say."""
    days = evidence.get("baseline_days")
    return "" if days is None else f" over {span(round(days * UNITS['d']))}"


def _numbers(evidence: dict[str, Any]) -> str:
    middle = len(evidence["speeds"]) // 2
    low, high = evidence["relative_ci95"]
    friction = (
        f"friction at {evidence['speeds'][middle]:.3g} {evidence['speed_unit']} went from "
        f"{evidence['baseline'][middle]:.4g} to {evidence['now'][middle]:.4g} {evidence['unit']} "
        f"({evidence['relative']:+.0%}, 95 % {low:+.0%} to {high:+.0%})"
    )
    name, unit = evidence["indicator"], evidence["indicator_unit"]
    if name.startswith("friction at") or (unit == "1" and name not in PARTS):
        return friction
    before, now, error = (evidence[f"indicator_{key}"] for key in ("baseline", "now", "error"))
    if name in PARTS:
        return f"{friction}, its {name} by {now - before:+.1%} ± {error:.1%}"
    return f"{name} went from {before:.4g} to {now:.4g} ± {error:.2g} {unit}".rstrip() + f"; {friction}"


def remaining_words(remaining: dict[str, Any]) -> str:
    """The projection in words, or why there is none."""
    limit = f"{remaining['limit']:+.0%}"
    if remaining["refused"]:
        return f"No projection to {limit}: {remaining['refused']}."
    if remaining["days"] == 0:
        return f"The limit of {limit} is reached."
    high = "any number of" if remaining["days_high"] is None else f"{remaining['days_high']:.0f}"
    return (
        f"At this pace ({30 * remaining['per_day']:+.1%} in 30 days) {limit} is reached in "
        f"{remaining['days']:.0f} days (95 % {remaining['days_low']:.0f} to {high})."
    )


def _count(number: float, what: str) -> str:
    return f"{number:g} {what}" if number == 1 else f"{number:g} {what}s"
