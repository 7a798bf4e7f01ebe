"""The application behind the door: routes of the API, the pages, the events, the metrics. Starlette."""

from __future__ import annotations

import asyncio
import json
from collections import Counter
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import structlog
from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.middleware.gzip import GZipMiddleware
from starlette.requests import Request
from starlette.responses import JSONResponse, Response, StreamingResponse
from starlette.routing import Route

from monitor import questions
from monitor.board import Board
from monitor.commands import Command, CommandBox
from monitor.config import Config
from monitor.errors import QueryError, UnknownError
from monitor.http_answers import ANSWERS, answer
from monitor.http_events import Hub, event
from monitor.http_guard import Guard, say
from monitor.http_metrics import CONTENT_TYPE, metrics_text
from monitor.http_pages import Pages
from monitor.http_readers import Readers
from monitor.http_status import status
from monitor.page import assets
from monitor.token_files import TokenFile
from monitor.tokens import LOCAL, Visitor
from plant.errors import InputError, ReachError

if TYPE_CHECKING:
    from monitor.query_page import PageReader

log = structlog.get_logger()

API = "/api/v1"
COMMAND_SECONDS = 20.0  # s a command may wait for the supervising thread
MISSED = 200  # changes of alarms sent again to a page that was away
REMEMBERED = 30 * 86400  # s a browser keeps the token
Handler = Callable[[Request], Awaitable[Response]]


@dataclass(slots=True)
class Page:
    """What the routes share."""

    config: Config
    board: Board
    hub: Hub
    readers: Readers
    commands: CommandBox
    tokens: TokenFile | None
    secure: bool
    guard: Guard | None = None
    answered: Counter[str] = field(default_factory=Counter)

    def application(self, hosts: tuple[str, ...] | None) -> Guard:
        """The whole application, behind its door. `hosts`: names it answers to, None = any."""
        routes = [Route(f"{API}{path}", self._answer(path)) for path in ANSWERS]
        routes += [
            Route(f"{API}/status", caught(self._status)),
            Route(f"{API}/events", caught(self._events)),
            Route(f"{API}/evidence/{{number}}", caught(self._evidence)),
            Route(f"{API}/axes/{{axis}}/commands/{{action}}", caught(self._command), methods=["POST"]),
            Route("/metrics", caught(self._metrics)),
            Route("/healthz", caught(self._health)),
        ]
        pages = Pages(self.config.site, self.tokens is not None, self.secure, self.ask, self._holder)
        inner = Starlette(
            routes=[*routes, *pages.routes()],
            middleware=[Middleware(GZipMiddleware, minimum_size=1000, compresslevel=5)],
            exception_handlers={404: pages.missing, 405: pages.missing},
        )
        self.guard = Guard(
            inner,
            tokens=self.tokens,
            hosts=hosts,
            secure=self.secure,
            per_minute=self.config.page.requests_per_minute,
            answered=self.answered,
        )
        return self.guard

    # --- API ------------------------------------------------------------------------------------------------

    def _answer(self, path: str) -> Handler:
        async def handler(request: Request) -> Response:
            return JSONResponse(await self.ask(path, dict(request.path_params), dict(request.query_params)))

        return caught(handler)

    def _holder(self, token: str, client: str) -> Visitor | None:
        """Whose token this is, for the login form."""
        return None if self.guard is None else self.guard.check(token, client)

    async def ask(self, path: str, parts: dict[str, str], asked: dict[str, str]) -> dict[str, Any]:
        """The answer of one address of the API."""

        def question(reader: PageReader) -> dict[str, Any]:
            return answer(path, reader, parts, asked)

        if path == "/status":
            return await self._state()
        if path == "/fleet" and not asked:
            return await self.readers.share(path, question)
        return await self.readers.ask(question)

    async def _state(self) -> dict[str, Any]:
        fleet = await self.readers.share("/fleet", lambda reader: answer("/fleet", reader, {}, {}))
        return await self.readers.ask(lambda _: status(self.config, self.board, self.hub.viewers, fleet))

    async def _status(self, _request: Request) -> Response:
        return JSONResponse(await self._state())

    async def _metrics(self, _request: Request) -> Response:
        fleet = await self.readers.share("/fleet", lambda reader: answer("/fleet", reader, {}, {}))
        state = await self._state()
        text = await self.readers.ask(lambda _: metrics_text(fleet, state, self.board, dict(self.answered)))
        return Response(text, media_type=CONTENT_TYPE)

    async def _health(self, _request: Request) -> Response:
        """For watchers of services: 200 while the supervising thread comes round and the history answers."""
        await self.readers.ask(lambda reader: reader.transitions(limit=1))
        silence = self.board.silence
        if silence > self.config.page.unhealthy_after:
            return say(503, f"the daemon's supervising thread has not come round for {silence:.0f} s; see its log")
        return JSONResponse({"schema_version": 1, "status": "ok"})

    async def _events(self, request: Request) -> Response:
        if self.hub.full:
            return say(503, f"{self.hub.viewers} pages are open already ([page] viewers)", {"retry-after": "30"})
        first = [b"retry: 2000\n\n"]
        last = request.headers.get("last-event-id", "")
        if last.isdecimal() and len(last) < 19:
            missed = await self.readers.ask(lambda reader: reader.transitions(after=int(last), limit=MISSED))
            first += [event("alert", one, one["number"]) for one in missed]
        first.append(event("hello", {"site": self.config.site, "assets": assets.version()}))
        return StreamingResponse(self.hub.stream(first), media_type="text/event-stream")

    async def _evidence(self, request: Request) -> Response:
        """A bundle as it was kept: a zip that says what it holds."""
        number = questions.whole(request.path_params, "number", 1)
        content = await self.readers.ask(lambda reader: reader.evidence(number))
        name = {"content-disposition": f'attachment; filename="evidence-{number}.zip"'}
        return Response(content, media_type="application/zip", headers=name)

    async def _command(self, request: Request) -> Response:
        visitor: Visitor = request.scope["visitor"] or LOCAL
        if not visitor.may_operate:
            return say(403, f"the token of {visitor.name} may look, not operate; ask for one with --role operate")
        if request.headers.get("content-type", "").partition(";")[0].strip() != "application/json":
            return say(415, "send the command's arguments as application/json")
        arguments = _json_object(await request.body())
        author = visitor.name or str(arguments.pop("author", "") or "somebody at this computer")
        arguments.pop("author", None)
        command = Command(request.path_params["action"], request.path_params["axis"], arguments, author)
        future = asyncio.wrap_future(self.commands.submit(command))
        try:
            done = await asyncio.wait_for(future, COMMAND_SECONDS)
        except TimeoutError:
            return say(503, f"the daemon did not take the command within {COMMAND_SECONDS:g} s; look before repeating")
        return JSONResponse({"schema_version": 1, **done})


def caught(handler: Handler) -> Handler:
    """Turn our errors into answers: 400 what is asked is not understood, 404 it is not there, 503 out of reach."""

    async def safe(request: Request) -> Response:
        try:
            return await handler(request)
        except UnknownError as error:
            return say(404, str(error))
        except (QueryError, InputError) as error:
            return say(400, str(error))
        except ReachError as error:
            return say(503, str(error))
        except Exception as error:
            log.exception("page: a request tripped an error of ours", path=request.url.path)
            return say(500, f"this failed ({type(error).__name__}); the daemon's log says why")

    return safe


def _json_object(body: bytes) -> dict[str, Any]:
    try:
        content = json.loads(body or b"{}")
    except (ValueError, RecursionError):
        raise QueryError("the request's body is not JSON") from None
    if not isinstance(content, dict):
        raise QueryError('the request\'s body must be a JSON object, as in {"kind": "wear"}')
    return content
