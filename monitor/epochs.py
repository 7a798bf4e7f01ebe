"""Which epoch of a stream counts. Pure.

One message proves little: a single one with a far too large epoch must not make everything after it old. So a later
epoch begins with its second message, or with its first once the current epoch has been silent for `patience`; an
earlier one, which a clock that was set back leaves behind, once the current epoch has been silent for `silence`, or at
once where the current one never came to a second message. Until then its messages wait here. What was received of an
epoch before is remembered, so that none of its samples is taken twice.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from monitor.samples import Outcome, Samples, StreamState, WindowRule

WAITING, REMEMBERED = 8, 16  # epochs: more, and the longest waiting is refused, the earliest is over for good


@dataclass(slots=True)
class _Candidate:
    """Messages of an epoch that has not begun: by first sample; arrival of the first and of the latest. [s]"""

    since: float
    latest: float
    blocks: dict[int, Samples] = field(default_factory=dict)


def successor(state: StreamState, epoch: int, sure: bool) -> StreamState:
    """The state with which `epoch` begins, or goes on where it was left, after `state`."""
    former = dict(state.former)
    if state.next_seq >= 0:
        former[state.epoch] = state.next_seq
    next_seq = former.pop(epoch, -1)
    kept = sorted(former.items())[-REMEMBERED:]
    floor = max([state.floor, *(former.keys() - dict(kept).keys())])
    return StreamState(epoch, next_seq, state.last_ns, max(next_seq, 0), (), sure, tuple(kept), floor)


class Candidates:
    """The epochs of one axis that may become the current one. No clock; `now` [s] is any clock that only grows."""

    def __init__(self, rule: WindowRule) -> None:
        """Nothing waits."""
        self._rule = rule
        self._waiting: dict[int, _Candidate] = {}
        self._alive: float | None = None  # when the current epoch spoke last; at first, since when we listen. [s]

    def __len__(self) -> int:
        """Messages that wait."""
        return sum(len(one.blocks) for one in self._waiting.values())

    def note_current(self, state: StreamState, now: float, out: Outcome) -> None:
        """The current epoch goes on: what waits of earlier ones is old."""
        self._alive = now
        if state.sure:
            for epoch in [one for one in self._waiting if one < state.epoch]:
                self._refuse(epoch, state, out)

    def take(self, block: Samples, state: StreamState, now: float, out: Outcome) -> None:
        """Keep a message of another epoch than the current one, or count it where that epoch is over for good."""
        known = dict(state.former).get(block.epoch, 0)
        if block.epoch <= state.floor or block.end <= known:
            out.old_epoch += len(block)
            return
        if block.seq < known:
            out.old_epoch += known - block.seq
            block = block.cut(known, block.end)
        one = self._waiting.setdefault(block.epoch, _Candidate(now, now))
        one.latest, blocks = now, one.blocks
        twice = blocks.get(block.seq)
        out.duplicates += 0 if twice is None else min(len(twice), len(block))
        if twice is None or len(twice) < len(block):
            blocks[block.seq] = block
        self._bound(state, out)

    def next(self, state: StreamState, now: float, out: Outcome) -> tuple[int, bool, list[Samples]] | None:
        """The epoch that begins now, if any: whether it is sure, and what has arrived of it. Strays are counted."""
        self._alive = now if self._alive is None else self._alive
        for epoch in sorted(one for one in self._waiting if one > state.epoch):
            if now - self._waiting[epoch].since >= self._rule.silence and not self._begins(epoch, state, now):
                self._refuse(epoch, state, out)
        ready = [epoch for epoch in self._waiting if self._begins(epoch, state, now)]
        if not ready:
            return None
        before = [epoch for epoch in self._waiting if epoch > state.epoch or not state.sure]
        epoch = min(one for one in (*ready, *before) if one <= max(ready))  # each in its turn, however short it was
        sure, one = self._is_sure(epoch, state), self._waiting.pop(epoch)
        self._alive = one.latest
        return epoch, sure, list(one.blocks.values())

    def _is_sure(self, epoch: int, state: StreamState) -> bool:
        return len(self._waiting[epoch].blocks) > 1 or epoch in dict(state.former)

    def _begins(self, epoch: int, state: StreamState, now: float) -> bool:
        if state.epoch < 0:
            return True
        quiet = now - (self._alive or 0.0)
        if epoch < state.epoch and state.sure and quiet < self._rule.silence:
            return False
        return self._is_sure(epoch, state) or min(quiet, now - self._waiting[epoch].since) >= self._rule.patience

    def _bound(self, state: StreamState, out: Outcome) -> None:
        """What has waited longest gives way, counted."""
        while len(self._waiting) > WAITING:
            self._refuse(next(iter(self._waiting)), state, out)
        while len(self) > self._rule.held_blocks or self._samples > self._rule.held_samples:
            epoch, one = next(iter(self._waiting.items()))
            self._count(one.blocks.pop(next(iter(one.blocks))), state, out)
            if not one.blocks:
                del self._waiting[epoch]

    @property
    def _samples(self) -> int:
        return sum(len(block) for one in self._waiting.values() for block in one.blocks.values())

    def _refuse(self, epoch: int, state: StreamState, out: Outcome) -> None:
        for block in self._waiting.pop(epoch).blocks.values():
            self._count(block, state, out)

    @staticmethod
    def _count(block: Samples, state: StreamState, out: Outcome) -> None:
        if block.epoch < state.epoch:
            out.old_epoch += len(block)
        else:
            out.stray_epoch += len(block)
