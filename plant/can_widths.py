"""Does the layout fit what the drive sends? Judged on the first samples, before anything is sent. Pure.

A wrong width leaves traces: statuswords that CiA 402 does not know, a 16-bit position that wraps, a 32-bit one whose
upper half moves on its own. What the physics says (sign, unit, scale) is the audit's business, not this file's.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from plant.can_layout import Signal
from plant.cia402 import known_states
from plant.recording import Floats

ENOUGH = 100  # samples that are looked at
UNKNOWN = 0.2  # share of unknown statuswords that cannot be chance
WRAP = 0.75  # of the range: a larger jump is the counter turning over
SMOOTH = 0.125  # of 16 bits: largest step of a quantity that moves smoothly
RARE = 3  # jumps that one bad sample or two do not make

Raw = NDArray[np.int64] | Floats


def misfit(raw: dict[str, tuple[Signal, Raw]]) -> str | None:
    """Say why the layout cannot be right, from the raw counts of the first samples by channel; None when it may be."""
    if "statusword" in raw and (reason := _unknown_states(raw["statusword"][1])):
        return reason
    for channel in ("position", "velocity", "torque", "force"):
        if channel in raw:
            signal, counts = raw[channel]
            if not signal.is_float and (reason := _width(channel, signal, np.asarray(counts, dtype=np.int64))):
                return reason
    return None


def _unknown_states(statuswords: Raw) -> str | None:
    words = np.asarray(statuswords, dtype=np.int64)
    known = known_states(words)
    if len(words) < RARE or np.mean(~known) <= UNKNOWN:
        return None
    seen = ", ".join(f"0x{word:04X}" for word in dict.fromkeys(words[~known].tolist()[:3]))
    return (
        f"{np.mean(~known):.0%} of the statuswords are none that CiA 402 knows (seen: {seen}): "
        "the PDO is mapped otherwise; compare 1A00h of the drive with pdo in the bridge file"
    )


def _width(channel: str, signal: Signal, counts: NDArray[np.int64]) -> str | None:
    steps = np.diff(counts)
    if len(steps) < RARE:
        return None
    bits = signal.length
    if bits <= 24:
        wraps = int(np.sum(np.abs(steps) > WRAP * 2.0**bits))
        smooth = np.median(np.abs(steps)) < SMOOTH * 2.0**bits
        if wraps >= RARE and smooth:
            largest = int(np.max(np.abs(steps)))
            return (
                f"{channel} ({signal.name}, {bits} bit) jumps by up to {largest} counts {wraps} times in {len(counts)} "
                f"samples: it turns over at {bits} bits, so it is the lower part of a wider value; map 32 bits"
            )
        return None
    if bits == 32:
        low = np.diff(counts.astype(np.int64) & 0xFFFF)
        low = (low + 0x8000) % 0x10000 - 0x8000  # shortest way round
        high = np.diff(counts >> 16)
        carried = np.diff(((counts & 0xFFFF) >> 15).astype(np.int64))  # a carry goes with the lower half's turn
        alone = np.abs(high) > 1
        if (
            np.mean(alone) > UNKNOWN
            and np.sum(alone & (carried == 0)) >= RARE
            and np.mean(np.abs(low) < SMOOTH * 65536) > 1 - UNKNOWN / 2
        ):
            return (
                f"{channel} ({signal.name}, 32 bit) moves smoothly in its lower 16 bits and jumps by up to "
                f"{int(np.max(np.abs(steps)))} counts through its upper ones: two 16 bit values stand there"
            )
    return None
