"""What stands between the machine and its recording: pure functions from recording to recording, chance passed in.

`Sensors.apply` composes them in the order in which a machine does: the drive reports its torque from the fast loop, the
position passes delay, noise and quantisation, the torque noise and quantisation; then the reading may freeze or spike,
stamps jitter, and samples get lost on the way. Other orders are one line of user code.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from plant.axis import TorqueHold
from plant.errors import ParameterError
from plant.recording import Recording

Floats = NDArray[np.float64]
PER_MILLE = 1e-3  # drives report torque as integer per mille of rated (CiA 402, object 6077h)
LARGEST_JITTER = 0.45  # of the step: stamps keep their order


def decimate(recording: Recording, factor: int, force: Literal["sample", "mean"] = "sample") -> Recording:
    """Record a fast loop at 1/`factor` of its rate: every `factor`-th row, from the first.

    Args:
        recording: at the loop's rate.
        factor: >= 1.
        force: "sample" keeps the value of the instant and leaves its meaning unknown, "mean" averages over the
            following sample.

    Raises:
        ParameterError: factor below 1 or beyond the recording.
    """
    if not 1 <= factor <= len(recording):
        raise ParameterError("decimation factor", factor, f"between 1 and the {len(recording)} samples there are")
    if factor == 1:
        return recording
    rows = slice(0, len(recording) // factor * factor, factor)
    columns = {name: getattr(recording, name)[rows] for name in recording.channels()}
    if force == "mean":
        whole = recording.force[: len(columns["t"]) * factor]
        columns["force"] = whole.reshape(-1, factor).mean(axis=1)
    period = None if recording.sample_time is None else recording.sample_time * factor
    hold = TorqueHold.MEAN if force == "mean" else TorqueHold.UNKNOWN
    return dataclasses.replace(recording, **columns, sample_time=period, hold=hold)


def delay_position(recording: Recording, delay: float) -> Recording:
    """Report the position as it was `delay` [s] ago, straight between samples; the first value before the start."""
    _at_least_zero("position delay", delay, "s")
    late = np.interp(recording.t - delay, recording.t, recording.position)
    return dataclasses.replace(recording, position=late)


def add_position_noise(recording: Recording, deviation: float, rng: Generator) -> Recording:
    """Add white Gaussian noise of standard `deviation` [m]; §4.6 has variance 1e-6 m², that is 1e-3 m."""
    _at_least_zero("position noise", deviation, "m")
    noise = deviation * rng.standard_normal(len(recording))
    return dataclasses.replace(recording, position=recording.position + noise)


def add_force_noise(recording: Recording, deviation: float, rng: Generator) -> Recording:
    """Add white Gaussian noise of standard `deviation` [N] to the reported force; the machine felt the true one."""
    _at_least_zero("force noise", deviation, "N")
    noise = deviation * rng.standard_normal(len(recording))
    return dataclasses.replace(recording, force=recording.force + noise)


def quantise_position(recording: Recording, step: float) -> Recording:
    """Round the position to multiples of `step` [m]; 0 leaves it."""
    return dataclasses.replace(recording, position=_rounded(recording.position, step, "position resolution", "m"))


def quantise_force(recording: Recording, step: float) -> Recording:
    """Round the force to multiples of `step` [N]; 0 leaves it."""
    return dataclasses.replace(recording, force=_rounded(recording.force, step, "force resolution", "N"))


def quantise_force_per_mille(recording: Recording, rated_force: float, counts: float = 1.0) -> Recording:
    """Round the force to `counts` per mille of `rated_force` [N], as drives report it."""
    return quantise_force(recording, counts * PER_MILLE * rated_force)


def freeze_position(recording: Recording, start: float, duration: float) -> Recording:
    """Let the position stand still from `start` for `duration` [s after the first stamp] at the value it had."""
    _at_least_zero("freeze duration", duration, "s")
    since = recording.t - recording.t[0]
    frozen = (since >= start) & (since < start + duration)
    position = recording.position.copy()
    if frozen.any():
        position[frozen] = position[int(np.argmax(frozen))]
    return dataclasses.replace(recording, position=position)


def add_spikes(recording: Recording, rate: float, size: float, rng: Generator) -> Recording:
    """Let single readings of the position, the fraction `rate` of them, jump by `size` [m] up or down.

    Raises:
        ParameterError: rate outside 0..1.
    """
    if not 0 <= rate < 1:
        raise ParameterError("spike rate", rate, "in 0 <= rate < 1")
    jumps = np.where(rng.random(len(recording)) < rate, size, 0.0) * rng.choice((-1.0, 1.0), len(recording))
    return dataclasses.replace(recording, position=recording.position + jumps)


def jitter_stamps(recording: Recording, deviation: float, rng: Generator) -> Recording:
    """Move each stamp by Gaussian noise of `deviation` [s], never past a neighbour; the values stay as they are."""
    _at_least_zero("stamp jitter", deviation, "s")
    if len(recording) < 2:
        return recording
    limit = LARGEST_JITTER * float(np.diff(recording.t).min())
    moved = recording.t + np.clip(deviation * rng.standard_normal(len(recording)), -limit, limit)
    return dataclasses.replace(recording, t=moved)


def drop_samples(recording: Recording, rate: float, rng: Generator, length: int = 1) -> Recording:
    """Lose samples: runs of `length` begin at random until about the fraction `rate` is gone; the first stays.

    Raises:
        ParameterError: rate outside 0..1, length below 1.
    """
    if not 0 <= rate < 1:
        raise ParameterError("dropout rate", rate, "in 0 <= rate < 1")
    if length < 1:
        raise ParameterError("dropout length", length, ">= 1", "samples")
    begins = rng.random(len(recording)) < -math.expm1(math.log1p(-rate) / length)
    lost = np.convolve(begins, np.ones(length))[: len(recording)] > 0
    lost[0] = False
    return dataclasses.replace(recording, **{name: getattr(recording, name)[~lost] for name in recording.channels()})


@dataclass(frozen=True, slots=True)
class Sensors:
    """Sensors and drive of an axis; 0 switches a part off.

    Attributes:
        position_delay: [s]
        position_noise: standard deviation. [m]
        position_resolution: [m]
        torque_noise: standard deviation, at the motor. [N·m]
        torque_resolution: at the motor. [N·m]
        torque_per_mille: counts of per mille of rated torque that the drive resolves; needs the rated force. [1]
        freeze_start: when the position reading freezes. [s into the run]
        freeze_duration: for how long. [s]
        spike_rate: fraction of position readings that jump. [1]
        spike_size: by how much. [m]
        stamp_jitter: standard deviation. [s]
        dropout_rate: fraction of samples lost. [1]
        dropout_length: samples lost at a time. [samples]
        report_velocity: the recording carries the velocity.
        report_temperature: the recording carries the temperature.
        report_load: the recording carries the load.
    """

    position_delay: float = 0.0
    position_noise: float = 0.0
    position_resolution: float = 0.0
    torque_noise: float = 0.0
    torque_resolution: float = 0.0
    torque_per_mille: float = 0.0
    freeze_start: float = 0.0
    freeze_duration: float = 0.0
    spike_rate: float = 0.0
    spike_size: float = 0.0
    stamp_jitter: float = 0.0
    dropout_rate: float = 0.0
    dropout_length: int = 1
    report_velocity: bool = False
    report_temperature: bool = False
    report_load: bool = False

    def apply(self, recording: Recording, gain: float, rated_force: float | None, rng: Generator) -> Recording:
        """Send `recording` through sensors and drive, in the order of the module's text.

        Args:
            recording: what truly happened, at the stream's rate.
            gain: `Mechanics.gain`, torque to force. [N per N·m]
            rated_force: of the drive. [N] or None
            rng: chance of noise, spikes, jitter and dropouts; drawn in this order, only for the parts that are on.

        Raises:
            ParameterError: a value out of range; per mille wanted without a rated force.
        """
        seen = delay_position(recording, self.position_delay) if self.position_delay else recording
        if self.position_noise:
            seen = add_position_noise(seen, self.position_noise, rng)
        seen = quantise_position(seen, self.position_resolution)
        if self.torque_noise:
            seen = add_force_noise(seen, self.torque_noise * abs(gain), rng)
        seen = quantise_force(seen, self.torque_resolution * abs(gain))
        if self.torque_per_mille:
            if rated_force is None:
                raise ParameterError("torque_per_mille", self.torque_per_mille, "0 on an axis without rated force")
            seen = quantise_force_per_mille(seen, rated_force, self.torque_per_mille)
        if self.freeze_duration:
            seen = freeze_position(seen, self.freeze_start, self.freeze_duration)
        if self.spike_rate:
            seen = add_spikes(seen, self.spike_rate, self.spike_size, rng)
        if self.stamp_jitter:
            seen = jitter_stamps(seen, self.stamp_jitter, rng)
        return drop_samples(seen, self.dropout_rate, rng, self.dropout_length) if self.dropout_rate else seen


def _at_least_zero(name: str, value: float, unit: str) -> None:
    if not (math.isfinite(value) and value >= 0):
        raise ParameterError(name, value, ">= 0", unit)


def _rounded(values: Floats, step: float, name: str, unit: str) -> Floats:
    _at_least_zero(name, step, unit)
    return np.round(values / step) * step if step else values
