"""A recording: what a machine did, in SI, with the meaning of its torque samples."""

from __future__ import annotations

import dataclasses
import hashlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from plant.axis import TorqueHold
from plant.errors import RecordingError

Floats = NDArray[np.float64]
LARGEST = 1e12  # of any channel, in SI: what is beyond it no machine has sent, and squares of it would overflow


@dataclass(frozen=True, slots=True, eq=False)
class Recording:
    """Samples of one run of one axis. Values may be unusable (NaN, time running backwards): judging is not reading.

    A value beyond `LARGEST` is as unusable as none, and becomes NaN.

    Attributes:
        t: time stamps, the clock, possibly irregular. [s] (n,)
        force: drive force at the belt, already torque times `Mechanics.gain`. [N; N·m rotary] (n,)
        position: counts upwards on a vertical axis. [m or rad] (n,)
        velocity: as sent by the drive. [m/s or rad/s] (n,) or None
        temperature: [degC] (n,) or None
        load: payload or process load as sent by the machine, for operating points. [kg or 1] (n,) or None
        sample_time: nominal period. [s]
        hold: what a force sample means until the next.
        loop: "open" or "closed".
        note: free text of the axis file.
        source: where it came from, for messages.
        begin_ns: Unix time of `t` = 0, None where the file does not say. [ns]
        remarks: what was odd about the file, for people.

    Raises:
        RecordingError: arrays of different lengths, or empty.
    """

    t: Floats
    force: Floats
    position: Floats
    velocity: Floats | None = None
    temperature: Floats | None = None
    load: Floats | None = None
    sample_time: float | None = None
    hold: TorqueHold = TorqueHold.HOLD
    loop: str = "open"
    note: str = ""
    source: str = ""
    begin_ns: int | None = None
    remarks: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check that all channels are one-dimensional and of one length; leave out what no machine has sent."""
        n = len(self.t)
        if n == 0:
            raise RecordingError(f"{self.source or 'recording'}: no samples")
        for channel in self.channels():
            values = getattr(self, channel)
            if values.shape != (n,):
                raise RecordingError(
                    f"{self.source or 'recording'}: {channel} has shape {values.shape}, t has {n} samples"
                )
            if (beyond := np.abs(values) > LARGEST).any():
                object.__setattr__(self, channel, np.where(beyond, np.nan, values))

    def channels(self) -> tuple[str, ...]:
        """Names of the channels that are present, t first."""
        names = ("t", "force", "position", "velocity", "temperature", "load")
        return tuple(name for name in names if getattr(self, name) is not None)

    def __len__(self) -> int:
        """Count the samples."""
        return len(self.t)

    @property
    def period(self) -> float:
        """Nominal sample time, else the median step. [s]"""
        return float(self.sample_time) if self.sample_time else float(np.median(np.diff(self.t)))

    def window(self, start: int, samples: int) -> Recording:
        """Samples `start` to `start + samples`; clipped at the end of the recording."""
        cut = slice(start, start + samples)
        return dataclasses.replace(self, **{name: getattr(self, name)[cut] for name in self.channels()})

    def sha256(self) -> str:
        """Hash of all channels' bytes: the same data give the same hash on every machine."""
        digest = hashlib.sha256()
        for name in self.channels():
            digest.update(name.encode())
            digest.update(np.ascontiguousarray(getattr(self, name), dtype="<f8").tobytes())
        return digest.hexdigest()
