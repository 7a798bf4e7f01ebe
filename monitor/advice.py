"""What is known of each kind of alert before anything was measured: consequence, cause, action. Values."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

from monitor.findings import Kind


@dataclass(frozen=True, slots=True)
class Advice:
    """Words of an alert.

    Attributes:
        priority: low, medium or high.
        consequence, likely_cause, recommended_action: one sentence each.
        time_to_act: within which the action is due, where no projection says it better.
    """

    priority: str
    consequence: str
    likely_cause: str
    recommended_action: str
    time_to_act: str


ADVICE = {
    Kind.WEAR: Advice(
        "medium",
        "the drive works harder, position errors grow; in the end the guide is damaged",
        "wear or dirt of the guide, the carriage or the belt; too much pre-load or belt tension",
        "inspect guide, carriage and belt of this axis; clean, re-tension or replace; then note it: "
        "`tribowatch axes event AXIS TEXT --new-baseline`",
        "at the next planned stop",
    ),
    Kind.LUBRICATION: Advice(
        "medium",
        "dry running wears the guide quickly; too much or too stiff grease heats it",
        "lubricant lost, aged or changed",
        "lubricate as the maker says; if it was just lubricated, let the axis run in; then note it: "
        "`tribowatch axes event AXIS TEXT --new-baseline`",
        "within days",
    ),
    Kind.JAM: Advice(
        "high",
        "the axis may stall, trip or break parts",
        "a foreign body, a broken bearing, a brake that drags, or a collision",
        "stop the axis, look for obstacles, check the brake and turn it by hand before going on",
        "now",
    ),
    Kind.DATA_QUALITY: Advice(
        "low",
        "this axis is not watched while its data cannot be trusted",
        "a sensor that is frozen or disconnected, a wrong unit, or a clock that steps",
        "look at the reason, check sensor, cable and the gateway's clock",
        "within days: nothing else is noticed meanwhile",
    ),
    Kind.STALE: Advice(
        "low",
        "this axis is not watched while nothing arrives",
        "the machine is off, or its gateway or the network is down",
        "check whether the machine runs, then its gateway; tribowatch doctor shows the links",
        "when the machine should be running",
    ),
    Kind.OPERATING_POINT: Advice(
        "low",
        "wear cannot be judged at this operating point; the axis itself may be well",
        "a payload, temperature, cycle or outside force that the baseline has not seen",
        "compare with what production did; if this is how the axis will run, let it learn anew: "
        "`tribowatch axes relearn AXIS`",
        "when convenient",
    ),
    Kind.MODEL_MISMATCH: Advice(
        "medium",
        "parameters are less trustworthy, and something about the machine may have begun to fail",
        "physics the model does not hold: damage at one place, play, a soft belt, ripple of a motor or pulley",
        "read the diagnosis; when it names an effect, look there, and let it be followed: "
        "`tribowatch axes promote AXIS EFFECT`",
        "at the next planned stop",
    ),
}
CAUSES = {
    "torque scale": {
        "likely_cause": "torque constant, gear ratio or current scaling changed: motor or drive replaced, weak magnets",
        "recommended_action": "compare rated torque and torque constant in the drive with the axis file",
        "consequence": "every force is wrong by the same factor; friction did not change",
    },
    "payload": {
        "likely_cause": "the axis carries another payload than in the baseline",
        "recommended_action": "report the load with the stream, or let the axis learn anew with its new payload",
    },
    "outside force": {
        "likely_cause": "a constant force from outside: tilt, cable chain, counterbalance, another axis that pulls",
        "recommended_action": "look for what pulls at the axis in one direction",
    },
    "temperature": {
        "likely_cause": "temperature: friction moved with speed as it does when a lubricant is colder or warmer",
        "recommended_action": "report the temperature with the stream, so that it can be corrected for",
    },
    "not covered": {
        "likely_cause": "temperature or load outside of what the baseline saw",
        "recommended_action": "nothing yet: the watch learns from such windows as long as the axis is healthy",
    },
    "speed range": {
        "likely_cause": "the axis now runs slower, or over a shorter stroke, than when the baseline was learned",
        "recommended_action": "if this is how the axis will run, let it learn anew: `tribowatch axes relearn AXIS`",
    },
    "less friction": {
        "likely_cause": "fresh lubricant, running-in, less pre-load or belt tension than before",
        "recommended_action": "if it was just serviced, note it: "
        "`tribowatch axes event AXIS TEXT --new-baseline`; else check the tension",
    },
    "viscous friction": {"likely_cause": "lubricant stiffer or thinner than before: another grade, aged, contaminated"},
    "low-speed friction": {"likely_cause": "the film fails at low speed: too little lubricant, or the wrong one"},
    "film": {"likely_cause": "the film is being lost: more friction at low speed, less drag at high speed"},
}


def advice(kind: Kind, cause: str | None) -> Advice:
    """The words for `kind`, sharpened by its cause where one is known."""
    return dataclasses.replace(ADVICE[kind], **CAUSES.get(cause or "", {}))
