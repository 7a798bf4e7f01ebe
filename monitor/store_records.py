"""What the store hands out and takes in: values without a database."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from monitor.alarms import Alarm, Transition
from monitor.windows import StreamState


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
