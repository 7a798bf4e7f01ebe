"""Commands by Zenoh query: `<prefix>/<site>/<axis>/command?do=acknowledge;kind=wear;author=Ada`, or as JSON."""

from __future__ import annotations

import json
from typing import Any

import structlog
import zenoh

from monitor.commands import Answer, Command, CommandBox
from monitor.errors import QueryError
from monitor.questions import SCHEMA_VERSION
from plant import keys
from plant.errors import ReachError, TribowatchError

log = structlog.get_logger()
TIMEOUT = 30.0  # s a command may wait for the daemon's answer
LARGEST = 20_000  # bytes of a payload


class CommandServer:
    """Takes commands for every axis of a site; the answer, or the refusal as an error, is the query's reply."""

    def __init__(self, session: zenoh.Session, site: str, prefix: str, box: CommandBox) -> None:
        """Declare the queryable."""
        self._box, self._prefix = box, prefix
        self._queryable = session.declare_queryable(f"{prefix}/{site}/*/{keys.COMMAND}", self._receive)

    def _receive(self, query: zenoh.Query) -> None:
        """Zenoh calls this in series: hand in, come back; whoever executes the command replies."""
        try:
            command = read_command(str(query.key_expr), _asked(query), _payload(query), self._prefix)
        except TribowatchError as error:
            _refuse(query, str(error))
            return
        except Exception as error:
            log.error("cannot take a command", error=f"{type(error).__name__}: {error}")
            _refuse(query, "this command failed; the daemon's log says why")
            return
        self._box.submit(command).add_done_callback(lambda answer: _reply(query, answer))

    def close(self) -> None:
        """Take no more commands."""
        self._queryable.undeclare()  # type: ignore[no-untyped-call]


def read_command(key: str, asked: dict[str, str], payload: bytes, prefix: str) -> Command:
    """The command of a query: `do`, `author` and its arguments, from the selector and from a JSON payload.

    Raises:
        QueryError: a wildcard, no `do`, or a payload that is no JSON object.
    """
    if "*" in key:
        raise QueryError("command one axis by name: wildcards are not taken")
    given: dict[str, Any] = dict(asked)
    if payload:
        try:
            more = json.loads(payload) if len(payload) <= LARGEST else None
        except ValueError:
            more = None
        if not isinstance(more, dict):
            raise QueryError(f"the payload must be one JSON object of at most {LARGEST} bytes")
        given |= more
    action, author = given.pop("do", None), given.pop("author", "")
    if not isinstance(action, str) or not isinstance(author, str):
        raise QueryError("say what to do: do=acknowledge, shelve, ... and author=NAME")
    _, axis = keys.axis_of(key, prefix)
    return Command(action, axis, given, author)


def send_command(session: zenoh.Session, site: str, prefix: str, command: Command) -> dict[str, Any]:
    """Give `command` to the daemon of `site`; what it did.

    Raises:
        QueryError: the daemon refuses; says why.
        ReachError: no daemon answers.
    """
    key = keys.command_key(site, command.axis, prefix)
    body = json.dumps({**command.arguments, "do": command.action, "author": command.author})
    refusals = []
    everybody = zenoh.QueryTarget.ALL  # daemons that share a site: the one that watches the axis does it
    for reply in session.get(
        key, payload=body, encoding=zenoh.Encoding.APPLICATION_JSON, timeout=TIMEOUT, target=everybody
    ):
        if reply.ok is not None:
            done: dict[str, Any] = json.loads(reply.ok.payload.to_bytes())
            return done
        refusals.append(reply.err.payload.to_string() if reply.err is not None else "")
    if not refusals:
        raise ReachError(f"no daemon of site {site!r} takes commands here; is it running, and may you operate it?")
    if not refusals[0].startswith("{"):
        raise ReachError(f"the daemon of site {site!r} did not answer within {TIMEOUT:g} s ({refusals[0]})")
    raise QueryError(json.loads(refusals[0])["error"])


def _asked(query: zenoh.Query) -> dict[str, str]:
    pairs: Any = query.parameters  # iterates over (name, value), which its stub does not say
    return {str(name): str(value) for name, value in pairs}


def _payload(query: zenoh.Query) -> bytes:
    return query.payload.to_bytes() if query.payload is not None else b""


def _reply(query: zenoh.Query, answer: Answer) -> None:
    """Runs in the supervising thread: nothing that goes wrong with one asker may hurt it."""
    try:
        error = answer.exception()
        if error is not None:
            _refuse(query, str(error))
            return
        body = json.dumps(answer.result(), allow_nan=False)
        query.reply(query.key_expr, body, encoding=zenoh.Encoding.APPLICATION_JSON)
        query.drop()  # type: ignore[no-untyped-call]
    except Exception as error:
        log.warning("the answer to a command could not be sent", error=f"{type(error).__name__}: {error}")


def _refuse(query: zenoh.Query, message: str) -> None:
    query.reply_err(
        json.dumps({"schema_version": SCHEMA_VERSION, "error": message}), encoding=zenoh.Encoding.APPLICATION_JSON
    )
    query.drop()  # type: ignore[no-untyped-call]
