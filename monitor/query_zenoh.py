"""The history by Zenoh query: `.../history/parameters?from=;to=;since=;parameter=;points=` and `.../history/alerts`."""

from __future__ import annotations

import json
import threading
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import structlog
import zenoh

from monitor import questions
from monitor.errors import QueryError
from monitor.queries import Reader
from monitor.questions import SCHEMA_VERSION
from plant import keys
from plant.errors import TribowatchError

log = structlog.get_logger()
THREADS = 2
WAITING = 32  # queries; more are refused, so that nobody can pile them up
ANSWERS = {
    "parameters": questions.parameters,
    "alerts": questions.alerts,
    "events": questions.events,
    "versions": questions.versions,
    "kpi": questions.figures,
}


class HistoryServer:
    """Answers queries in its own threads, with a reader each; an error is an answer too (`reply_err`)."""

    def __init__(self, session: zenoh.Session, site: str, prefix: str, url: str) -> None:
        """Declare both queryables for every axis of `site`."""
        self._url, self._prefix = url, prefix
        self._pool = ThreadPoolExecutor(THREADS, thread_name_prefix="history")
        self._waiting = threading.Semaphore(WAITING)
        self._local = threading.local()
        self._readers: list[Reader] = []
        patterns = [f"{prefix}/{site}/*/history/{what}" for what in keys.HISTORIES]
        self._queryables = [session.declare_queryable(pattern, self._receive) for pattern in patterns]

    def _receive(self, query: zenoh.Query) -> None:
        """Zenoh calls this in series: hand on, come back."""
        try:
            if not self._waiting.acquire(blocking=False):
                _refuse(query, "busy: too many queries at once; ask again")
                return
            self._pool.submit(self._answer, query)
        except Exception as error:
            log.error("cannot take a query", error=f"{type(error).__name__}: {error}")

    def _answer(self, query: zenoh.Query) -> None:
        try:
            content = answer(self._reader(), str(query.key_expr), _asked(query), self._prefix)
            key = query.key_expr
            query.reply(key, json.dumps(content, allow_nan=False), encoding=zenoh.Encoding.APPLICATION_JSON)
        except TribowatchError as error:
            _refuse(query, str(error))
        except Exception as error:
            log.error("query failed", key=str(query.key_expr), error=f"{type(error).__name__}: {error}")
            _refuse(query, "this query failed; the daemon's log says why")
        finally:
            query.drop()  # type: ignore[no-untyped-call]
            self._waiting.release()

    def _reader(self) -> Reader:
        reader: Reader | None = getattr(self._local, "reader", None)
        if reader is None:
            reader = self._local.reader = Reader(self._url)
            self._readers.append(reader)
        return reader

    def close(self) -> None:
        """Take back the queryables, finish what runs."""
        for queryable in self._queryables:
            queryable.undeclare()  # type: ignore[no-untyped-call]
        self._pool.shutdown(wait=True, cancel_futures=True)
        for reader in self._readers:
            reader.close()


def answer(reader: Reader, key: str, asked: dict[str, str], prefix: str) -> dict[str, Any]:
    """Answer one query.

    Args:
        reader: of the history.
        key: `<prefix>/<site>/<axis>/history/<what>`, without wildcards.
        asked: the selector's parameters.
        prefix: of all keys.

    Raises:
        QueryError: a wildcard, an unknown parameter, a value that is not understood, an unknown axis.
    """
    if "*" in key:
        raise QueryError("ask for one axis by name: wildcards are not answered")
    axis, what = key.removeprefix(f"{prefix}/").split("/")[1], key.rsplit("/", 1)[1]
    return ANSWERS[what](reader, axis, asked)


def _asked(query: zenoh.Query) -> dict[str, str]:
    pairs: Any = query.parameters  # iterates over (name, value), which its stub does not say
    return {str(name): str(value) for name, value in pairs}


def _refuse(query: zenoh.Query, message: str) -> None:
    body = json.dumps({"schema_version": SCHEMA_VERSION, "error": message})
    query.reply_err(body, encoding=zenoh.Encoding.APPLICATION_JSON)
