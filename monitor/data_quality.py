"""Can the data of an axis be trusted? Windows that are refused, or with more faults than they always have. Pure."""

from __future__ import annotations

import dataclasses
import re
from dataclasses import dataclass
from typing import Any

import numpy as np

from monitor.estimate import Estimate
from monitor.findings import Finding, Kind

COUNTED = {
    "positions of a frozen sensor not used": "frozen position",
    "samples of a frozen force left out": "frozen force",
    "position outliers not used": "position outliers",
    "position outliers against the fitted model not used": "position outliers",
    "jumps of the position zero, new run begun": "jumps of the position",
    "force spikes replaced by their neighbours": "force spikes",
}
NOTICEABLE, MUCH = 1e-3, 0.05  # share of a window's samples: how sensors are; a fault even on an axis not known yet
MORE = 3.0  # times what this axis always had
KNOWN_WINDOWS, USUAL_WINDOWS = 5, 20  # good windows from which on, at most, it is known what an axis always has
JITTER = 0.1  # of the sample time: stamps of a healthy gateway scatter less


@dataclass(frozen=True, slots=True)
class Quality:
    """What is remembered of an axis' data.

    Attributes:
        bad_run: bad_data windows in a row. [1]
        faulty_run: windows in a row with more faults than usual. [1]
        usual: shares of faults of the latest windows without news, by fault. [1]
    """

    bad_run: int = 0
    faulty_run: int = 0
    usual: tuple[dict[str, float], ...] = ()

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Quality:
        """Read what `dataclasses.asdict` wrote, through JSON."""
        return cls(**{**values, "usual": tuple(values["usual"])})


def faults_of(notes: list[str], samples: int, jitter: float) -> dict[str, float]:
    """Shares of a window's samples that were at fault, by fault; from the words of the preprocessing.

    Args:
        notes: "what: count", other words are passed over.
        samples: of the window.
        jitter: standard deviation of the time steps over their median. [1]
    """
    shares: dict[str, float] = {}
    for note in notes:
        if (found := re.fullmatch(r"(.+): (\d+)", note)) and (name := COUNTED.get(found[1])):
            shares[name] = shares.get(name, 0.0) + int(found[2]) / max(samples, 1)
    if jitter > JITTER:
        shares["jitter of the stamps"] = jitter
    return shares


def judge_quality(quality: Quality, estimate: Estimate, needed: int) -> tuple[Quality, Finding]:
    """Take one estimate; say whether the data deserve a person's attention.

    Args:
        quality: what is remembered.
        estimate: any verdict.
        needed: windows in a row. [1]
    """
    bad = quality.bad_run + 1 if estimate.verdict == "bad_data" else 0
    news = {} if bad else _news(quality, estimate.faults)
    faulty = quality.faulty_run + 1 if news else 0
    usual = quality.usual if news or bad else (*quality.usual, estimate.faults)[-USUAL_WINDOWS:]
    after = dataclasses.replace(quality, bad_run=bad, faulty_run=faulty, usual=usual)
    if bad >= needed:
        return after, Finding(Kind.DATA_QUALITY, True, {"windows": bad, "reason": estimate.reason, "cause": "bad data"})
    if faulty >= needed:
        worst = max(news, key=lambda name: news[name])
        words = ", ".join(f"{name} {share:.1%}" for name, share in sorted(news.items(), key=lambda one: -one[1]))
        reason = f"{words} of the samples; usual for this axis: {_usual(quality, worst):.1%}"
        evidence = {"windows": faulty, "reason": reason, "cause": worst, "shares": news}
        return after, Finding(Kind.DATA_QUALITY, True, evidence)
    return after, Finding(Kind.DATA_QUALITY, False)


def _news(quality: Quality, faults: dict[str, float]) -> dict[str, float]:
    least = NOTICEABLE if len(quality.usual) >= KNOWN_WINDOWS else MUCH
    return {name: share for name, share in faults.items() if share > least and share > MORE * _usual(quality, name)}


def _usual(quality: Quality, name: str) -> float:
    return float(np.median([one.get(name, 0.0) for one in quality.usual])) if quality.usual else 0.0
