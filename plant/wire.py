"""The stream's payload, version 1: a block of samples as CBOR with RFC 8746 typed arrays, or as JSON for people.

Everything is checked before it is believed; whatever is wrong is a `PayloadError` with one of `REASONS`, for counting.
docs/stream.md is the same in words, enough to write a publisher from.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from plant.cbor_map import TypedArray, read_map
from plant.wire_rules import CHANNELS, INT64, VERSION, check, refuse

MAX_BYTES = 1_000_000
CBOR = "application/cbor"
JSON = "application/json"
REASONS = (
    "too_large", "unknown_encoding", "bad_cbor", "bad_json", "bad_tag", "duplicate_key", "unknown_key", "missing_key",
    "bad_version", "bad_id", "bad_type", "bad_length", "empty", "bad_time", "bad_seq", "infinite",
)  # fmt: skip

_FLOATS = {81: ">f4", 82: ">f8", 85: "<f4", 86: "<f8"}
_STAMPS = {67: ">u8", 71: "<u8", 75: ">i8", 79: "<i8"}
_DTYPES = _FLOATS | _STAMPS
_TAGS = frozenset(_DTYPES)

Samples = NDArray[np.float64]
Stamps = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """Consecutive samples of one axis, raw as the machine sent them.

    Attributes:
        axis: name of the axis.
        epoch: grows when the publisher starts anew.
        seq: index of the block's first sample in its epoch.
        t_ns: stamps, Unix time in UTC, strictly increasing. [ns] (n,)
        position: [m or rad] (n,); NaN marks an unusable sample here and below.
        torque: motor torque. [N·m] (n,); exactly one of torque and force.
        force: force at the belt. [N] (n,)
        velocity: [m/s or rad/s] (n,) or None
        temperature: [degC] (n,) or None
        load: [kg or 1] (n,) or None
        dt_ns: the constant step where the sender gave one. [ns]
    """

    axis: str
    epoch: int
    seq: int
    t_ns: Stamps
    position: NDArray[np.floating]
    torque: NDArray[np.floating] | None = None
    force: NDArray[np.floating] | None = None
    velocity: NDArray[np.floating] | None = None
    temperature: NDArray[np.floating] | None = None
    load: NDArray[np.floating] | None = None
    dt_ns: int | None = None

    def __len__(self) -> int:
        """Count the samples."""
        return len(self.t_ns)

    def channels(self) -> tuple[str, ...]:
        """Names of the channels that are present."""
        return tuple(name for name in CHANNELS if getattr(self, name) is not None)


# --- writing --------------------------------------------------------------------------------------------------


def encode_block(block: Block, encoding: str = CBOR) -> bytes:
    """Write `block` as a payload; float32 channels stay float32 in CBOR, NaN becomes null in JSON.

    Raises:
        PayloadError: the block breaks a rule of the payload (the same as in `decode_block`), or exceeds 1 MB.
    """
    kind = _kind(encoding)
    head: dict[str, Any] = {"v": VERSION, "axis": block.axis, "epoch": int(block.epoch), "seq": int(block.seq)}
    if len(block.t_ns):
        head["t0_ns"] = int(block.t_ns[0])
    if block.t_ns.dtype.kind not in "iu":
        refuse("bad_type", f"t_ns holds {block.t_ns.dtype}, must hold whole nanoseconds")
    steps: dict[str, Any] = {"t_ns": block.t_ns} if block.dt_ns is None else {"dt_ns": int(block.dt_ns)}
    channels = {name: np.asarray(getattr(block, name)) for name in block.channels()}
    check({**head, **steps, **channels})
    if block.dt_ns is not None and np.any(np.diff(block.t_ns) != block.dt_ns):
        refuse("bad_time", "t_ns does not advance by dt_ns; set dt_ns to None")
    payload = (_to_cbor if kind == CBOR else _to_json)(head | steps | channels)
    if len(payload) > MAX_BYTES:
        refuse("too_large", f"the block takes {len(payload)} bytes, at most {MAX_BYTES}; send fewer samples")
    return payload


def _to_cbor(content: Mapping[str, Any]) -> bytes:
    import cbor2

    def typed(values: Any) -> Any:
        if not isinstance(values, np.ndarray):
            return values
        if values.dtype.kind in "iu":
            return cbor2.CBORTag(79, values.astype("<i8").tobytes())
        tag = 85 if values.dtype == np.float32 else 86
        return cbor2.CBORTag(tag, values.astype(_FLOATS[tag]).tobytes())

    return bytes(cbor2.dumps({name: typed(values) for name, values in content.items()}))


def _to_json(content: Mapping[str, Any]) -> bytes:
    def plain(values: Any) -> Any:
        if not isinstance(values, np.ndarray):
            return values
        return [None if value != value else value for value in values.tolist()]

    return json.dumps({name: plain(values) for name, values in content.items()}, separators=(",", ":")).encode()


# --- reading --------------------------------------------------------------------------------------------------


def decode_block(payload: bytes, encoding: str) -> Block:
    """Read a payload.

    Args:
        payload: the bytes as received.
        encoding: `application/cbor` or `application/json`; a schema after `;` is ignored.

    Returns:
        The block; samples as float64, stamps as int64.

    Raises:
        PayloadError: with one of `REASONS`; never anything else, whatever the bytes.
    """
    kind = _kind(encoding)
    if len(payload) > MAX_BYTES:
        refuse("too_large", f"the payload has {len(payload)} bytes, at most {MAX_BYTES}")
    raw = read_map(payload, _TAGS) if kind == CBOR else _from_json(payload)
    content: dict[str, Any] = {name: _array(name, value) for name, value in raw.items()}
    n = check(content)
    return Block(
        axis=content["axis"],
        epoch=content["epoch"],
        seq=content["seq"],
        t_ns=_stamps(content, n),
        dt_ns=content.get("dt_ns"),
        **{name: content[name] for name in ("torque", "force", *CHANNELS[2:]) if name in content},
    )


def _kind(encoding: str) -> str:
    kind = encoding.split(";")[0].strip().lower()
    if kind not in (CBOR, JSON):
        refuse("unknown_encoding", f"encoding {kind[:60]!r} is not {CBOR} or {JSON}")
    return kind


def _from_json(payload: bytes) -> dict[str, Any]:
    def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        content = dict(pairs)
        if len(content) != len(pairs):
            refuse("duplicate_key", "a key stands twice in a JSON object")
        return content

    def no_constant(name: str) -> NoReturn:
        refuse("bad_json", f"{name} is not JSON; an unusable sample is null")

    try:
        content = json.loads(payload, object_pairs_hook=once, parse_constant=no_constant)
    except (ValueError, RecursionError) as error:  # UnicodeDecodeError and JSONDecodeError are ValueErrors
        refuse("bad_json", f"not JSON: {str(error)[:120]}")
    if not isinstance(content, dict):
        refuse("bad_json", "the payload is not a JSON object")
    return content


def _array(name: str, value: Any) -> Any:
    """Turn a typed array or JSON list into numbers; everything else stays as it is, for `check`."""
    if name not in CHANNELS and name != "t_ns":
        return value
    allowed = _STAMPS if name == "t_ns" else _FLOATS
    if isinstance(value, TypedArray):
        if value.tag not in allowed:
            refuse("bad_tag", f"{name} has tag {value.tag}, must have one of {sorted(allowed)}")
        dtype = np.dtype(_DTYPES[value.tag])
        if len(value.data) % dtype.itemsize:
            refuse("bad_length", f"{name} has {len(value.data)} bytes, not a multiple of {dtype.itemsize}")
        return _native(np.frombuffer(value.data, dtype), name)
    if isinstance(value, list):
        return _from_list(name, value)
    refuse("bad_type", f"{name} is {type(value).__name__}, must be an array of numbers")


def _native(values: NDArray[Any], name: str) -> NDArray[Any]:
    if name != "t_ns":
        with np.errstate(invalid="ignore"):  # signalling NaNs of a stranger
            return values.astype(np.float64)
    if values.dtype.kind == "u" and len(values) and int(values.max()) >= INT64:
        refuse("bad_time", "t_ns exceeds 63 bits")
    return values.astype(np.int64)


def _from_list(name: str, values: list[Any]) -> NDArray[Any]:
    if name == "t_ns":
        if not all(type(value) is int and 0 <= value < INT64 for value in values):
            refuse("bad_time", "t_ns must hold whole numbers of nanoseconds, 0 <= t_ns < 2^63")
        return np.array(values, dtype=np.int64)
    if not all(value is None or type(value) in (int, float) for value in values):
        refuse("bad_type", f"{name} must hold numbers, and null for an unusable sample")
    try:
        return np.array([np.nan if value is None else float(value) for value in values], dtype=np.float64)
    except OverflowError:
        refuse("infinite", f"{name} holds a number beyond float64")


def _stamps(content: Mapping[str, Any], n: int) -> Stamps:
    if "t_ns" in content:
        stamps: Stamps = content["t_ns"]
        return stamps
    return np.arange(n, dtype=np.int64) * int(content["dt_ns"]) + int(content["t0_ns"])
