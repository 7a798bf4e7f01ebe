"""Which windows of a stream are audited before they are believed, and what the audits said so far. Pure.

A stream is audited when it begins: at the daemon's start (the axis file may have changed), with every new epoch, when
it changes from torque to force or its sample time, and when its scale leaps from one window to the next. Auditing goes
on until enough windows in a row have passed; so nothing is identified between a refusal and the next good window.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from monitor.drift import Finding, Kind
from monitor.estimate import Estimate
from monitor.samples import Samples

PASSES = 3  # windows in a row whose sign and scale could be judged; one alone may be an odd motion
LEAP = 3.0  # ratio of drive or travel between two windows: another unit, or a very different job
STEP_CHANGE = 1.2  # ratio of sample times
ONE_SIDED = 0.3  # of the rms: a mean beyond it has a sign worth comparing


@dataclass(frozen=True, slots=True)
class Signature:
    """What a window looks like from afar: enough to see that its unit may have changed."""

    epoch: int
    is_force: bool
    step_ns: float
    drive: float
    travel: float
    side: int

    @classmethod
    def of(cls, samples: Samples) -> Signature:
        """Of the raw samples of a window."""
        drive = samples.drive[np.isfinite(samples.drive)]
        position = samples.position[np.isfinite(samples.position)]
        with np.errstate(over="ignore"):  # a stranger's 1e300
            rms = float(np.sqrt(np.mean(drive**2))) if len(drive) else 0.0
            mean = float(np.mean(drive)) if len(drive) else 0.0
            travel = float(np.ptp(position)) if len(position) else 0.0
        return cls(
            epoch=samples.epoch,
            is_force=samples.is_force,
            step_ns=float(np.median(np.diff(samples.t_ns))) if len(samples) > 1 else 0.0,
            drive=rms,
            travel=travel,
            side=int(math.copysign(1, mean)) if abs(mean) > ONE_SIDED * rms else 0,
        )

    def differs(self, before: Signature) -> bool:
        """Whether a change of sign, unit or scale may lie between two windows."""
        if (self.epoch, self.is_force) != (before.epoch, before.is_force) or self.side * before.side < 0:
            return True
        pairs = ((self.step_ns, before.step_ns, STEP_CHANGE), (self.drive, before.drive, LEAP))
        return any(_apart(now, then, most) for now, then, most in (*pairs, (self.travel, before.travel, LEAP)))


def _apart(now: float, then: float, most: float) -> bool:
    return now > 0 and then > 0 and not 1 / most <= now / then <= most


@dataclass(slots=True)
class AuditWatch:
    """The audits of one axis.

    Attributes:
        passes: windows in a row that were judged and not refused, of those answered.
        refused: windows in a row that were refused.
        last: what the latest window looked like.
        since: (epoch, number) of the first window that counts; answers of earlier ones say nothing of the stream now.
        finding: what the latest refusal said; None while nothing is refused.
    """

    passes: int = 0
    refused: int = 0
    last: Signature | None = None
    since: tuple[int, int] = (-1, 0)
    finding: dict[str, Any] | None = None

    def due(self, samples: Samples) -> bool:
        """Whether this window, the next in order, is to be audited."""
        signature = Signature.of(samples)
        if self.last is not None and signature.differs(self.last):
            self.passes, self.since = 0, (samples.epoch, samples.seq)
        self.last = signature
        return self.passes < PASSES

    def hear(self, estimate: Estimate) -> None:
        """Take an answer, in order."""
        audit, window = estimate.result.get("audit"), estimate.window.id
        if not isinstance(audit, dict) or (window.epoch, window.first_seq) < self.since:
            return
        if audit["verdict"] == "refuse":
            self.passes, self.refused, self.finding = 0, self.refused + 1, audit["findings"][0]
        elif audit["judged"]:
            self.passes, self.refused, self.finding = self.passes + 1, 0, None

    @property
    def state(self) -> str:
        """For the status: auditing, passed or refused."""
        return "refused" if self.finding else "passed" if self.passes >= PASSES else "auditing"

    def quality(self, found: list[Finding]) -> list[Finding]:
        """`found`, with the refusal as its finding of data quality while there is one."""
        if self.finding is None:
            return found
        evidence = {"windows": self.refused, "reason": self.finding["text"], "audit": self.finding}
        others = [finding for finding in found if finding.kind is not Kind.DATA_QUALITY]
        return [Finding(Kind.DATA_QUALITY, True, evidence), *others]
