"""From blocks to windows: which samples were received, which are missing, and which make a window. Pure.

A *segment* is a contiguous run of samples: one epoch, no sample missing, no jump of the stamps. Windows of a segment
start at its first sample + k * hop; so what the windows are depends on the samples alone, not on how they were cut into
blocks, repeated or reordered.
Every sample number of an epoch below `next_seq` was either received once or lies in exactly one reported gap.
"""

from __future__ import annotations

import collections
import dataclasses
import math

import numpy as np

from monitor.epochs import Candidates, successor
from monitor.samples import Gap, GapKind, Outcome, Samples, StreamState, Window, WindowId, WindowRule

JUMP = 1.5  # sample times between two stamps that end a segment
SPLINTER = 4  # samples: pauses after fewer are only counted, else a wrong dt_ns would fill the history
KEPT_GAPS = 256  # latest gaps of an epoch, to tell what comes late from what comes twice


class Assembler:
    """Settles the samples of one axis, in order. No clock, no I/O; `now` [s] is any clock that only grows."""

    def __init__(
        self, rule: WindowRule, state: StreamState | None = None, gaps: list[tuple[int, int]] | None = None
    ) -> None:
        """Start from `state` as stored; `gaps` are the (from, to) gaps of its epoch, to tell late from duplicate."""
        self.rule = rule
        self.stretch = 1  # windows of the rule per window that is begun
        self.state = state or StreamState()
        self._held: dict[int, tuple[Samples, float]] = {}
        self._others = Candidates(rule)
        self._moved = -math.inf  # when a block came in order. [s]
        self._gaps = collections.deque(gaps or [], maxlen=KEPT_GAPS)

    @property
    def held(self) -> int:
        """Blocks that wait for missing ones before them, or for their epoch to begin."""
        return len(self._held) + len(self._others)

    def offer(self, block: Samples, now: float) -> Outcome:
        """Take a block as it arrived; order, repetition and overlap do not matter."""
        out = Outcome()
        if block.epoch != self.state.epoch:
            self._others.take(block, self.state, now, out)
        else:
            if block.end > self.state.next_seq and block.seq not in self._held:
                self._move(sure=True)
            self._others.note_current(self.state, now, out)
            self._offer_current(block, now, out)
        self._change_epochs(now, out)
        return out

    def _offer_current(self, block: Samples, now: float, out: Outcome) -> None:
        """Take a block of the current epoch."""
        if self.state.next_seq < 0 and block.seq == 0:
            self._move(next_seq=0)
        block = self._hold_back(block, out)
        if len(block):
            known = self._held.get(block.seq)
            if known is None or len(known[0]) < len(block):
                self._held[block.seq] = (block, known[1] if known else now)
                out.duplicates += len(known[0]) if known else 0
            else:
                out.duplicates += len(block)
        before = self.state.next_seq
        self._take_ready(out)
        if self.state.next_seq > before:
            self._moved = now
        most = self.rule
        while len(self._held) > most.held_blocks or sum(len(one) for one, _ in self._held.values()) > most.held_samples:
            self._give_up_waiting(out)

    @property
    def stuck_since(self) -> float | None:
        """Since when blocks wait for missing ones, and none came in order; None where none waits. [s]"""
        return max(self._moved, min(at for _, at in self._held.values())) if self._held else None

    def settle(self, now: float, fetching: bool = False) -> Outcome:
        """Declare the gaps that were waited for long enough.

        While blocks still come in order nothing is missing before them. With `fetching` none is declared: what is
        missing may be on its way.
        """
        out = Outcome()
        while not fetching and (since := self.stuck_since) is not None and now - since >= self.rule.patience:
            block, arrived = self._held[min(self._held)]
            if not self._is_stray(block):
                self._give_up_waiting(out)
            elif now - arrived >= self.rule.silence:
                del self._held[block.seq]
                out.stray_seq += len(block)
            else:
                break
        self._change_epochs(now, out)
        return out

    def _is_stray(self, block: Samples) -> bool:
        """Whether less time has passed than the samples missing before `block` take, and no other continues it."""
        if self.state.last_ns is None or self.state.next_seq <= self.state.segment_seq:
            return False  # nothing of this epoch to compare with
        time_ns = int(block.t_ns[0]) - self.state.last_ns
        if time_ns >= (block.seq - self.state.next_seq) * self._step_ns(block) / 2:
            return False
        return not any(block.end == other.seq or other.end == block.seq for other, _ in self._held.values())

    def _step_ns(self, block: Samples) -> int:
        """Sample time. [ns]; 0 = a single sample, which does not tell."""
        return self.rule.sample_time_ns or (int(np.median(np.diff(block.t_ns))) if len(block) > 1 else 0)

    def _change_epochs(self, now: float, out: Outcome) -> None:
        """Begin the epochs whose time has come, each with all that has arrived of it."""
        while (begun := self._others.next(self.state, now, out)) is not None:
            epoch, sure, blocks = begun
            self._end_epoch(int(blocks[0].t_ns[0]), out)
            self.state = successor(self.state, epoch, sure)
            for block in blocks:
                self._offer_current(block, now, out)

    def _hold_back(self, block: Samples, out: Outcome) -> Samples:
        """Drop the part of `block` that is already settled."""
        settled = min(max(self.state.next_seq - block.seq, 0), len(block))
        if settled:
            end = block.seq + settled
            late = sum(max(0, min(end, to) - max(block.seq, start)) for start, to in self._gaps)
            out.late += late
            out.duplicates += settled - late
        return block.cut(block.seq + settled, block.end) if settled else block

    def _end_epoch(self, to_ns: int, out: Outcome) -> None:
        """Settle what is left of the current epoch; the next one begins at `to_ns` [ns]."""
        while self._held:
            self._give_up_waiting(out)
        old = self.state
        if old.epoch >= 0 and old.next_seq >= 0:
            out.gaps.append(Gap(GapKind.EPOCH, old.epoch, old.next_seq, old.next_seq, old.last_ns, to_ns))
        self._gaps.clear()

    def _give_up_waiting(self, out: Outcome) -> None:
        """Declare what is missing before the first held block as a gap, and go on behind it."""
        first = min(self._held)
        start = max(self.state.next_seq, 0)
        if first > start:
            kind = GapKind.JOINED_LATE if self.state.next_seq < 0 else GapKind.MISSING
            to_ns = int(self._held[first][0].t_ns[0])
            out.gaps.append(Gap(kind, self.state.epoch, start, first, self.state.last_ns, to_ns))
            self._gaps.append((start, first))
        self._move(next_seq=first, segment_seq=first, starts=())
        self._take_ready(out)

    def _take_ready(self, out: Outcome) -> None:
        """Accept held blocks as long as they continue what is settled."""
        while self._held and self.state.next_seq >= 0 and (first := min(self._held)) <= self.state.next_seq:
            block = self._hold_back(self._held.pop(first)[0], out)
            if len(block):
                self._accept(block, out)

    def _accept(self, block: Samples, out: Outcome) -> None:
        """Append `block` to the segment, cutting it where the stamps jump."""
        stamps = block.t_ns if self.state.last_ns is None else np.concatenate(([self.state.last_ns], block.t_ns))
        steps = np.diff(stamps)
        nominal = self._step_ns(block)
        broken = (steps <= 0) | (steps > JUMP * nominal) if nominal > 0 else steps <= 0
        offset, first = len(block) - len(steps), block.seq
        out.accepted.append(block)
        for cut in (np.flatnonzero(broken) + offset + block.seq).tolist():
            if cut > first:
                self._extend(block.cut(first, cut), out)
            if (length := cut - self.state.segment_seq) >= SPLINTER:
                before, after = int(stamps[cut - block.seq - offset]), int(block.t_ns[cut - block.seq])
                out.gaps.append(Gap(GapKind.PAUSE, block.epoch, cut, cut, before, after))
            elif length:  # else a segment begins here anyway, with its gap already told
                out.splinters += 1
            self._move(segment_seq=cut, starts=())
            first = cut
        self._extend(block.cut(first, block.end), out)

    def _extend(self, run: Samples, out: Outcome) -> None:
        """Append an unbroken run to the segment; note the windows it begins and completes."""
        rule, segment = self.rule, self.state.segment_seq
        hop = rule.hop * self.stretch
        begun = run.seq + (segment - run.seq) % hop  # first number of the hop grid at or after run.seq
        starts = [*self.state.starts, *((seq, int(run.t_ns[seq - run.seq])) for seq in range(begun, run.end, hop))]
        while starts and starts[0][0] + rule.samples <= run.end:
            seq, start_ns = starts.pop(0)
            end_ns = int(run.t_ns[seq + rule.samples - 1 - run.seq])
            out.windows.append(Window(WindowId(run.epoch, seq, rule.samples), start_ns, end_ns))
        self._move(next_seq=run.end, last_ns=int(run.t_ns[-1]), starts=tuple(starts))

    def _move(self, **changes: object) -> None:
        self.state = dataclasses.replace(self.state, **changes)  # type: ignore[arg-type]
