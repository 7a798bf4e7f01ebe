"""What a bridge file says, as frozen values with their defaults; `deploy/bridge.toml` is written from them."""
# ruff: noqa: RUF009  # `said` makes a dataclass field, it is no default

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

from plant import keys
from plant.can_assembly import Clock, TimeRule
from plant.can_axis import GapRule
from plant.can_clock import Origin
from plant.can_layout import AxisLayout, frame_key
from plant.errors import ParameterError


def said(default: Any, meaning: str) -> Any:
    """A field with its default and its meaning."""
    return field(default=default, metadata={"meaning": meaning})


@dataclass(frozen=True, slots=True)
class ZenohSettings:
    """Where the samples go."""

    prefix: str = said(keys.PREFIX, "first part of every key")
    connect: tuple[str, ...] = said(("tcp/127.0.0.1:7447",), "endpoints of the daemon")


@dataclass(frozen=True, slots=True)
class CanSettings:
    """Which bus, by the names of python-can."""

    interface: str = said("socketcan", "socketcan, udp_multicast, virtual, or another interface of python-can")
    channel: str = said("can0", "device, multicast address or name of the bus")
    bitrate: int = said(0, "0 = as the link is set; socketcan always takes the link's [bit/s]")
    silence: float = said(5.0, "without any frame for so long the bus is opened anew [s]")
    longest_retry: float = said(5.0, "longest wait between two attempts to open the bus [s]")

    def __post_init__(self) -> None:
        """Check ranges."""
        for name in ("silence", "longest_retry"):
            if not getattr(self, name) > 0:
                raise ParameterError(name, getattr(self, name), "> 0", "s")
        if self.bitrate < 0:
            raise ParameterError("bitrate", self.bitrate, ">= 0", "bit/s")


@dataclass(frozen=True, slots=True)
class TimeSettings:
    """What time a sample has."""

    clock: Clock = said(Clock.SYNC, "sync: SYNC count times period; arrival: stamp of the frame with the position")
    sync_id: int = said(0x80, "id of SYNC")
    period: float = said(0.01, "of SYNC (1006h) [s]")
    overflow: int = said(240, "highest value of the SYNC counter (1019h)")
    origin: Origin = said(Origin.HOST, "host: this computer's clock anchors the count; time_object: the master's TIME")
    max_offset: float = said(0.1, "count against clock, beyond which the count is anchored anew [s]")

    def __post_init__(self) -> None:
        """Check ranges."""
        for name in ("period", "max_offset"):
            if not getattr(self, name) > 0:
                raise ParameterError(name, getattr(self, name), "> 0", "s")
        if not 2 <= self.overflow <= 240:
            raise ParameterError("overflow", self.overflow, "2 ... 240")
        if not 0 < self.sync_id < 1 << 29:
            raise ParameterError("sync_id", self.sync_id, "1 ... 0x1FFFFFFF")

    def rule(self) -> TimeRule:
        """For the assembler."""
        key = frame_key(self.sync_id, self.sync_id > 0x7FF)
        return TimeRule(self.clock, key, self.period, self.overflow, self.origin, self.max_offset)


@dataclass(frozen=True, slots=True)
class BlockSettings:
    """How samples are sent, and what becomes of missing ones."""

    samples: int = said(100, "longest block [samples]")
    seconds: float = said(1.0, "longest wait for a block to fill [s]")
    fill: int = said(2, "so many missing in a row are sent as NaN; more are a gap [samples]")
    absent: float = said(10.0, "missing for longer means that the drive was off: no gap [s]")
    status: float = said(1.0, "from one status to the next [s]")

    def __post_init__(self) -> None:
        """Check ranges."""
        for name in ("seconds", "absent", "status"):
            if not getattr(self, name) > 0:
                raise ParameterError(name, getattr(self, name), "> 0", "s")
        if not 1 <= self.samples <= 10_000:
            raise ParameterError("samples", self.samples, "1 ... 10000", "samples")
        if self.fill < 0:
            raise ParameterError("fill", self.fill, ">= 0", "samples")

    def rule(self) -> GapRule:
        """For the assembler."""
        return GapRule(self.fill, self.absent)


@dataclass(frozen=True, slots=True)
class BridgeSettings:
    """A whole bridge file.

    Attributes:
        name: of the bridge, in its keys.
        site: second part of every key.
        zenoh: where the samples go.
        can: which bus.
        options: further words for the interface, as python-can names them.
        time: what time a sample has.
        block: how samples are sent.
        layouts: one per axis.
        remarks: what looks odd and is no error.
    """

    name: str
    site: str
    zenoh: ZenohSettings = ZenohSettings()
    can: CanSettings = CanSettings()
    options: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))
    time: TimeSettings = TimeSettings()
    block: BlockSettings = BlockSettings()
    layouts: tuple[AxisLayout, ...] = ()
    remarks: tuple[str, ...] = ()

    def layout(self, axis: str) -> AxisLayout | None:
        """The layout of one axis, None where it is not listed."""
        return next((layout for layout in self.layouts if layout.axis == axis), None)


SECTIONS: Mapping[str, type[Any]] = {
    "zenoh": ZenohSettings,
    "can": CanSettings,
    "time": TimeSettings,
    "block": BlockSettings,
}


@dataclass(frozen=True, slots=True)
class AxisTable:
    """One [[axis]]: a CiA 402 drive by its node, or signals of a DBC file."""

    name: str = said("", "name of the axis, where there is no file")
    file: str = said("", "axis file: name and rated torque are taken from it")
    node: int = said(0, "CANopen node id; with dbc it gives heartbeat and emergencies")
    counts_per_unit: float = said(0.0, "counts of 6064h per m (or rad) of the motor side's motion")
    gear: float = said(1.0, "motor side's motion per motion of the axis")
    sign: int = said(1, "-1 where the drive counts downwards")
    torque_sign: int = said(0, "the same for the torque; 0 = as sign")
    rated_torque: float = said(0.0, "6076h, that 6077h counts in per mille; 0 = from the axis file [N*m]")
    velocity_per_unit: float = said(0.0, "counts of 606Ch per m/s (or rad/s); 0 = counts_per_unit")
    temperature_scale: float = said(0.1, "degC per count of a temperature object")
    dbc: str = said("", "DBC file; signals then says what to read")
    strict: bool = said(True, "false: accept a DBC file with overlapping signals")


def meanings(kind: type[Any]) -> list[tuple[str, Any, str]]:
    """Name, default and meaning of each field of a settings class."""
    return [(one.name, one.default, one.metadata.get("meaning", "")) for one in dataclasses.fields(kind)]
