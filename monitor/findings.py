"""What the watch can say of an axis: kinds of alerts, and whether their condition holds. Values only."""

from __future__ import annotations

import dataclasses
import enum
from dataclasses import dataclass
from typing import Any


class Kind(enum.StrEnum):
    """What an alert can be about."""

    WEAR = "wear"
    LUBRICATION = "lubrication"
    JAM = "jam"
    DATA_QUALITY = "data_quality"
    STALE = "stale"
    MODEL_MISMATCH = "model_mismatch"
    OPERATING_POINT = "operating_point"


@dataclass(frozen=True, slots=True)
class Finding:
    """A condition holds, or does not; with the numbers an alert needs as evidence."""

    kind: Kind
    holds: bool
    evidence: dict[str, Any] = dataclasses.field(default_factory=dict)
