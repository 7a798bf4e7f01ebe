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


def missing_samples(payload: bytes) -> int | None:
    """How many samples of the axis a status (JSON) reports as missing, ever; None where it does not say."""
    try:
        status = json.loads(payload)
    except (ValueError, RecursionError):
        return None
    missing = status.get("missing") if isinstance(status, dict) else None
    return missing if type(missing) is int else None


class Acknowledgements:
    """Listens to the status of one axis and lets a publisher wait for it. A context manager."""

    def __init__(
        self, session: zenoh.Session, site: str, axis_name: str, epoch: int, prefix: str = keys.PREFIX
    ) -> None:
        """Subscribe to the axis' status; samples of another epoch than `epoch` are not ours."""
        self._epoch = epoch
        self._news = threading.Condition()
        self._committed = -1
        self._missing: list[int] = []  # as first and as last reported
        self._subscriber = session.declare_subscriber(keys.status_key(site, axis_name, prefix), self._hear)

    def __enter__(self) -> Self:
        """Return the listener."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """Stop listening."""
        self._subscriber.undeclare()  # type: ignore[no-untyped-call]  # zenoh's stub

    def _hear(self, sample: zenoh.Sample) -> None:
        payload = sample.payload.to_bytes()
        seq, missing = committed_seq(payload, self._epoch), missing_samples(payload)
        with self._news:
            if missing is not None:
                self._missing = [*self._missing[:1], missing]
            if seq > self._committed:
                self._committed = seq
                self._news.notify_all()

    @property
    def committed(self) -> int:
        """Index of the last committed sample; -1 before the first."""
        return self._committed

    @property
    def missing(self) -> int:
        """Samples reported as missing since the first status that was heard."""
        return self._missing[-1] - self._missing[0] if self._missing else 0

    def wait_beyond(self, seq: int, timeout: float) -> int:
        """Wait until more than `seq` is committed, at most `timeout` [s]; return what is committed."""
        with self._news:
            self._news.wait_for(lambda: self._committed > seq, timeout)
            return self._committed
