"""What the frames of a CAN bus mean: signals in frames, frames of an axis, and their compiled decoding. Pure.

A signal is bits of a frame, as DBC files describe them: Intel (little-endian) or Motorola (big-endian) order, signed or
not, integer or IEEE 754. `decode_signal` reads one signal of many frames at once by numpy; `cantools` says the same
(tests/plant/test_can_layout.py compares them).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from plant.errors import ParameterError
from plant.recording import Floats

Bytes = NDArray[np.uint8]
EXTENDED = 1 << 29  # set in a key for a 29-bit id: 0x181 standard and 0x181 extended are different frames
SAMPLED = ("torque", "force", "position")  # channels without which there is no sample


def frame_key(can_id: int, extended: bool = False) -> int:
    """The number under which a frame is looked up: its id, with a flag for 29-bit ids."""
    return can_id | EXTENDED if extended else can_id


def show_id(key: int) -> str:
    """An id as people write it: 0x181, or 0x18FF0102x for a 29-bit one."""
    return f"0x{key & ~EXTENDED:08X}x" if key & EXTENDED else f"0x{key:03X}"


@dataclass(frozen=True, slots=True)
class Signal:
    """Bits of a frame that carry one channel.

    Attributes:
        channel: torque, force, position, velocity, temperature, load, or statusword, error_code (watched, not sent).
        start: start bit in the DBC's counting: of the lowest bit (Intel) or the highest (Motorola).
        length: [bits] 1 ... 64
        big_endian: Motorola order.
        signed: two's complement.
        is_float: IEEE 754, 32 or 64 bits.
        scale: SI per count.
        offset: SI at count 0.
        name: as its source calls it, for messages.
    """

    channel: str
    start: int
    length: int
    big_endian: bool = False
    signed: bool = False
    is_float: bool = False
    scale: float = 1.0
    offset: float = 0.0
    name: str = ""

    def span(self) -> tuple[int, int, int]:
        """First byte, byte after the last, and how far to shift the big- or little-endian number they make. [bits]

        Raises:
            ParameterError: more than 64 bits, spread over nine bytes, or a float that is not 32 or 64 bits.
        """
        if self.is_float and self.length not in (16, 32, 64):
            raise ParameterError(f"length of float signal {self.name}", self.length, "16, 32 or 64", "bit")
        if self.big_endian:
            first_bit = 8 * (self.start // 8) + 7 - self.start % 8  # counted from the top of the first byte
            first, last = first_bit // 8, (first_bit + self.length - 1) // 8
            shift = 8 * (last + 1) - first_bit - self.length
        else:
            first, last = self.start // 8, (self.start + self.length - 1) // 8
            shift = self.start - 8 * first
        if not 1 <= self.length <= 64 or last - first >= 8:
            raise ParameterError(f"length of signal {self.name}", self.length, "1 ... 64 within eight bytes", "bit")
        return first, last + 1, shift


@dataclass(frozen=True, slots=True)
class Page:
    """What a multiplexer says where a frame carries the signals of one kind: `switch` has one of `values` [counts]."""

    switch: Signal
    values: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Frame:
    """One kind of frame.

    Attributes:
        key: see `frame_key`.
        length: exact length; others are refused and counted. [bytes]
        signals: those that are read.
        name: for messages.
        objects: that a PDO maps, as the bridge file writes them.
        pages: of a multiplexed frame; it is of this kind where all of them hold.
    """

    key: int
    length: int
    signals: tuple[Signal, ...]
    name: str
    objects: tuple[str, ...] = ()
    pages: tuple[Page, ...] = ()

    def __post_init__(self) -> None:
        """Check that every signal lies within the frame."""
        for signal in (*self.signals, *(page.switch for page in self.pages)):
            if signal.span()[1] > self.length:
                end = signal.span()[1]
                raise ParameterError(f"end of {signal.name} in {self.name}", end, f"<= {self.length}", "bytes")

    def carries(self, payload: Bytes) -> NDArray[np.bool_]:
        """Which of the frames `payload` (n, length) are of this kind, by their multiplexers. (n,)"""
        found = np.ones(len(payload), dtype=bool)
        for page in self.pages:
            found &= np.isin(raw_values(page.switch, payload), page.values)
        return found

    @property
    def is_sampled(self) -> bool:
        """True when a sample is not complete without this frame."""
        return any(signal.channel in SAMPLED for signal in self.signals)


@dataclass(frozen=True, slots=True)
class AxisLayout:
    """The frames of one axis.

    Attributes:
        axis: its name.
        frames: those with channels.
        node: CANopen node id; None on other buses.
    """

    axis: str
    frames: tuple[Frame, ...]
    node: int | None = None

    def __post_init__(self) -> None:
        """Check that there is what a sample needs, each once."""
        channels = [signal.channel for frame in self.frames for signal in frame.signals]
        twice = next((name for name in channels if channels.count(name) > 1), None)
        if twice is not None:
            raise ParameterError(f"signals for {twice} of {self.axis}", channels.count(twice), "1")
        if "position" not in channels:
            raise ParameterError(f"channels of {self.axis}", ", ".join(channels) or "none", "with position")
        if ("torque" in channels) == ("force" in channels):
            raise ParameterError(f"channels of {self.axis}", ", ".join(channels), "with one of torque and force")

    def channels(self) -> tuple[str, ...]:
        """Names of all channels."""
        return tuple(signal.channel for frame in self.frames for signal in frame.signals)


def raw_values(signal: Signal, payload: Bytes) -> NDArray[np.int64] | Floats:
    """The counts of `signal` in frames `payload` (n, length): whole numbers, or floats where the signal is one."""
    first, end, shift = signal.span()
    wide = np.zeros((len(payload), 8), dtype=np.uint8)
    if signal.big_endian:
        wide[:, 8 - (end - first) :] = payload[:, first:end]
        bits = wide.view(">u8").ravel().astype(np.uint64)
    else:
        wide[:, : end - first] = payload[:, first:end]
        bits = wide.view("<u8").ravel().astype(np.uint64)
    bits >>= np.uint64(shift)
    if signal.length < 64:
        bits &= np.uint64((1 << signal.length) - 1)
    if signal.is_float:
        kinds = {16: (np.uint16, np.float16), 32: (np.uint32, np.float32), 64: (np.uint64, np.float64)}
        whole, real = kinds[signal.length]
        with np.errstate(invalid="ignore"):  # signalling NaNs of a stranger
            return bits.astype(whole).view(real).astype(np.float64)
    if signal.signed and signal.length < 64:
        unused = np.uint64(64 - signal.length)
        return (bits << unused).view(np.int64) >> np.int64(unused)
    if signal.signed:
        return bits.view(np.int64)
    return bits.astype(np.float64) if signal.length == 64 else bits.astype(np.int64)


def decode_signal(signal: Signal, payload: Bytes) -> Floats:
    """Values of `signal` in SI in frames `payload` (n, length)."""
    values: Floats = raw_values(signal, payload).astype(np.float64)
    with np.errstate(over="ignore", invalid="ignore"):  # floats at the end of their range; who reads them checks
        if signal.scale != 1.0:
            values *= signal.scale
        if signal.offset:
            values += signal.offset
    return values


def encode_frame(frame: Frame, values: Mapping[str, Floats], count: int) -> Bytes:
    """Payloads (count, length) that carry `values` [SI] by channel; counts are rounded and clipped to the signal.

    For the simulated drive: little-endian whole numbers, as CANopen sends them.

    Raises:
        ParameterError: a signal of another kind.
    """
    payload = np.zeros(count, dtype=np.uint64)
    for signal in frame.signals:
        if signal.big_endian or signal.is_float or frame.length > 8:
            raise ParameterError(f"signal {signal.name}", "big-endian or float", "a little-endian integer")
        counts = np.rint((np.asarray(values[signal.channel], dtype=np.float64) - signal.offset) / signal.scale)
        low, high = (
            (-(2.0 ** (signal.length - 1)), 2.0 ** (signal.length - 1) - 1)
            if signal.signed
            else (0.0, 2.0**signal.length - 1)
        )
        bits = np.clip(counts, low, high).astype(np.int64).view(np.uint64) & np.uint64((1 << signal.length) - 1)
        payload |= bits << np.uint64(signal.start)
    return payload.astype("<u8").view(np.uint8).reshape(count, 8)[:, : frame.length]
