"""CiA 402 drives on CANopen: objects, PDO mapping, states, emergency codes. Numbers in, layouts and words out. Pure.

A TPDO is a list of objects, each `index:bits`, packed without gaps from bit 0. Torque is in per mille of rated torque
(6076h), position in counts; what a count is worth only the commissioning engineer knows.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from plant.can_layout import AxisLayout, Frame, Signal
from plant.errors import InputError, ParameterError

TPDO = (0x180, 0x280, 0x380, 0x480)  # + node id
EMCY, HEARTBEAT, SYNC, TIME = 0x080, 0x700, 0x080, 0x100
BOOT_UP, OPERATIONAL = 0, 5
NMT_STATES = {0: "boot-up", 4: "stopped", 5: "operational", 127: "pre-operational"}


@dataclass(frozen=True, slots=True)
class Entry:
    """An object of the dictionary: its channel ("" = not read), width [bits] and whether it is signed."""

    channel: str
    bits: int
    signed: bool
    name: str


OBJECTS = {
    0x603F: Entry("error_code", 16, False, "error code"),
    0x6041: Entry("statusword", 16, False, "statusword"),
    0x6061: Entry("", 8, True, "mode of operation display"),
    0x6064: Entry("position", 32, True, "position actual value"),
    0x606C: Entry("velocity", 32, True, "velocity actual value"),
    0x6077: Entry("torque", 16, True, "torque actual value"),
    0x6078: Entry("", 16, True, "current actual value"),
    0x6079: Entry("", 32, False, "DC link voltage"),
    0x60F4: Entry("", 32, True, "following error"),
    0x60FD: Entry("", 32, False, "digital inputs"),
}
DEFAULT_TPDO1 = ("6041:16", "6064:32", "6077:16")


@dataclass(frozen=True, slots=True)
class Scaling:
    """What the counts of one drive are worth.

    Attributes:
        counts_per_unit: of 6064h, per m (or rad) of the motor side's motion. > 0
        gear: motor side's motion per motion of the axis. > 0
        sign: 1, or -1 where the drive counts downwards.
        torque_sign: the same for torque; 0 = as `sign`.
        rated_torque: 6076h. [N·m] > 0
        velocity_per_unit: counts of 606Ch per m/s (or rad/s) of the motor side; 0 = `counts_per_unit`.
        temperature_scale: of a manufacturer's object. [degC per count]
    """

    counts_per_unit: float
    rated_torque: float
    gear: float = 1.0
    sign: int = 1
    torque_sign: int = 0
    velocity_per_unit: float = 0.0
    temperature_scale: float = 0.1

    def __post_init__(self) -> None:
        """Check ranges."""
        for name, unit in (("counts_per_unit", "counts per m or rad"), ("rated_torque", "N*m"), ("gear", "1")):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise ParameterError(name, getattr(self, name), "> 0", unit)
        if self.velocity_per_unit < 0:
            raise ParameterError("velocity_per_unit", self.velocity_per_unit, ">= 0", "counts per m/s or rad/s")
        for name, allowed in (("sign", (1, -1)), ("torque_sign", (1, -1, 0))):
            if getattr(self, name) not in allowed:
                raise ParameterError(name, getattr(self, name), " or ".join(map(str, allowed)))

    def factor(self, channel: str) -> float:
        """SI per count of `channel`."""
        if channel == "position":
            return self.sign / (self.counts_per_unit * self.gear)
        if channel == "velocity":
            return self.sign / ((self.velocity_per_unit or self.counts_per_unit) * self.gear)
        if channel == "torque":
            return (self.torque_sign or self.sign) * self.rated_torque / 1000.0
        return self.temperature_scale if channel == "temperature" else 1.0


def parse_object(text: str) -> tuple[Entry, str]:
    """Read `6064:32`, `skip:8`, or a manufacturer's `2033:16:temperature` (signed; `2033:u16:temperature` unsigned).

    Returns:
        The entry and its index as text.

    Raises:
        InputError: not of that form, an unknown object without a channel, or another width than CiA 402 gives it.
    """
    match = re.fullmatch(r"(?:0x)?([0-9A-Fa-f]{4}|skip):(u?)(\d{1,2})(?::(\w+))?", text.strip())
    if match is None:
        raise InputError(f"{text!r} is not a mapped object; write 6064:32, skip:8, or 2033:16:temperature")
    index, unsigned, bits, channel = match[1], bool(match[2]), int(match[3]), match[4]
    if not 1 <= bits <= 64:
        raise InputError(f"{text!r}: a mapped object has 1 to 64 bits")
    if index == "skip":
        return Entry("", bits, False, "skipped"), "skip"
    known = OBJECTS.get(int(index, 16))
    if known is None:
        if channel is not None and channel not in ("temperature", "load", "position", "velocity", "torque", "force"):
            raise InputError(f"{text!r}: channel {channel!r} is not position, velocity, torque, temperature or load")
        return Entry(channel or "", bits, not unsigned, f"object {index}h"), index
    if bits != known.bits:
        raise InputError(
            f"{text!r}: {index}h ({known.name}) has {known.bits} bits in CiA 402; a drive that maps {bits} "
            f"sends something else: name its own object, like 2064:{bits}:{known.channel or 'load'}"
        )
    return known, index


def pdo_frame(key: int, objects: Sequence[str], scaling: Scaling, name: str) -> Frame:
    """The frame of a TPDO that maps `objects`, from bit 0 on.

    Raises:
        InputError: an object that cannot be, or more than 64 bits.
    """
    start, signals = 0, []
    for text in objects:
        entry, index = parse_object(text)
        if entry.channel:
            factor = scaling.factor(entry.channel)
            label = f"{index}h {entry.name}"
            signals.append(Signal(entry.channel, start, entry.bits, signed=entry.signed, scale=factor, name=label))
        start += entry.bits
    if start > 64 or start % 8:
        raise InputError(f"{name} maps {start} bits ({', '.join(objects)}); a PDO holds whole bytes, at most 64 bits")
    return Frame(key, start // 8, tuple(signals), name, tuple(objects))


def layout(axis: str, node: int, pdos: Sequence[tuple[int, Sequence[str]]], scaling: Scaling) -> AxisLayout:
    """The layout of one drive.

    Args:
        axis: name of the axis.
        node: id on the bus. 1 ... 127
        pdos: (id, objects) of each TPDO; id 0 takes the predefined one, 180h + node, then 280h + node ...
        scaling: what counts are worth.

    Raises:
        InputError: an object or a PDO that cannot be.
        ParameterError: node out of range, or no position or torque among the objects.
    """
    if not 1 <= node <= 127:
        raise ParameterError(f"node of {axis}", node, "1 ... 127")
    frames = tuple(
        pdo_frame(given or TPDO[min(number, 3)] + node, objects, scaling, f"TPDO{number + 1} of node {node}")
        for number, (given, objects) in enumerate(pdos)
    )
    return AxisLayout(axis, frames, node)


def other_mappings(objects: Sequence[str], length: int) -> list[str]:
    """Mappings of the same objects that would give `length` bytes, were some of them 16 instead of 32 bits or back."""
    entries = [parse_object(text) for text in objects]
    swapped = {32: (32, 16), 16: (16, 32)}
    choices = [swapped.get(entry.bits, (entry.bits,)) if entry.signed else (entry.bits,) for entry, _ in entries]
    return [
        " + ".join(f"{index}:{bits}" for (_, index), bits in zip(entries, widths, strict=True))
        for widths in itertools.product(*choices)
        if sum(widths) == 8 * length
    ]


# --- states and emergencies -------------------------------------------------------------------------------------

_STATES = (  # mask, value, name: CiA 402 statusword
    (0x4F, 0x00, "not ready to switch on"),
    (0x4F, 0x40, "switch on disabled"),
    (0x6F, 0x21, "ready to switch on"),
    (0x6F, 0x23, "switched on"),
    (0x6F, 0x27, "operation enabled"),
    (0x6F, 0x07, "quick stop active"),
    (0x4F, 0x0F, "fault reaction active"),
    (0x4F, 0x08, "fault"),
)


def drive_state(statusword: int) -> str | None:
    """The drive's state; None for a pattern that CiA 402 does not know."""
    return next((name for mask, value, name in _STATES if statusword & mask == value), None)


def known_states(statuswords: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which of the statuswords are patterns that CiA 402 knows."""
    known = np.zeros(len(statuswords), dtype=bool)
    for mask, value, _ in _STATES:
        known |= (statuswords & mask) == value
    return known


_EMERGENCIES = {
    0x00: "no error, or error reset", 0x10: "generic error", 0x20: "current", 0x21: "current, input side",
    0x22: "current inside the device", 0x23: "current, output side", 0x30: "voltage", 0x31: "mains voltage",
    0x32: "voltage inside the device", 0x33: "output voltage", 0x40: "temperature", 0x41: "ambient temperature",
    0x42: "device temperature", 0x50: "device hardware", 0x60: "device software", 0x70: "additional modules",
    0x71: "power module, motor or brake", 0x73: "sensor", 0x81: "communication", 0x82: "protocol",
    0x84: "speed controller", 0x85: "torque controller", 0x86: "position controller, following error",
    0x90: "external error", 0xFF: "manufacturer's own",
}  # fmt: skip


def emergency(code: int) -> str:
    """What an emergency error code is about."""
    return _EMERGENCIES.get(code >> 8, _EMERGENCIES.get((code >> 8) & 0xF0, "unknown"))


def time_of_day_ns(payload: bytes) -> int:
    """Unix time of a CANopen TIME object: 28 bits of ms since midnight, 16 bits of days since 1984-01-01. [ns]"""
    milliseconds = int.from_bytes(payload[:4], "little") & 0x0FFF_FFFF
    return (5113 * 86_400_000 + int.from_bytes(payload[4:6], "little") * 86_400_000 + milliseconds) * 1_000_000


def time_of_day(unix_ns: int) -> bytes:
    """The TIME object of a Unix time, to the millisecond."""
    days, milliseconds = divmod(unix_ns // 1_000_000, 86_400_000)
    return milliseconds.to_bytes(4, "little") + (days - 5113).to_bytes(2, "little")
