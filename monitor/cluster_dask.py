"""Workers on other machines: a Dask cluster behind the `Executor` that `workers.py` and `identify_many` take.

The answers are those of local workers, bit for bit on one kind of processor: a job carries everything it needs, its
seed included. Nothing of Dask shows outside this file.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Executor, Future
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any, TypeVar

from monitor.errors import ConfigError
from plant.errors import ReachError

T = TypeVar("T")
CONNECT_SECONDS = 10.0
DEATHS = 3  # workers that may die under a job before Dask gives it up; its default


class DaskPool(Executor):
    """Runs jobs on the cluster at a scheduler's address. Connects when it is first used, in the thread that uses it.

    Raises:
        ConfigError: the package is not installed.
    """

    def __init__(self, address: str, identity: Path | None = None) -> None:
        """Remember where the scheduler is.

        Args:
            address: of the scheduler, `tcp://host:8786` or `tls://host:8786`.
            identity: folder with our certificate, for `tls://`; see `plant.identity_files`.
        """
        try:
            import distributed  # noqa: F401
        except ImportError:
            raise ConfigError(
                "identification.cluster needs Dask: pip install 'tribowatch[cluster]', or leave it empty"
            ) from None
        self._address, self._identity = address, identity
        self._client: Any = None  # of distributed, which is not typed throughout
        self._trouble: str | None = None
        self._lock = threading.Lock()

    def submit(self, fn: Callable[..., T], /, *args: Any, **kwargs: Any) -> Future[T]:
        """Run `fn` on the cluster.

        Raises:
            BrokenProcessPool: there is no scheduler, or no more.
        """
        client = self._connected()
        answer: Future[T] = Future()
        try:
            remote = client.submit(fn, *args, pure=False, **kwargs)
        except Exception as error:
            raise BrokenProcessPool(f"{self._address}: {type(error).__name__}: {error}") from None
        answer.set_running_or_notify_cancel()
        remote.add_done_callback(lambda done: _settle(done, answer))
        return answer

    def reach(self) -> int:
        """Connect; how many worker processes the cluster has.

        Raises:
            ReachError: there is no scheduler, or nobody works for it.
        """
        try:
            client = self._connected()
        except BrokenProcessPool as error:
            raise ReachError(str(error)) from None
        if not (workers := len(client.scheduler_info(n_workers=-1)["workers"])):
            raise ReachError(f"nobody works for the scheduler at {self._address}; start: dask worker {self._address}")
        return workers

    def _connected(self) -> Any:
        from distributed import Client

        with self._lock:
            if self._trouble is None and self._client is None:
                try:
                    self._client = Client(
                        self._address, timeout=CONNECT_SECONDS, security=self._security(), set_as_default=False
                    )
                except (OSError, TimeoutError, ValueError) as error:
                    self._trouble = f"no Dask scheduler at {self._address} ({error}); start it: dask scheduler"
            if self._client is None:
                raise BrokenProcessPool(self._trouble)
            return self._client

    def _security(self) -> Any:
        if not self._address.startswith("tls://") or self._identity is None:
            return None
        from distributed import Security

        from plant.identity_files import AUTHORITY, CERTIFICATE, KEY

        return Security(
            tls_ca_file=str(self._identity / AUTHORITY),
            tls_client_cert=str(self._identity / CERTIFICATE),
            tls_client_key=str(self._identity / KEY),
            require_encryption=True,
        )

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Leave the cluster; it goes on for others. What was not finished is given up by Dask when we are gone."""
        del cancel_futures
        with self._lock:
            client, self._client, self._trouble = self._client, None, "shut down (after shutdown)"
        if client is not None:
            client.close(timeout=CONNECT_SECONDS if wait else 1.0)


def _settle(done: Any, answer: Future[Any]) -> None:
    """Hand the outcome of Dask's future on; a lost scheduler breaks the pool, a job that kills workers only itself."""
    try:
        if done.status == "finished":
            answer.set_result(done.result(timeout=CONNECT_SECONDS))
            return
        error = done.exception(timeout=CONNECT_SECONDS) if done.status == "error" else None
    except Exception as lost:  # the scheduler went while we asked
        answer.set_exception(BrokenProcessPool(f"{type(lost).__name__}: {lost}"))
        return
    if error is None:
        answer.set_exception(BrokenProcessPool(f"the cluster gave the job up ({done.status})"))
    elif type(error).__name__ == "KilledWorker":
        answer.set_exception(RuntimeError(f"it killed {DEATHS} cluster workers"))
    else:
        answer.set_exception(error)
