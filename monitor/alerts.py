"""What an alert says to the person who has to act: priority, consequence, cause, action, evidence in words. Pure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from monitor.drift import Kind
from monitor.times import iso, span

SCHEMA_VERSION = 1


@dataclass(frozen=True, slots=True)
class Advice:
    """What is known about a kind of alert before anything was measured."""

    priority: str
    consequence: str
    likely_cause: str
    recommended_action: str


ADVICE = {
    Kind.WEAR: Advice(
        "medium",
        "the drive works harder, position errors grow; in the end the guide is damaged",
        "wear or dirt of the guide, the carriage or the belt; too much pre-load or belt tension",
        "inspect guide, carriage and belt of this axis; clean, re-tension or replace; then let it learn anew",
    ),
    Kind.LUBRICATION: Advice(
        "medium",
        "dry running wears the guide quickly; too much or too stiff grease heats it",
        "lubricant lost, aged or changed; a cold axis behaves the same",
        "check temperature first, then lubricate as the maker says; if it was just lubricated, let the axis run in",
    ),
    Kind.JAM: Advice(
        "high",
        "the axis may stall, trip or break parts",
        "a foreign body, a broken bearing, a brake that drags, or a collision",
        "stop the axis, look for obstacles, check the brake and turn it by hand before going on",
    ),
    Kind.DATA_QUALITY: Advice(
        "low",
        "this axis is not watched while its data cannot be used",
        "a sensor that is frozen or disconnected, a wrong unit, or a clock that steps",
        "look at the reason, check sensor, cable and the gateway's clock",
    ),
    Kind.STALE: Advice(
        "low",
        "this axis is not watched while nothing arrives",
        "the machine is off, or its gateway or the network is down",
        "check whether the machine runs, then its gateway; tribowatch doctor shows the links",
    ),
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
        evidence: of `drift.Finding`.
    """
    advice = ADVICE[kind]
    return {
        "schema_version": SCHEMA_VERSION,
        "id": f"{site}/{axis}/{kind.value}/{occurrence}",
        "site": site,
        "axis": axis,
        "kind": kind.value,
        "state": state,
        "priority": advice.priority,
        "since": iso(since_ns),
        "since_ns": since_ns,
        "consequence": advice.consequence,
        "likely_cause": advice.likely_cause,
        "recommended_action": advice.recommended_action,
        "text": explain(axis, kind, evidence) + _pace(evidence),
        "evidence": evidence,
    }


def _pace(evidence: dict[str, Any]) -> str:
    """What an alert rests on less of than usual."""
    every = evidence.get("hop_stretched", 1)
    return f" Identification is behind: only every {every}th window is made." if every > 1 else ""


def explain(axis: str, kind: Kind, evidence: dict[str, Any]) -> str:
    """The finding in one or two sentences with its numbers."""
    match kind:
        case Kind.WEAR | Kind.LUBRICATION:
            return _explain_change(axis, kind, evidence)
        case Kind.JAM:
            where = f"{evidence['speed']:.3g} {evidence['speed_unit']}"
            numbers = f"{evidence['before']:.3g} to {evidence['now']:.3g} {evidence['unit']}"
            return f"{axis}: friction at {where} rose from {numbers} within two windows"
        case Kind.DATA_QUALITY if "audit" in evidence:
            return f"{axis}: refused, not identified ({evidence['windows']} windows so far): {evidence['reason']}"
        case Kind.DATA_QUALITY if not evidence["windows"]:
            return f"{axis}: not watched: {evidence['reason']}"
        case Kind.DATA_QUALITY:
            return f"{axis}: {evidence['windows']} windows in a row cannot be used: {evidence['reason']}"
        case Kind.STALE:
            silence = span(evidence["silent_ns"])
            return f"{axis}: nothing received for {silence}; latest sample {iso(evidence['last_ns']) or 'never'}"
    return f"{axis}: {kind.value}"


def _explain_change(axis: str, kind: Kind, evidence: dict[str, Any]) -> str:
    middle = len(evidence["speeds"]) // 2
    unit, speed_unit = evidence["unit"], evidence["speed_unit"]
    low, high = evidence["relative_ci95"]
    shape = {
        "dry friction": "about the same at every speed",
        "Coulomb level": "about the same at every speed but the lowest",
        "viscous friction": "growing with speed",
        "low-speed friction": "mostly at low speed",
    }[evidence["shape"]]
    rival = Kind.LUBRICATION if kind is Kind.WEAR else Kind.WEAR
    where = f"{evidence['speeds'][middle]:.3g} {speed_unit}"
    return (
        f"{axis}: friction at {where} went from {evidence['baseline'][middle]:.4g} "
        f"to {evidence['now'][middle]:.4g} {unit} ({evidence['relative']:+.0%}, 95 % {low:+.0%} to {high:+.0%}) "
        f"over {span(evidence['until_ns'] - evidence['since_ns'])} ({evidence['windows']} windows). "
        f"The change is {shape}: {kind.value} {evidence['score']:.0%}, {rival.value} {1 - evidence['score']:.0%}. "
        f"Baseline: {evidence['baseline_windows']} windows; threshold for at most "
        f"{evidence['false_alarms_per_axis_year']:g} false alarms per axis-year."
    )
