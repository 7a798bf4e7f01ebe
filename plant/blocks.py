"""A recording cut into blocks of the stream: stamps moved to Unix time, raw samples, numbered without a hole."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from plant.recording import Recording
from plant.wire import Block, Stamps

PAUSE_PERIODS = 10  # between two recordings at least: a pause ends a window, two runs must never share one
PAUSE_SECONDS = 1.0


def usable_stamps(recording: Recording, start_ns: int) -> tuple[Stamps, np.ndarray[tuple[int], np.dtype[np.bool_]]]:
    """Map `t` to Unix stamps, the first finite one to `start_ns`; say which samples can be stamped at all.

    A sample whose time is NaN or not after every time before it cannot be sent: stamps of the stream rise.

    Returns:
        Stamps (k,) [ns] and the mask (n,) of the k samples they belong to.
    """
    t = np.asarray(recording.t, dtype=np.float64)
    finite = np.isfinite(t)
    if not finite.any():
        return np.zeros(0, dtype=np.int64), finite
    with np.errstate(invalid="ignore"):
        stamps = np.rint((t - t[finite][0]) * 1e9)
    stamps = np.where(finite & (np.abs(stamps) < 2.0**62), stamps, -1.0)
    before = np.maximum.accumulate(np.concatenate(([-1.0], stamps[:-1])))
    keep = stamps > before
    return stamps[keep].astype(np.int64) + start_ns, keep


def recording_blocks(
    recordings: Sequence[Recording],
    axis_name: str,
    *,
    epoch: int,
    start_ns: int,
    samples: int = 100,
    repeat: int = 1,
    original: bool = False,
) -> Iterator[Block]:
    """Yield the blocks of `recordings`, one after another with a pause between, `repeat` times over.

    The samples are sent as force at the belt, as they are, averaged or smoothed nowhere; infinite values become NaN.

    Args:
        recordings: of one axis.
        axis_name: of the axis.
        epoch: of the publisher.
        start_ns: Unix time of the first sample. [ns]
        samples: per block.
        repeat: how often the whole is sent.
        original: every recording begins when it was made, where it says so.
    """
    seq = 0
    for _ in range(repeat):
        for recording in recordings:
            if original and recording.begin_ns is not None:
                start_ns = recording.begin_ns
            stamps, keep = usable_stamps(recording, start_ns)
            channels = {name: _sendable(getattr(recording, name)[keep]) for name in recording.channels() if name != "t"}
            for first in range(0, len(stamps), samples):
                cut = slice(first, first + samples)
                part = {name: values[cut] for name, values in channels.items()}
                yield Block(axis_name, epoch, seq, stamps[cut], dt_ns=_step(stamps[cut]), **part)
                seq += len(stamps[cut])
            if len(stamps):
                pause = max(
                    PAUSE_SECONDS,
                    PAUSE_PERIODS * float(np.median(np.diff(recording.t[keep]))) if len(stamps) > 1 else 0,
                )
                start_ns = int(stamps[-1]) + round(pause * 1e9)


def count_samples(recordings: Sequence[Recording], repeat: int = 1) -> tuple[int, int]:
    """How many samples `recording_blocks` sends, and how many it skips for want of a usable time stamp."""
    sent = sum(int(usable_stamps(recording, 0)[1].sum()) for recording in recordings)
    return sent * repeat, (sum(map(len, recordings)) - sent) * repeat


def _sendable(values: np.ndarray[tuple[int], np.dtype[np.float64]]) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.where(np.isinf(values), np.nan, values)


def _step(stamps: Stamps) -> int | None:
    """The constant step of `stamps`, None where it varies or there is but one."""
    steps = np.diff(stamps)
    return int(steps[0]) if len(steps) and np.all(steps == steps[0]) else None
