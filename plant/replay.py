"""Playing recordings into the stream: original timing or any speed, paced so that nothing is lost."""

from __future__ import annotations

import contextlib
import heapq
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import zenoh

from plant import keys
from plant.acknowledgement import Acknowledgements
from plant.axis import Axis
from plant.blocks import count_samples, recording_blocks
from plant.errors import InputError, ParameterError, ReachError
from plant.publisher import CACHE_BLOCKS, SamplePublisher
from plant.recording import Recording
from plant.wire import CBOR, Block


@dataclass(frozen=True, slots=True)
class ReplaySettings:
    """How to play.

    Attributes:
        speed: times real time; 0 means as fast as the daemon acknowledges. >= 0
        repeat: how often the whole is played. >= 1
        block: samples per block. 1 ... 10000
        window: samples that may be on their way unacknowledged; less than the publisher's cache, so that a daemon
            that restarts can still fetch them. >= block
        stall: how long to wait for the first acknowledgement before giving up on it. [s] > 0
        patience: how long to wait for the next once there was one: a daemon may be restarting, a recording can wait.
            [s] > 0
        start_ns: Unix time of the first sample; None means now. [ns]
        original: every recording begins when it was made; all must say when.
        encoding: of the payload.
        prefix: of the keys.
    """

    speed: float = 1.0
    repeat: int = 1
    block: int = 100
    window: int = 40_000
    stall: float = 15.0
    patience: float = 60.0
    start_ns: int | None = None
    original: bool = False
    encoding: str = CBOR
    prefix: str = keys.PREFIX

    def __post_init__(self) -> None:
        """Check ranges."""
        for name, allowed, good in (
            ("speed", ">= 0 (0: as fast as possible)", 0 <= self.speed < float("inf")),
            ("repeat", ">= 1", self.repeat >= 1),
            ("block", "1 ... 10000 samples", 1 <= self.block <= 10_000),
            ("window", ">= block", self.window >= self.block),
            ("stall", "> 0 s", self.stall > 0),
            ("patience", "> 0 s", self.patience > 0),
            ("start_ns", ">= 0 ns, Unix time", self.start_ns is None or self.start_ns >= 0),
            ("repeat", "1 with the original time", self.repeat == 1 or not self.original),
        ):
            if not good:
                raise ParameterError(name, getattr(self, name), allowed)


@dataclass(frozen=True, slots=True)
class Track:
    """What to play on one axis: its name and its recordings, one after another."""

    axis_name: str
    recordings: tuple[Recording, ...]


@dataclass(frozen=True, slots=True)
class ReplayResult:
    """What was sent of one axis, and what the daemon says of it.

    Attributes:
        axis: name.
        epoch: of the stream, to be found in the daemon's history.
        samples: sent.
        skipped: samples without a usable time stamp, not sent.
        blocks: sent.
        bytes: sent.
        seconds: wall time until the last acknowledgement, or giving up on it. [s]
        committed_seq: last sample that the daemon shows as committed; -1 for none.
        missing: samples of the axis that the daemon has reported as missing meanwhile.
        acknowledged: the daemon has committed the last sample.
    """

    axis: str
    epoch: int
    samples: int
    skipped: int
    blocks: int
    bytes: int
    seconds: float
    committed_seq: int
    missing: int

    @property
    def acknowledged(self) -> bool:
        """True when the daemon has committed the last sample and misses none."""
        return self.committed_seq >= self.samples - 1 and self.missing == 0


Progress = Callable[[int, int, int], None]
"""Called with samples sent, samples acknowledged, samples in all."""


def replay(
    recordings: Sequence[Recording],
    axis: Axis | str,
    session: zenoh.Session,
    site: str,
    settings: ReplaySettings | None = None,
    progress: Progress | None = None,
) -> ReplayResult:
    """Play `recordings` of one axis; see `replay_tracks`."""
    name = axis if isinstance(axis, str) else axis.name
    return replay_tracks([Track(name, tuple(recordings))], session, site, settings, progress)[0]


def replay_tracks(
    tracks: Sequence[Track],
    session: zenoh.Session,
    site: str,
    settings: ReplaySettings | None = None,
    progress: Progress | None = None,
) -> list[ReplayResult]:
    """Play several axes at once, then wait until the daemon has committed the last sample of each.

    Stamps keep their original spacing at any speed; speed only says how fast they are sent.

    Args:
        tracks: one per axis.
        session: open session; the caller closes it.
        site: of the keys.
        settings: how to play.
        progress: told after each block.

    Returns:
        One result per track, in order.

    Raises:
        ReachError: at speed 0, when nobody acknowledges within `settings.stall`.
    """
    settings = settings or ReplaySettings()
    if settings.original:
        tracks = [_in_order(track) for track in tracks]
    with contextlib.ExitStack() as stack:
        start_ns = time.time_ns() if settings.start_ns is None else settings.start_ns
        lanes = [_Lane(track, session, site, settings, start_ns, stack) for track in tracks]
        player = _Player(lanes, settings, progress)
        player.play()
        player.wait_for_the_last()
        return [lane.result(player.seconds) for lane in lanes]


def _in_order(track: Track) -> Track:
    """The recordings of a track as they were made.

    Raises:
        InputError: one does not say when.
    """
    unknown = next((one.source for one in track.recordings if one.begin_ns is None), None)
    if unknown is not None:
        raise InputError(f"{unknown}: does not say when it was made; give the time of the first sample instead")
    return Track(track.axis_name, tuple(sorted(track.recordings, key=lambda one: one.begin_ns or 0)))


class _Lane:
    """One axis while it is played: blocks, publisher, acknowledgements, counts."""

    def __init__(
        self,
        track: Track,
        session: zenoh.Session,
        site: str,
        settings: ReplaySettings,
        start_ns: int,
        stack: contextlib.ExitStack,
    ) -> None:
        self.total, self.skipped = count_samples(track.recordings, settings.repeat)
        cache = max(CACHE_BLOCKS, settings.window // settings.block + 2)
        encoding, prefix = settings.encoding, settings.prefix
        publisher = SamplePublisher(
            session, site, track.axis_name, prefix=prefix, encoding=encoding, cache_blocks=cache
        )
        self.publisher = stack.enter_context(publisher)
        epoch = publisher.epoch
        self.acknowledgements = stack.enter_context(Acknowledgements(session, site, track.axis_name, epoch, prefix))
        self.blocks = recording_blocks(
            track.recordings,
            track.axis_name,
            epoch=epoch,
            start_ns=start_ns,
            samples=settings.block,
            repeat=settings.repeat,
            original=settings.original,
        )
        self.sent = self.sent_blocks = self.sent_bytes = 0
        self.unheard = -1  # the acknowledgement after which none came for long

    def put(self, block: Block) -> None:
        self.sent_bytes += self.publisher.put(block)
        self.sent_blocks += 1
        self.sent = block.seq + len(block)

    def result(self, seconds: float) -> ReplayResult:
        return ReplayResult(
            self.publisher.axis_name,
            self.publisher.epoch,
            self.sent,
            self.skipped,
            self.sent_blocks,
            self.sent_bytes,
            seconds,
            self.acknowledgements.committed,
            self.acknowledgements.missing,
        )


class _Player:
    """The loop: whichever axis is due next sends its block, when its time has come and its window has room."""

    def __init__(self, lanes: Sequence[_Lane], settings: ReplaySettings, progress: Progress | None) -> None:
        self.lanes, self.settings, self.progress = lanes, settings, progress
        self.total = sum(lane.total for lane in lanes)
        self.began = time.monotonic()
        self.seconds = 0.0

    def play(self) -> None:
        due = heapq.merge(*map(self._with_lane, self.lanes), key=lambda pair: int(pair[1].t_ns[-1]))
        first: int | None = None
        for lane, block in due:
            first = int(block.t_ns[0]) if first is None else first
            self._wait_for_time((int(block.t_ns[-1]) - first) * 1e-9)
            self._wait_for_room(lane, len(block))
            lane.put(block)
            self._tell()

    @staticmethod
    def _with_lane(lane: _Lane) -> Iterator[tuple[_Lane, Block]]:
        return ((lane, block) for block in lane.blocks)

    def _wait_for_time(self, event_seconds: float) -> None:
        if self.settings.speed:
            pause = self.began + event_seconds / self.settings.speed - time.monotonic()
            if pause > 0:
                time.sleep(pause)

    def _wait_for_room(self, lane: _Lane, samples: int) -> None:
        """Keep what is unacknowledged within the window; only at speed 0 is an unheard stream an error."""
        needed = lane.sent + samples - self.settings.window - 1
        committed = lane.acknowledgements.committed
        if self.settings.speed and committed <= lane.unheard:
            return  # nobody acknowledges, or no longer: a stream goes on
        while committed < needed:
            news = lane.acknowledgements.wait_beyond(committed, self._patience(committed))
            if news == committed:
                lane.unheard = committed
                if self.settings.speed:
                    return
                raise _unheard(lane, self._patience(committed))
            committed = news
            self._tell()

    def wait_for_the_last(self) -> None:
        for lane in self.lanes:
            committed = lane.acknowledgements.committed
            while committed < lane.sent - 1:
                if committed <= lane.unheard and committed >= 0:
                    break  # waited for long enough already
                news = lane.acknowledgements.wait_beyond(committed, self._patience(committed))
                if news == committed:
                    break
                committed = news
                self._tell()
        self.seconds = time.monotonic() - self.began

    def _patience(self, committed: int) -> float:
        return self.settings.stall if committed < 0 else self.settings.patience

    def _tell(self) -> None:
        if self.progress:
            acknowledged = sum(lane.acknowledgements.committed + 1 for lane in self.lanes)
            self.progress(sum(lane.sent for lane in self.lanes), acknowledged, self.total)


def _unheard(lane: _Lane, waited: float) -> ReachError:
    name = lane.publisher.axis_name
    return ReachError(
        f"the daemon has acknowledged {lane.acknowledgements.committed + 1} of {lane.sent} samples of {name} "
        f"and then nothing for {waited:g} s: is the axis listed under [[axis]] in its configuration, "
        "and is the site the same?"
    )
