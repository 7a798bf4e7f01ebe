"""Several recordings as one set of samples to fit and one to judge by."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identify.preprocess import Samples, prepare
from plant.axis import Axis
from plant.recording import Recording

HELD_OUT = 0.4  # of the last recording, where there is no second one of the same state


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """What is fitted, what judges, and what came before.

    Attributes:
        train: samples to fit.
        held_out: samples the fit never sees.
        kind: "recording" or "time", the contract's word for how it was held out.
        before: the machine at commissioning, or None.
        removed: what preprocessing did, in words.
        sha256: of all recordings.
    """

    train: Samples
    held_out: Samples
    kind: str
    before: Samples | None
    removed: tuple[str, ...]
    sha256: str


def gather(recordings: Sequence[Recording], axis: Axis, *, in_time: bool = False) -> Evidence:
    """Split usable recordings into what is fitted and what judges (docs/json.md).

    Args:
        recordings: of one machine.
        axis: the machine.
        in_time: the other way to hold out: of the last of several recordings its end alone (its beginning, where the
            axis travels less at the end), of a single one its beginning.
    """
    ready = [prepare(recording, axis) for recording in recordings]
    slowest = max(samples.sample_time for samples in ready)
    if any(samples.sample_time < 0.7 * slowest for samples in ready):
        common = dataclasses.replace(axis, analysis_sample_time=slowest)
        ready = [prepare(recording, common) for recording in recordings]
    before = [s for s, r in zip(ready, recordings, strict=True) if r.note.strip() == "commissioning"]
    now = [s for s, r in zip(ready, recordings, strict=True) if r.note.strip() != "commissioning"]
    if not now:
        now, before = before, []
    *others, last = now
    if others and not in_time:
        train, held_out, kind = join(others), last, "recording"
    else:
        cut = round((1.0 - HELD_OUT) * len(last))
        fitted, held_out = last.part(0, cut), last.part(cut, len(last))
        start = last.part(0, len(last) - cut)
        if in_time and (not others or np.ptp(held_out.position) < np.ptp(start.position)):
            fitted, held_out = last.part(len(last) - cut, len(last)), start
        train, kind = join([*others, fitted]), "time"
    removed = tuple(dict.fromkeys(line for samples in ready for line in samples.removed))
    return Evidence(train, held_out, kind, join(before) if before else None, removed, digest(recordings))


def digest(recordings: Sequence[Recording]) -> str:
    """SHA-256 of all recordings together."""
    return hashlib.sha256("".join(recording.sha256() for recording in recordings).encode()).hexdigest()


def join(parts: Sequence[Samples]) -> Samples:
    """Samples of several recordings behind each other; each keeps its own clock, none runs into the next."""
    if len(parts) == 1:
        return parts[0]
    offsets = np.cumsum([0, *(part.runs for part in parts[:-1])])
    return dataclasses.replace(
        parts[0],
        t=np.concatenate([part.t for part in parts]),
        force=np.concatenate([part.force for part in parts]),
        position=np.concatenate([part.position for part in parts]),
        steps=np.concatenate([part.steps for part in parts]),
        run=np.concatenate([part.run + offset for part, offset in zip(parts, offsets, strict=True)]),
        valid=np.concatenate([part.valid for part in parts]),
        removed=tuple(dict.fromkeys(line for part in parts for line in part.removed)),
    )
