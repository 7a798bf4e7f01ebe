"""DBC files, by cantools: which bits of which frame carry our channels, found once; numpy decodes."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cantools.database import load_file
from cantools.database.errors import Error

from plant.can_layout import AxisLayout, Frame, Page, Signal, frame_key, show_id
from plant.errors import InputError, ParameterError


def read_dbc(path: Path, *, strict: bool = True) -> Any:
    """Read a DBC file (or any database that cantools knows).

    Args:
        path: the file.
        strict: refuse overlapping signals and signals beyond their frame.

    Raises:
        InputError: it cannot be read; says why, and whether `strict = false` would help.
    """
    try:
        return load_file(path, strict=strict)
    except OSError as error:
        raise InputError(f"{path}: cannot read the DBC file: {error.strerror}") from None
    except (Error, UnicodeDecodeError, ValueError) as error:
        hint = "; strict = false accepts overlapping signals" if "overlap" in str(error).lower() else ""
        raise InputError(f"{path}: not a DBC file that can be used: {str(error).splitlines()[0]}{hint}") from None


def dbc_layout(
    path: Path,
    axis: str,
    signals: Mapping[str, str],
    scale: Mapping[str, float],
    *,
    node: int | None = None,
    strict: bool = True,
) -> AxisLayout:
    """The layout of one axis.

    Args:
        path: the DBC file.
        axis: name of the axis.
        signals: our channel -> `Message.Signal`, or `Signal` where the name is in one message only.
        scale: our channel -> factor, DBC unit to SI; the DBC's own factor and offset are applied before.
        node: CANopen node, for heartbeat and emergencies; None on other buses.
        strict: see `read_dbc`.

    Raises:
        InputError: no such signal (with the nearest), or one that cannot be decoded.
    """
    database = read_dbc(path, strict=strict)
    kinds: dict[tuple[str, tuple[Page, ...]], list[Signal]] = {}
    for channel, name in signals.items():
        message, signal = _find(database, path, name)
        one = _signal(channel, message, signal, scale.get(channel, 1.0))
        kinds.setdefault((message.name, _pages(message, signal)), []).append(one)
    try:
        frames = tuple(
            _frame(database.get_message_by_name(name), found, pages) for (name, pages), found in kinds.items()
        )
        return AxisLayout(axis, frames, node)
    except ParameterError as error:
        raise InputError(f"{path}: {error}") from None


def _frame(message: Any, signals: list[Signal], pages: tuple[Page, ...]) -> Frame:
    key = frame_key(message.frame_id, message.is_extended_frame)
    where = "".join(f", {page.switch.name.rpartition('.')[2]} = {_shown(page.values)}" for page in pages)
    return Frame(key, message.length, tuple(signals), message.name + where, pages=pages)


def _shown(values: tuple[int, ...]) -> str:
    return f"{values[0]}" if len(values) == 1 else f"{values[0]} ... {values[-1]}"


def _pages(message: Any, signal: Any) -> tuple[Page, ...]:
    """What the multiplexers say where `signal` is in the frame: its own, and those that this one hangs on."""
    pages = []
    while signal.multiplexer_ids:
        ids, signal = signal.multiplexer_ids, message.get_signal_by_name(signal.multiplexer_signal)
        pages.append(Page(_signal("", message, signal, 1.0), tuple(sorted(ids))))
    return tuple(pages)


def _signal(channel: str, message: Any, signal: Any, factor: float) -> Signal:
    return Signal(
        channel,
        signal.start,
        signal.length,
        big_endian=signal.byte_order == "big_endian",
        signed=signal.is_signed,
        is_float=signal.is_float,
        scale=float(signal.scale) * factor,
        offset=float(signal.offset) * factor,
        name=f"{message.name}.{signal.name}",
    )


def _find(database: Any, path: Path, name: str) -> tuple[Any, Any]:
    """The message and signal that `name` names."""
    wanted_message, _, wanted = name.rpartition(".")
    found = [
        (message, signal)
        for message in database.messages
        for signal in message.signals
        if signal.name == wanted and wanted_message in ("", message.name)
    ]
    if len(found) == 1:
        return found[0]
    if found:
        where = ", ".join(f"{message.name}.{wanted} ({_id(message)})" for message, _ in found[:6])
        raise InputError(f"{path}: signal {name!r} is in several messages: {where}; name one of them")
    there = [f"{message.name}.{signal.name}" for message in database.messages for signal in message.signals]
    close = difflib.get_close_matches(name, there, n=3, cutoff=0.4)
    raise InputError(
        f"{path}: no signal {name!r}; nearest: {', '.join(close) or 'none'}; it holds {len(there)} signals"
    )


def _id(message: Any) -> str:
    return show_id(frame_key(message.frame_id, message.is_extended_frame))
