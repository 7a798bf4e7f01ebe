"""What the bridge counts: every frame ends in exactly one of these, every sample is sent, filled or lost."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import Any

from plant.can_layout import show_id

SHOWN = 10  # ids in a list, the most frequent


@dataclass(slots=True)
class FrameCounters:
    """Frames of the bus.

    Attributes:
        frames: received, of all kinds.
        used: of a layout, with the right length.
        sync: SYNC and TIME.
        status: heartbeats and emergencies of a drive that is listed.
        unknown: ids that no layout names, by key.
        wrong_length: ids with another length than their layout's, by (key, length).
        errors: error frames.
        bus_off: error frames that say bus-off.
        remote: remote frames.
        early: frames before the first SYNC.
    """

    frames: int = 0
    used: int = 0
    sync: int = 0
    status: int = 0
    unknown: Counter[int] = field(default_factory=Counter)
    wrong_length: Counter[tuple[int, int]] = field(default_factory=Counter)
    errors: int = 0
    bus_off: int = 0
    remote: int = 0
    early: int = 0

    def to_dict(self) -> dict[str, Any]:
        """For JSON; ids as 0x181."""
        lengths = [
            {"id": show_id(key), "length": length, "frames": count}
            for (key, length), count in self.wrong_length.most_common(SHOWN)
        ]
        return {
            "frames": self.frames,
            "used": self.used,
            "sync": self.sync,
            "status": self.status,
            "unknown": self.unknown.total(),
            "unknown_ids": {show_id(key): count for key, count in self.unknown.most_common(SHOWN)},
            "wrong_length": self.wrong_length.total(),
            "wrong_lengths": lengths,
            "errors": self.errors,
            "bus_off": self.bus_off,
            "remote": self.remote,
            "early": self.early,
        }


@dataclass(slots=True)
class AxisCounters:
    """One axis.

    Attributes:
        samples: complete ones.
        filled: single missing ones that went out as NaN.
        lost: missing ones for which sample numbers were skipped.
        absent: SYNCs while the drive was silent for long: it was off, nothing is lost. [samples]
        refused_samples: not sent because the layout does not fit what the drive sends.
        duplicates: frames of this axis that came twice within one SYNC.
        refused: why nothing is sent, None when all is well.
        state: of the drive, from the statusword.
        unknown_states: statuswords that CiA 402 does not know.
        nmt: state of the node, from its heartbeat.
        heartbeats: received.
        boot_ups: heartbeats that say the node has just started.
        emergencies: by error code.
        last_emergency: the latest error code that was not 0.
    """

    samples: int = 0
    filled: int = 0
    lost: int = 0
    absent: int = 0
    refused_samples: int = 0
    duplicates: int = 0
    refused: str | None = None
    state: str | None = None
    unknown_states: int = 0
    nmt: str | None = None
    heartbeats: int = 0
    boot_ups: int = 0
    emergencies: Counter[int] = field(default_factory=Counter)
    last_emergency: int | None = None

    @property
    def suspicion(self) -> str | None:
        """What looks wrong though samples are sent."""
        if self.duplicates > 20 and self.duplicates > 0.1 * self.samples:
            twice = f"{self.duplicates} frames came twice within one SYNC"
            return f"{twice}: two nodes with this id, or a PDO that is not sent on SYNC?"
        return None

    def to_dict(self) -> dict[str, Any]:
        """For JSON; error codes as 0x8611."""
        from plant.cia402 import emergency

        codes = {f"0x{code:04X}": count for code, count in self.emergencies.most_common(SHOWN)}
        last = self.last_emergency
        return {
            "samples": self.samples,
            "filled": self.filled,
            "lost": self.lost,
            "absent": self.absent,
            "refused_samples": self.refused_samples,
            "refused": self.refused,
            "suspicion": self.suspicion,
            "duplicates": self.duplicates,
            "state": self.state,
            "unknown_states": self.unknown_states,
            "nmt": self.nmt,
            "heartbeats": self.heartbeats,
            "boot_ups": self.boot_ups,
            "emergencies": self.emergencies.total(),
            "emergency_codes": codes,
            "last_emergency": None if last is None else f"0x{last:04X}: {emergency(last)}",
        }
