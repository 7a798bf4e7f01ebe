"""When is a diagnosis of an axis worth its time, and what does it say until the next? Pure."""

from __future__ import annotations

import collections
import dataclasses
import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from monitor.channels import CLEAN, REFERENCES, UNEXPLAINED
from monitor.diagnosing import finding_of, promotable
from monitor.drift_state import DriftState
from monitor.findings import Finding, Kind
from monitor.samples import Window
from monitor.store_records import DiagnosisRecord

WINDOWS = 3  # diagnosed together; the last is held out
SETTLED = 3  # windows the condition lasts before a diagnosis: all that are diagnosed show it
GROWN = 1.5  # times the unexplained force of the last diagnosis
APART, RETRY = 10, 4  # windows between two diagnoses; after one that found no name, doubled with each such one ...
LONGEST = 256  # ... up to this: what nobody can name costs hardly anything
GONE = 10  # windows without the condition, after which it is forgotten: the next one is another
STRUCTURE = 3.0  # times what a complete model leaves: a model that lacks something from the beginning


@dataclass(slots=True)
class MismatchWatch:
    """The mismatch of one axis.

    Attributes:
        windows: the latest informative ones, oldest first.
        since: windows for which the condition has held.
        waited: windows since the latest diagnosis.
        force: unexplained force at the latest diagnosis; nan after a restart, until the next window tells. [N or N·m]
        asked: the first diagnosis is on its way, or was made.
        nameless: diagnoses one after the other that found no name, or came to nothing.
        absent: windows for which the condition has been gone.
        latest: diagnosis; None before the first, after the model changed, and when the condition is gone for good.
    """

    windows: collections.deque[Window] = field(default_factory=lambda: collections.deque(maxlen=WINDOWS))
    since: int = 0
    waited: int = 0
    force: float = 0.0
    asked: bool = False
    nameless: int = 0
    absent: int = 0
    latest: DiagnosisRecord | None = None

    def take(self, diagnosis: DiagnosisRecord) -> None:
        """A diagnosis was made."""
        self.latest, self.asked = diagnosis, True
        self.nameless = 0 if promotable(diagnosis.result) else self.nameless + 1

    def restore(self, diagnosis: DiagnosisRecord, windows: Iterable[Window]) -> None:
        """A diagnosis of `windows` was made before a restart, and what it found still stands."""
        self.take(diagnosis)
        self.windows.extend(windows)
        self.force = math.nan

    def fail(self) -> None:
        """A diagnosis crashed or took too long."""
        self.nameless += 1

    def forget(self) -> None:
        """What was found does not count any more."""
        self.latest, self.asked, self.nameless = None, False, 0
        self.since = self.waited = 0
        self.force = 0.0

    def note(self, window: Window, holds: bool, force: float) -> bool:
        """Take an informative window; True where a diagnosis is due.

        Args:
            window: it.
            holds: more force is left unexplained than there should be.
            force: unexplained in this window. [N or N·m]
        """
        self.windows.append(window)
        self.since = self.since + 1 if holds else 0
        self.absent = 0 if holds else self.absent + 1
        self.waited += 1
        if math.isnan(self.force):
            self.force = force
        if self.absent == GONE:
            self.forget()
        if self.since < SETTLED or len(self.windows) < SETTLED:
            return False
        if self.latest is None and not self.nameless:
            due = not self.asked
        elif self.latest is not None and promotable(self.latest.result):
            due = self.waited >= APART and force > GROWN * self.force
        else:
            due = self.waited >= min(RETRY * 2 ** max(self.nameless - 1, 0), LONGEST)
        if due:
            self.waited, self.force, self.asked = 0, force, True
        return due

    def add(self, finding: Finding) -> Finding:
        """The finding of a mismatch with what the latest diagnosis says."""
        if self.latest is None or not finding.holds:
            return finding
        return dataclasses.replace(finding, evidence=finding.evidence | told(self.latest))


def told(diagnosis: DiagnosisRecord) -> dict[str, Any]:
    """What an alert shows of a diagnosis."""
    keys = ("verdict", "effects", "alternatives", "location", "remaining_force", "next_experiment", "explanation")
    return {
        "finding": finding_of(diagnosis.result),
        "promote": promotable(diagnosis.result),
        "diagnosis": {name: diagnosis.result.get(name) for name in keys} | {"at_ns": diagnosis.at_ns},
    }


def structure_of(state: DriftState) -> bool:
    """Whether the model lacked something from the beginning: the baseline itself leaves too much unexplained."""
    baseline = state.baseline
    index = baseline.index(UNEXPLAINED) if baseline else None
    if baseline is None or index is None:
        return False
    friction = float(abs(baseline.friction[REFERENCES // 2]))
    left = float(np.exp(baseline.moments.mean_y[index])) - CLEAN * friction
    return left > STRUCTURE * CLEAN * friction


def holds_in(findings: list[Finding]) -> bool:
    """Whether a mismatch is among `findings`."""
    return any(finding.kind is Kind.MODEL_MISMATCH and finding.holds for finding in findings)
