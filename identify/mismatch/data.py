"""Several recordings as one set of samples to fit and one to judge by."""

from __future__ import annotations

import dataclasses
import enum
import hashlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.criterion import RUN_LENGTH
from identify.preprocess import Samples, prepare
from plant.axis import Axis
from plant.recording import Recording

HELD_OUT = 0.4  # of the last recording, where there is no second one of the same state
TENTHS = (True, False, True, False, True)  # of each recording, which are fitted, again and again: 60 % from all over it
SPREAD = "fitted to tenths from all over the recordings, judged by those between: {} of every {} were unseen"
TURNED = "fitted to the last recording and judged by those before it: the other way round, nothing was named"


class Judges(enum.Enum):
    """What judges, and is not fitted."""

    LAST = enum.auto()  # the last of several recordings, or the end of a single one
    PART = enum.auto()  # of the last of several recordings its end alone, or the beginning of a single one
    OTHERS = enum.auto()  # all recordings but the last
    TENTHS = enum.auto()  # tenths of each recording, between those that are fitted


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """What is fitted, what judges, and what came before.

    Attributes:
        train: samples to fit.
        held_out: samples the fit never sees.
        kind: "recording" or "time", the contract's word for how it was held out.
        judges: what was.
        before: the machine at commissioning, or None.
        removed: what preprocessing did, in words.
        sha256: of all recordings.
        quiet: whether the noise that was logged with the force is taken out of it.
    """

    train: Samples
    held_out: Samples
    kind: str
    judges: Judges
    before: Samples | None
    removed: tuple[str, ...]
    sha256: str
    quiet: bool = False


def gather(
    recordings: Sequence[Recording], axis: Axis, judges: Judges = Judges.LAST, removed: tuple[str, ...] = ()
) -> Evidence:
    """Split usable recordings of a machine into what is fitted and what judges (docs/json.md).

    Args:
        recordings: of one machine.
        axis: the machine.
        judges: what is held out; the part of the last of several recordings is its beginning where the axis travels
            less at the end, and a single recording has no others.
        removed: what was left out before, in words.
    """
    return split(recordings, at_one_rate(recordings, axis), judges, removed)


def split(
    recordings: Sequence[Recording],
    ready: Sequence[Samples],
    judges: Judges,
    removed: tuple[str, ...],
    only: int | None = None,
) -> Evidence:
    """As `gather`, from samples that are `ready` at one rate.

    Args:
        recordings: of one machine.
        ready: their samples.
        judges: as in `gather`.
        removed: as in `gather`.
        only: number of the one recording of today that is asked, by itself; None: all.
    """
    today = of_today(recordings)
    before = [samples for number, samples in enumerate(ready) if number not in today]
    now = [ready[number] for number in ([only] if only is not None else today)]
    *others, last = now
    removed = tuple(dict.fromkeys([*removed, *(line for samples in ready for line in samples.removed)]))
    if judges is Judges.TENTHS:
        train, held_out, kind = *map(join, in_tenths(now)), "time"
        removed = (*removed, SPREAD.format(TENTHS.count(False), len(TENTHS)))
    elif others and judges is not Judges.PART:
        train, held_out, kind = join(others), last, "recording"
        if judges is Judges.OTHERS:
            train, held_out, removed = held_out, train, (*removed, TURNED)
    else:
        cut = round((1.0 - HELD_OUT) * len(last))
        fitted, held_out = last.part(0, cut), last.part(cut, len(last))
        start = last.part(0, len(last) - cut)
        if judges is Judges.PART and (not others or np.ptp(held_out.position) < np.ptp(start.position)):
            fitted, held_out = last.part(len(last) - cut, len(last)), start
        train, kind = join([*others, fitted]), "time"
    return Evidence(train, held_out, kind, judges, join(before) if before else None, removed, digest(recordings))


def in_tenths(recordings: Sequence[Samples]) -> tuple[list[Samples], list[Samples]]:
    """Tenths of each recording that are fitted, and those between them, which judge; fifths where it is short."""
    fitted: list[Samples] = []
    judging: list[Samples] = []
    for samples in recordings:
        number = len(TENTHS) * (2 if np.ptp(samples.t) >= 2 * len(TENTHS) * RUN_LENGTH else 1)
        edges = np.linspace(0, len(samples), number + 1).round().astype(int)
        for fits, start, stop in zip(TENTHS * 2, edges, edges[1:], strict=False):
            (fitted if fits else judging).append(samples.part(int(start), int(stop)))
    return fitted, judging


def of_today(recordings: Sequence[Recording]) -> list[int]:
    """Numbers of the recordings that are not of commissioning; all, where there are no others."""
    numbers = range(len(recordings))
    return [number for number in numbers if recordings[number].note.strip() != "commissioning"] or list(numbers)


def at_one_rate(recordings: Sequence[Recording], axis: Axis) -> list[Samples]:
    """Usable recordings as samples, all as slow as the slowest."""
    ready = [prepare(recording, axis) for recording in recordings]
    slowest = max(samples.sample_time for samples in ready)
    if any(samples.sample_time < 0.7 * slowest for samples in ready):
        common = dataclasses.replace(axis, analysis_sample_time=slowest)
        ready = [prepare(recording, common) for recording in recordings]
    return ready


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


def begins(samples: Samples) -> NDArray[np.int64]:
    """Where each of several joined recordings begins: there its clock goes back. (recordings,)"""
    return np.concatenate([[0], np.flatnonzero(np.diff(samples.t) < 0.0) + 1])


def following(evidence: Evidence, number: int) -> tuple[Evidence, int, float]:
    """The evidence of recordings that follow each other, on the clock of the fitted one of this `number`.

    Returns:
        the evidence, the place of that recording among all, and how long it lasts. [s]
    """
    turned = evidence.judges is Judges.OTHERS  # what judges came before what is fitted
    earlier, later = (
        np.split(samples.t, begins(samples)[1:])
        for samples in ((evidence.held_out, evidence.train) if turned else (evidence.train, evidence.held_out))
    )
    clocks, own = [*earlier, *later], number + (len(earlier) if turned else 0)
    starts = np.cumsum([0.0, *(clock.max() + evidence.train.sample_time for clock in clocks)])
    carried = [clock + (start - starts[own]) for clock, start in zip(clocks, starts, strict=False)]
    before, after = (np.concatenate(part) for part in (carried[: len(earlier)], carried[len(earlier) :]))
    ours, theirs = (after, before) if turned else (before, after)
    moved = dataclasses.replace(
        evidence,
        train=dataclasses.replace(evidence.train, t=ours),
        held_out=dataclasses.replace(evidence.held_out, t=theirs),
    )
    return moved, own, float(clocks[own].max())
