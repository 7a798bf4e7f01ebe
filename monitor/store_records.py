"""What the store hands out and takes in: values without a database."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from monitor.alarms import Alarm, Transition
from monitor.samples import StreamState


@dataclass(slots=True)
class AxisRecord:
    """What the database knows of an axis; the pipeline keeps it up to date in memory.

    Attributes:
        id: its row.
        listed: False when it streams without being listed in the configuration.
        stream: what the assembler needs to go on.
        samples, missing: received, and known to be missing. [1]
        last_ns: latest sample. [ns]
        rejected: refused samples and payloads, by reason. [1]
        drift: `DriftState.to_dict()`.
        verdicts: answers by verdict. [1]
        version: of its constants and model, see `VersionRecord`.
        effects: promoted effects of that version.
    """

    id: int
    name: str
    listed: bool
    stream: StreamState = field(default_factory=StreamState)
    samples: int = 0
    missing: int = 0
    last_ns: int | None = None
    rejected: dict[str, int] = field(default_factory=dict)
    drift: dict[str, Any] | None = None
    verdicts: dict[str, int] = field(default_factory=dict)
    version: int = 1
    effects: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class AlarmRecord:
    """An alarm as stored: its state machine, how often it was raised, its latest alert."""

    kind: str
    alarm: Alarm = field(default_factory=Alarm)
    occurrence: int = 0
    alert: dict[str, Any] | None = None


@dataclass(frozen=True, slots=True)
class Change:
    """An alarm's transition with the alert as it was then, to be stored and published."""

    transition: Transition
    record: AlarmRecord
    author: str = ""


@dataclass(frozen=True, slots=True)
class EventRecord:
    """Something that was done to an axis; with `new_baseline` the watch learns anew. `at_ns` is event time. [ns]"""

    at_ns: int
    kind: str
    text: str
    author: str
    new_baseline: bool = False


@dataclass(frozen=True, slots=True)
class VersionRecord:
    """What an axis' model is from an event time on.

    Attributes:
        version: counts up from 1.
        from_ns: first event time it holds for. [ns]
        constants: of the axis file, SI; see `axis_versions.constants_of`.
        effects: promoted effects by name, with what their model needs.
        author, why: who changed what.
    """

    version: int
    from_ns: int
    constants: dict[str, Any]
    effects: dict[str, Any] = field(default_factory=dict)
    author: str = ""
    why: str = ""


@dataclass(frozen=True, slots=True)
class DiagnosisRecord:
    """A diagnosis of an axis' windows.

    Attributes:
        at_ns: event time of its newest window. [ns]
        from_ns, to_ns: first and last sample looked at. [ns]
        verdict: of `tribowatch diagnose`.
        result: its JSON.
        windows: [epoch, first_seq, samples] of each window.
        seconds: what it took. [s]
    """

    at_ns: int
    from_ns: int
    to_ns: int
    verdict: str
    result: dict[str, Any]
    windows: list[Any]
    seed: int
    software: str
    seconds: float


@dataclass(frozen=True, slots=True)
class Letter:
    """A transition that a receiver outside is to be told; `next_ns` is when, on the wall clock. [ns]"""

    id: int
    receiver: str
    tries: int
    next_ns: int
    axis: str
    transition: dict[str, Any]
