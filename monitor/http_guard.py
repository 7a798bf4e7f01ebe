"""The door of the page: who comes in, how often, with how much, and what every answer says to the browser. ASGI.

Nothing behind the door is reached by a stranger: no token, wrong host name, another site's page, too often, too big.
"""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections import Counter
from http import HTTPStatus
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import quote

import structlog
from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import JSONResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from monitor.http_limits import RateLimit
from monitor.token_files import TokenFile
from monitor.tokens import LOCAL, Visitor

log = structlog.get_logger()
COOKIE = "tribowatch"
OPEN = ("/login", "/healthz", "/static/", "/favicon.ico")  # need no token
UNCOUNTED = ("/static/",)  # of the rate limit: cached by the browser for good
BURST = 120  # requests one address may make at once: a page with its parts, a few times
FAILURES_PER_MINUTE = 10.0  # wrong tokens of one address; then it waits, whatever it shows
MOST_BODY = 65_536  # bytes of a request; a command has a few hundred
BODY_SECONDS = 10.0  # s a request may take to arrive
REFUSED = (401, 403, 408, 413, 421, 429)  # statuses that are logged
CACHED = "public, max-age=31536000, immutable"

# plotly sets style attributes, but needs neither eval nor style elements (see page/charts.js); nothing comes from afar
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; style-src-elem 'self'; style-src-attr 'unsafe-inline'; "
    "img-src 'self' data:; connect-src 'self'; font-src 'self'; manifest-src 'self'; base-uri 'none'; "
    "form-action 'self'; frame-ancestors 'none'"
)
HEADERS = {
    "content-security-policy": POLICY,
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "permissions-policy": "camera=(), geolocation=(), microphone=()",
}


class Guard:
    """Wraps the application; puts the `Visitor` into the request's scope as `visitor`."""

    def __init__(
        self,
        app: ASGIApp,
        *,
        tokens: TokenFile | None,
        hosts: tuple[str, ...] | None,
        secure: bool,
        per_minute: float,
        answered: Counter[str],
    ) -> None:
        """Stand before `app`.

        Args:
            app: what is guarded.
            tokens: who may come in; None = everybody who reaches us (this computer).
            hosts: names we answer to; None = any.
            secure: whether the line is encrypted.
            per_minute: requests of one address. [1/min]
            answered: counts answers by class of their status, for /metrics.
        """
        self._app, self._tokens, self._hosts, self._secure = app, tokens, hosts, secure
        self._limit = RateLimit(per_minute, max(BURST, per_minute / 5))
        self._failures = RateLimit(FAILURES_PER_MINUTE, FAILURES_PER_MINUTE)
        self._answered = answered

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request, or pass it on."""
        if scope["type"] != "http":
            return

        async def sealed(message: Message) -> None:
            if message["type"] == "http.response.start":
                self._seal(scope, message)
            await send(message)

        refused = self._refuse(scope)
        if refused is None:
            body = await _body(scope, receive)
            if isinstance(body, Response):
                refused = body
            else:
                receive = _replay(body, receive)
        await (refused or self._app)(scope, receive, sealed)

    def _seal(self, scope: Scope, message: Message) -> None:
        """Security headers on every answer; nothing but static parts is kept by caches."""
        headers = MutableHeaders(scope=message)
        for name, value in HEADERS.items():
            headers.setdefault(name, value)
        headers.setdefault("cache-control", "no-store")
        if self._secure:
            headers.setdefault("strict-transport-security", "max-age=31536000")
        self._answered[f"{message['status'] // 100}xx"] += 1
        if message["status"] in REFUSED or climbs(scope["path"]):
            tell_refused(scope["client"], scope["path"], message["status"])

    def _refuse(self, scope: Scope) -> Response | None:
        """What is wrong with this request, None = nothing."""
        headers, path, now = Headers(scope=scope), scope["path"], time.monotonic()
        client = scope["client"][0] if scope.get("client") else "unknown"
        if self._hosts is not None and _name(headers.get("host", "")) not in self._hosts:
            return say(421, "this page does not answer to that host name; add it to [page] hosts, which needs tokens")
        if not path.startswith(UNCOUNTED) and (wait := self._limit.wait(client, now)):
            return say(429, f"too many requests; wait {wait:.0f} s", {"retry-after": str(max(1, round(wait)))})
        if scope["method"] not in ("GET", "HEAD", "OPTIONS") and not _same_origin(headers):
            return say(403, "this request comes from another site's page")
        visitor = self._visitor(headers, client, now)
        if isinstance(visitor, Response):
            return visitor
        if visitor is None and not path.startswith(OPEN):
            return self._unknown(scope, headers)
        scope["visitor"] = visitor
        return None

    def _visitor(self, headers: Headers, client: str, now: float) -> Visitor | Response | None:
        """Who asks; None where no token is shown. A wrong one counts as a failure."""
        if self._tokens is None:
            return LOCAL
        if (shown := shown_token(headers)) is None:
            return None
        if self._failures.spent(client, now):
            return say(429, "too many wrong tokens; wait a minute", {"retry-after": "60"})
        if (visitor := self._tokens.holder(shown)) is None:
            self._failures.wait(client, now)
        return visitor

    def check(self, token: str, client: str) -> Visitor | None:
        """Whose token this is, for the login form; wrong ones count."""
        now = time.monotonic()
        if self._tokens is None or self._failures.spent(client, now):
            return None
        if (visitor := self._tokens.holder(token)) is None:
            self._failures.wait(client, now)
        return visitor

    @staticmethod
    def _unknown(scope: Scope, headers: Headers) -> Response:
        """No token, or a wrong one: people get the form, programs a line."""
        if "text/html" in headers.get("accept", "") and scope["method"] == "GET":
            asked = scope["path"] + (f"?{scope['query_string'].decode('latin-1')}" if scope["query_string"] else "")
            return RedirectResponse(f"/login?next={quote(asked, safe='')}", 303)
        return say(
            401, "a token is needed: Authorization: Bearer ...", {"www-authenticate": 'Bearer realm="tribowatch"'}
        )


def tell_refused(client: Any, path: str, status: int) -> None:
    """Log who was refused what; `client` is (address, port), where it is known."""
    log.warning("page: refused", client=client[0] if client else "unknown", path=path[:200], status=status)


def climbs(path: str) -> bool:
    """Whether a (decoded) path tries to leave its folder; nothing of ours is found by such a path."""
    return ".." in path.replace("\\", "/").split("/")


def say(status: int, error: str, headers: dict[str, str] | None = None) -> JSONResponse:
    """An error as every program gets it."""
    content = {"schema_version": 1, "error": error, "status": status, "reason": HTTPStatus(status).phrase}
    return JSONResponse(content, status, headers)


def shown_token(headers: Headers) -> str | None:
    """The token of a request: in its Authorization header, else in the page's cookie."""
    scheme, _, token = headers.get("authorization", "").partition(" ")
    if scheme.lower() == "bearer" and token.strip():
        return token.strip()
    cookies: SimpleCookie = SimpleCookie()
    with contextlib.suppress(CookieError):
        cookies.load(headers.get("cookie", ""))
    found = cookies.get(COOKIE)
    return found.value if found is not None and found.value else None


def _same_origin(headers: Headers) -> bool:
    """Whether a request that changes something comes from our own page, or from no page at all."""
    if headers.get("sec-fetch-site", "none") not in ("same-origin", "none"):
        return False
    origin = headers.get("origin")
    return origin is None or origin.partition("://")[2] == headers.get("host")


def _name(host: str) -> str:
    """A Host header without its port."""
    return (
        host[: host.index("]") + 1] if host.startswith("[") and "]" in host else host.rpartition(":")[0] or host
    ).lower()


async def _body(scope: Scope, receive: Receive) -> bytes | Response:
    """The whole request, or why it is not taken."""
    if scope["method"] in ("GET", "HEAD", "OPTIONS"):
        return b""
    parts: list[bytes] = []
    try:
        async with asyncio.timeout(BODY_SECONDS):
            while True:
                message = await receive()
                if message["type"] != "http.request":
                    return say(400, "the request ended before its body did")
                parts.append(message.get("body", b""))
                if sum(map(len, parts)) > MOST_BODY:
                    return say(413, f"the request is longer than {MOST_BODY} bytes")
                if not message.get("more_body"):
                    return b"".join(parts)
    except TimeoutError:
        return say(408, f"the request did not arrive within {BODY_SECONDS:g} s")


def _replay(body: bytes, receive: Receive) -> Receive:
    """Hand out the body once, then what follows (the end of the connection)."""
    pending = True

    async def replayed() -> Message:
        nonlocal pending
        if pending:
            pending = False
            return {"type": "http.request", "body": body, "more_body": False}
        return await receive()

    return replayed
