"""The way in: message -> checked block -> journal -> waiting windows. What is refused is counted with its reason."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import structlog

from monitor.axis_run import AxisRun, samples_of, step_of
from monitor.errors import DatabaseError
from monitor.fleet import Fleet
from monitor.inbox import Message
from monitor.store import Store
from monitor.windows import Assembler
from plant.errors import PayloadError
from plant.wire import Block, decode_block

log = structlog.get_logger()

FETCHING = 15.0  # s that a fetch may take, or wait for its turn, before gaps are declared without it
LOGGED = {10**k for k in range(18)}  # of many equal refusals


class Reception:
    """Takes messages for all axes and commits what was settled. Belongs to the supervising thread."""

    def __init__(
        self,
        fleet: Fleet,
        store: Store,
        acknowledge: Callable[[AxisRun], None],
        clock: Callable[[], float],
        wall: Callable[[], int],
        fetch: Callable[[str], bool] | None = None,
    ) -> None:
        """`acknowledge` is called for every axis whose samples were committed. `clock` in s, `wall` in ns.

        `fetch` asks the publishers' caches for all they hold of a key; False = too many are being asked.
        """
        self._fleet, self._store, self._acknowledge = fleet, store, acknowledge
        self._clock, self._wall, self._fetch = clock, wall, fetch
        self._holding: dict[int, AxisRun] = {}  # axes with blocks that wait for missing ones before them

    def receive(self, messages: list[Message], dropped: Mapping[str, int]) -> None:
        """Take messages; one that trips an error of ours is counted and passed over, its neighbours are served.

        `dropped` counts, by key, those that the queue before us could not hold.
        """
        for message in messages:
            run = self._fleet.of_key(message.key)
            if run is None:
                continue
            try:
                self._take(run, message)
            except DatabaseError:
                raise
            except Exception:
                if run.reject("internal_error") in LOGGED:
                    log.exception("a message tripped an error of ours", axis=run.record.name)
        for key, count in dropped.items():
            if (run := self._fleet.of_key(key)) is not None:
                run.reject("queue_full", count)

    def _take(self, run: AxisRun, message: Message) -> None:
        if message.complete:
            run.asked, run.fetched = None, self._clock()
            return
        run.heard = message.arrived
        run.delay = self._clock() - message.arrived
        block = self._read(run, message)
        if block is None:
            return
        run.clock.note(block, self._wall() - round(run.delay * 1e9))
        if run.axis is None:
            run.record.samples += len(block)
            run.record.last_ns = int(block.t_ns[-1])
            run.dirty = True
            return
        assembler = run.assembler or self._fleet.assemble(run, run.axis, step_of(block))
        out = assembler.offer(samples_of(block), self._clock())  # patience begins at its turn, not in the queue
        if message.fetched:
            out.duplicates = 0  # what we had already was not sent in vain: we asked for it
        run.add(out)
        if assembler.held:
            self._holding[run.record.id] = run
            run.key = message.key

    def _read(self, run: AxisRun, message: Message) -> Block | None:
        """The block of a message; None and one more refusal where it is none of this axis."""
        try:
            block = decode_block(message.payload, message.encoding)
            if block.axis != run.record.name:
                raise PayloadError("wrong_axis", f"the payload names axis {block.axis!r}")
        except PayloadError as error:
            count = run.reject(error.reason)
            if count in LOGGED:
                log.warning("payload refused", axis=run.record.name, reason=error.reason, why=str(error), count=count)
            return None
        return block

    def settle(self, now: float) -> None:
        """Declare the gaps that were waited for long enough at `now` [s]."""
        for row, run in list(self._holding.items()):
            assert run.assembler is not None
            run.add(run.assembler.settle(now, self._is_fetching(run, run.assembler, now)))
            if not run.assembler.held:
                del self._holding[row]

    def _is_fetching(self, run: AxisRun, assembler: Assembler, now: float) -> bool:
        """Whether what is missing may be on its way; asks for it, once before a gap is declared."""
        since, patience = assembler.stuck_since, assembler.rule.patience
        if self._fetch is None or since is None or now - since >= FETCHING:
            return False
        if run.asked is not None:
            return True
        if now - since < patience / 2 or run.fetched >= since:
            return False
        if self._fetch(run.key):
            run.asked = now
            log.info("blocks are missing, the publishers are asked for them", axis=run.record.name)
        return True

    def commit(self) -> None:
        """Write what was settled; after this, and only after this, it is acknowledged."""
        dirty = [run for run in self._fleet if run.dirty or run.outcome.accepted or run.outcome.gaps]
        if not dirty:
            return
        by_id = {run.record.id: run for run in dirty}
        now = self._clock()
        batch = []
        for run in dirty:
            run.dirty = False
            out = run.close_batch() if run.assembler else run.outcome
            batch.append((run.record, out))
            for gap in out.gaps:
                if gap.missing:
                    log.warning(
                        "gap", axis=run.record.name, missing=gap.missing, first=gap.from_seq, why=gap.kind.value
                    )
        for record, row, window in self._store.commit(batch):
            self._fleet.line_up(by_id[record.id], row, window, now)
        for (_, out), run in zip(batch, dirty, strict=True):
            self._fleet.count(run, sum(len(part) for part in out.accepted))
            run.untidy |= bool(out.gaps)  # the end of a segment may leave samples that no window will take
            if out.accepted:
                self._acknowledge(run)
