"""What a publisher reads from `…/status`: up to which sample the daemon has committed its stream."""

from __future__ import annotations

import json
import threading
from types import TracebackType
from typing import Self

import zenoh

from plant import keys


def committed_seq(payload: bytes, epoch: int) -> int:
    """Index of the last sample of `epoch` that a status (JSON) shows as committed; -1 where it shows none."""
    try:
        status = json.loads(payload)
    except (ValueError, RecursionError):
        return -1
    committed = status.get("committed") if isinstance(status, dict) else None
    if not isinstance(committed, dict) or committed.get("epoch") != epoch:
        return -1
    seq = committed.get("seq")
    return seq if type(seq) is int else -1


class Acknowledgements:
    """Listens to the status of one axis and lets a publisher wait for it. A context manager."""

    def __init__(
        self, session: zenoh.Session, site: str, axis_name: str, epoch: int, prefix: str = keys.PREFIX
    ) -> None:
        """Subscribe to the axis' status; samples of another epoch than `epoch` are not ours."""
        self._epoch = epoch
        self._news = threading.Condition()
        self._committed = -1
        self._subscriber = session.declare_subscriber(keys.status_key(site, axis_name, prefix), self._hear)

    def __enter__(self) -> Self:
        """Return the listener."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """Stop listening."""
        self._subscriber.undeclare()  # type: ignore[no-untyped-call]  # zenoh's stub

    def _hear(self, sample: zenoh.Sample) -> None:
        seq = committed_seq(sample.payload.to_bytes(), self._epoch)
        with self._news:
            if seq > self._committed:
                self._committed = seq
                self._news.notify_all()

    @property
    def committed(self) -> int:
        """Index of the last committed sample; -1 before the first."""
        return self._committed

    def wait_beyond(self, seq: int, timeout: float) -> int:
        """Wait until more than `seq` is committed, at most `timeout` [s]; return what is committed."""
        with self._news:
            self._news.wait_for(lambda: self._committed > seq, timeout)
            return self._committed
