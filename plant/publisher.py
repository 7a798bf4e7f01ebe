"""Publishing an axis' samples on Zenoh: blocks with (epoch, seq), kept in a cache for those who missed some."""

from __future__ import annotations

import time
from types import TracebackType
from typing import Self

import zenoh
import zenoh.ext

from plant import keys
from plant.errors import ParameterError
from plant.recording import Floats
from plant.wire import CBOR, Block, Stamps, encode_block

CACHE_BLOCKS = 600
HEARTBEAT = 0.5  # s, after which a subscriber notices that the tail of a burst is missing


class SamplePublisher:
    """The stream of one axis. A context manager: leaving it undeclares the publisher, and its cache is gone.

    Congestion is handled by BLOCK_FIRST: one frozen subscriber delays nobody, everybody else loses nothing.

    Attributes:
        axis_name: of the axis.
        epoch: an integer that grows with each start, so that a restarted publisher may count from 0 again.
        next_seq: index of the next sample in this epoch.
    """

    def __init__(
        self,
        session: zenoh.Session,
        site: str,
        axis_name: str,
        *,
        epoch: int | None = None,
        prefix: str = keys.PREFIX,
        encoding: str = CBOR,
        cache_blocks: int = CACHE_BLOCKS,
    ) -> None:
        """Declare the publisher.

        Args:
            session: an open session; it outlives this publisher.
            site: first id of the key.
            axis_name: second id of the key.
            epoch: default is the present Unix time in ns.
            prefix: of the key.
            encoding: `application/cbor` or `application/json`.
            cache_blocks: latest blocks kept for late joiners and recovery.

        Raises:
            ParameterError: an id that is not allowed in a key.
        """
        self.axis_name = axis_name
        self.epoch = time.time_ns() if epoch is None else epoch
        self.next_seq = 0
        self._encoding = encoding
        self._publisher = zenoh.ext.declare_advanced_publisher(
            session,
            keys.samples_key(site, axis_name, prefix),
            encoding=encoding,
            cache=zenoh.ext.CacheConfig(max_samples=cache_blocks),
            sample_miss_detection=zenoh.ext.MissDetectionConfig(heartbeat=HEARTBEAT, sporadic_heartbeat=None),
            publisher_detection=True,
            congestion_control=zenoh.CongestionControl.BLOCK_FIRST,
        )

    def __enter__(self) -> Self:
        """Return the publisher."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """Undeclare the publisher."""
        self._publisher.undeclare()  # type: ignore[no-untyped-call]  # zenoh's stub

    def put(self, block: Block) -> int:
        """Publish `block` and count its samples; return the bytes sent.

        Raises:
            PayloadError: the block breaks a rule of the payload.
            ParameterError: the block is of another axis, which its key would belie.
        """
        if block.axis != self.axis_name:
            raise ParameterError("block's axis", block.axis, f"{self.axis_name}, the publisher's axis")
        payload = encode_block(block, self._encoding)
        self._publisher.put(payload)
        self.next_seq = block.seq + len(block)
        return len(payload)

    def send(
        self,
        t_ns: Stamps,
        position: Floats,
        *,
        torque: Floats | None = None,
        force: Floats | None = None,
        velocity: Floats | None = None,
        temperature: Floats | None = None,
        load: Floats | None = None,
    ) -> Block:
        """Publish the next samples of this epoch, numbered by the publisher; return them as the block sent.

        Raises:
            PayloadError: the samples break a rule of the payload.
        """
        block = Block(
            self.axis_name, self.epoch, self.next_seq, t_ns, position, torque, force, velocity, temperature, load
        )
        self.put(block)
        return block
