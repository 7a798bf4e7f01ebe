"""Alerts to receivers outside by HTTP POST: what the outbox holds is sent in order until it is taken.

The outbox is written with the transitions, in one transaction: nothing is forgotten over a crash, something may be sent
twice. Requests run in threads of their own; the database is touched by the supervising thread alone, in `pump`.
"""

from __future__ import annotations

import json
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Collection
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import structlog

from monitor.alertmanager import SHOWN, message_of
from monitor.axis_run import AxisRun
from monitor.config_sections import WebhookSection
from monitor.store import Store
from monitor.store_records import Letter

log = structlog.get_logger()
LOOK_SECONDS = 1.0  # between two looks into the outbox
AGAIN = (408, 425, 429)  # "no" of a receiver that may say yes later; every other 4xx is final


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of a request: an empty `error` means it was taken; `final` that trying again is no use."""

    error: str = ""
    final: bool = False


class Postman:
    """Belongs to the supervising thread."""

    def __init__(
        self,
        settings: WebhookSection,
        store: Store,
        *,
        wake: Callable[[], None] = lambda: None,
        clock: Callable[[], float] = time.monotonic,
        wall: Callable[[], int] = time.time_ns,
    ) -> None:
        """Deliver the letters of `store`; `wake` is called from another thread when a request ends."""
        self._settings, self._store, self._wake, self._clock, self._wall = settings, store, wake, clock, wall
        self._pool = ThreadPoolExecutor(max(1, len(settings.urls)), thread_name_prefix="webhook")
        self._sent: dict[str, tuple[Letter | None, Future[Outcome]]] = {}
        self._looked = -LOOK_SECONDS
        self._repeated = dict.fromkeys(settings.urls, clock())

    def pump(self, runs: Collection[AxisRun]) -> None:
        """Note what was delivered, send what is due of `runs`, repeat what stands; never waits."""
        done = [url for url, (_, answer) in self._sent.items() if answer.done()]
        for url in done:
            self._note(*self._sent.pop(url))
        now = self._clock()
        if not self._settings.urls or (now - self._looked < LOOK_SECONDS and not done):
            return
        self._looked = now
        for url in self._settings.urls:
            if url not in self._sent:
                self._send_next(url, now, runs)

    def _send_next(self, url: str, now: float, runs: Collection[AxisRun]) -> None:
        letter = self._store.next_letter(url, [run.record.id for run in runs])
        wall_ns = self._wall()
        if letter is not None:
            wait_ns = letter.next_ns - wall_ns
            if wait_ns <= 0 or wait_ns > self._settings.longest_retry * 1e9:  # the clock stepped back
                self._submit(url, letter, [_message(letter, wall_ns)])
        elif now - self._repeated[url] >= self._settings.repeat:
            self._repeated[url] = now
            if standing := _standing(runs, wall_ns):
                self._submit(url, None, standing)

    def _submit(self, url: str, letter: Letter | None, messages: list[dict[str, Any]]) -> None:
        body = json.dumps(messages, allow_nan=False).encode()
        answer = self._pool.submit(post, url, body, self._settings.timeout, self._settings.token_file)
        answer.add_done_callback(lambda _: self._wake())
        self._sent[url] = letter, answer

    def _note(self, letter: Letter | None, answer: Future[Outcome]) -> None:
        outcome = answer.result()
        if letter is None:
            if outcome.error:
                log.warning("standing alerts could not be repeated", why=outcome.error)
        elif not outcome.error or outcome.final:
            if outcome.error:
                log.error("a receiver refuses an alert for good", receiver=letter.receiver, why=outcome.error)
            self._store.letter_delivered(letter.id, self._wall(), outcome.error)
        else:
            pause = min(self._settings.first_retry * 2.0 ** min(letter.tries, 30), self._settings.longest_retry)
            log.warning("a receiver was not told", receiver=letter.receiver, why=outcome.error, next_try_seconds=pause)
            self._store.letter_failed(letter.id, self._wall() + round(pause * 1e9), outcome.error)

    def close(self) -> None:
        """Send nothing more; what was not taken is sent after the next start."""
        self._pool.shutdown(wait=False, cancel_futures=True)


def post(url: str, body: bytes, timeout: float, token_file: str = "") -> Outcome:
    """POST JSON once; `timeout` [s]. Never raises."""
    try:
        headers = {"Content-Type": "application/json", "User-Agent": "tribowatch"}
        if token_file:
            headers["Authorization"] = f"Bearer {Path(token_file).read_text(encoding='utf-8').strip()}"
        request = urllib.request.Request(url, body, headers, method="POST")
        with urllib.request.urlopen(request, timeout=timeout):
            return Outcome()
    except urllib.error.HTTPError as error:
        with error:
            final = 400 <= error.code < 500 and error.code not in AGAIN
            return Outcome(f"HTTP {error.code} {error.reason}", final)
    except (OSError, ValueError) as error:
        return Outcome(f"{type(error).__name__}: {getattr(error, 'reason', error)}")


def _message(letter: Letter, now_ns: int) -> dict[str, Any]:
    row = letter.transition
    return message_of({**row["alert"], "axis": letter.axis}, row["after"], row["at_ns"], row["author"], now_ns)


def _standing(runs: Collection[AxisRun], now_ns: int) -> list[dict[str, Any]]:
    return [
        message_of(one.alert, one.alarm.state, one.alarm.since_ns, "", now_ns)
        for run in runs
        for one in run.alarms.values()
        if one.alert and one.alarm.state in SHOWN
    ]
