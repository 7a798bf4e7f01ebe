"""The rules of the payload of the stream, version 1, the same for writing and reading; what breaks one is refused."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NoReturn

import numpy as np

from plant.checks import nearest
from plant.errors import ParameterError, PayloadError
from plant.keys import check_id

VERSION = 1
CHANNELS = ("torque", "force", "position", "velocity", "temperature", "load")
INT64 = 2**63
_KEYS = ("v", "axis", "epoch", "seq", "t0_ns", "dt_ns", "t_ns", *CHANNELS)


def refuse(reason: str, message: str) -> NoReturn:
    """Refuse a payload for one of `wire.REASONS`, in words."""
    raise PayloadError(reason, message)


def check(content: Mapping[str, Any]) -> int:
    """Refuse what breaks a rule of version 1; return the number of samples."""
    _check_names(content)
    n = len(content["position"])
    if n == 0:
        refuse("empty", "the block holds no samples")
    for name in ("t_ns", *CHANNELS):
        if name in content and content[name].shape != (n,):
            refuse("bad_length", f"{name} has {content[name].size} values, position has {n}")
    for name in CHANNELS:
        if name in content and np.isinf(content[name]).any():
            refuse("infinite", f"{name} holds an infinite value; an unusable sample is NaN (null in JSON)")
    if content["seq"] + n > INT64:
        refuse("bad_seq", "seq exceeds 63 bits")
    _check_stamps(content, n)
    return n


def _check_names(content: Mapping[str, Any]) -> None:
    if "v" not in content:
        refuse("missing_key", "v is missing; this is version 1")
    if type(content["v"]) is not int or content["v"] != VERSION:
        refuse("bad_version", f"v is not {VERSION}, the version we read")
    for name in content:
        if name not in _KEYS:
            refuse("unknown_key", f"unknown key {name[:40]!r}; {nearest(name[:40], _KEYS)}")
    for name in ("axis", "epoch", "seq", "position"):
        if name not in content:
            refuse("missing_key", f"{name} is missing")
    if ("torque" in content) == ("force" in content):
        refuse("missing_key", "exactly one of torque [N*m] and force [N] must be there")
    if not isinstance(content["axis"], str):
        refuse("bad_id", "axis must be text")
    try:
        check_id("axis", content["axis"])
    except ParameterError as error:
        refuse("bad_id", str(error)[:200])
    for name in ("epoch", "seq"):
        _check_whole(name, content[name], least=0, reason="bad_seq")


def _check_whole(name: str, value: object, *, least: int, reason: str) -> None:
    if type(value) is not int:
        refuse("bad_type", f"{name} is {type(value).__name__}, must be a whole number")
    if not least <= value < INT64:
        refuse(reason, f"{name} must be >= {least} and < 2^63")


def _check_stamps(content: Mapping[str, Any], n: int) -> None:
    if ("dt_ns" in content) == ("t_ns" in content):
        refuse("bad_time", "exactly one of dt_ns and t_ns must be there")
    if "dt_ns" in content:
        if "t0_ns" not in content:
            refuse("bad_time", "t0_ns is missing")
        _check_whole("t0_ns", content["t0_ns"], least=0, reason="bad_time")
        _check_whole("dt_ns", content["dt_ns"], least=1, reason="bad_time")
        if content["t0_ns"] + content["dt_ns"] * (n - 1) >= INT64:
            refuse("bad_time", "the last stamp exceeds 63 bits")
        return
    stamps = content["t_ns"]
    if stamps[0] < 0:
        refuse("bad_time", "t_ns must be >= 0, Unix time in UTC")
    if np.any(stamps[1:] <= stamps[:-1]):
        refuse("bad_time", "t_ns must be strictly increasing")
    if "t0_ns" in content:
        _check_whole("t0_ns", content["t0_ns"], least=0, reason="bad_time")
        if content["t0_ns"] != stamps[0]:
            refuse("bad_time", "t0_ns must equal t_ns[0]: t_ns are full Unix stamps, not offsets")
