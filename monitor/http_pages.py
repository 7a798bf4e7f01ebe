"""The pages for browsers: the shell of each view with its first numbers, the files, the door for tokens. Starlette."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any
from urllib.parse import parse_qs

from starlette.requests import Request
from starlette.responses import RedirectResponse, Response
from starlette.routing import Route

from monitor.http_guard import CACHED, COOKIE, say
from monitor.page import assets, shell
from monitor.tokens import LOCAL, Visitor
from plant.errors import InputError, ReachError

REMEMBERED = 30 * 86400  # s a browser keeps the token
Handler = Callable[[Request], Awaitable[Response]]
Ask = Callable[[str, dict[str, str], dict[str, str]], Awaitable[dict[str, Any]]]
# view -> (title, the answers it starts with)
PAGES: dict[str, tuple[str, str, tuple[str, ...]]] = {
    "/": ("fleet", "Fleet", ("/fleet",)),
    "/alerts": ("alerts", "Alerts", ("/alerts",)),
    "/system": ("system", "System", ("/status",)),
    "/axes/{axis}": ("axis", "{axis}", ("/axes/{axis}",)),
    "/diagnoses/{axis}": ("diagnoses", "Diagnoses of {axis}", ("/axes/{axis}/diagnoses",)),
    "/diagnoses/{axis}/{number}": ("diagnosis", "Diagnosis of {axis}", ("/axes/{axis}/diagnoses/{number}",)),
    "/alerts/{axis}/{kind}": ("alert", "{kind} of {axis}", ("/axes/{axis}/alerts",)),
}


class Pages:
    """Everything that is not the API."""

    def __init__(
        self, site: str, tokens: bool, secure: bool, ask: Ask, holder: Callable[[str, str], Visitor | None]
    ) -> None:
        """Draw for `site`.

        Args:
            site: of the daemon.
            tokens: whether one must show a token.
            secure: whether the line is encrypted.
            ask: gives an answer of the API.
            holder: whose token this is, shown by which client.
        """
        self._site, self._tokens, self._secure, self._ask, self._holder = site, tokens, secure, ask, holder

    def routes(self) -> list[Route]:
        """Addresses of all of it."""
        return [
            Route("/static/{folder}/{name}", self._static),
            Route("/favicon.ico", self._favicon),
            Route("/login", self._login, methods=["GET", "POST"]),
            Route("/logout", self._logout),
            *(Route(path, self._page(*spec)) for path, spec in PAGES.items()),
        ]

    def _page(self, view: str, title: str, first: tuple[str, ...]) -> Handler:
        async def handler(request: Request) -> Response:
            parts = dict(request.path_params)
            data: dict[str, Any] = {}
            for path in first:
                try:
                    data[path.format(**parts)] = await self._ask(path, parts, {})
                except (InputError, ReachError) as error:  # the view says it, with what to do
                    data[path.format(**parts)] = {"error": str(error)}
            visitor: Visitor = request.scope["visitor"] or LOCAL
            text = shell.shell(
                view,
                title.format(**parts),
                self._site,
                data,
                operate=visitor.may_operate,
                who=visitor.name,
                tokens=self._tokens,
            )
            return Response(text, media_type="text/html")

        return handler

    async def _static(self, request: Request) -> Response:
        folder, name = request.path_params["folder"], request.path_params["name"]
        found = await asyncio.to_thread(assets.asset, folder, name)
        if found is None:
            return await self.missing(request, None)
        headers = {"cache-control": CACHED, "vary": "accept-encoding"}
        if "gzip" in request.headers.get("accept-encoding", ""):
            return Response(found.packed, media_type=found.kind, headers={**headers, "content-encoding": "gzip"})
        return Response(found.plain, media_type=found.kind, headers=headers)

    async def _favicon(self, _request: Request) -> Response:
        return RedirectResponse(assets.address("icon.svg"), 308)

    async def _login(self, request: Request) -> Response:
        if not self._tokens:
            return RedirectResponse("/", 303)
        if request.method == "GET":
            return self._form(request.query_params.get("next", "/"), "", 200)
        fields = parse_qs((await request.body()).decode("utf-8", "replace"), max_num_fields=5)
        token, following = fields.get("token", [""])[0].strip(), _own_path(fields.get("next", ["/"])[0])
        client = request.client.host if request.client else "unknown"
        if self._holder(token, client) is None:
            return self._form(following, "This token is not known here. After ten wrong ones, wait a minute.", 401)
        response = RedirectResponse(following, 303)
        response.set_cookie(
            COOKIE, token, max_age=REMEMBERED, httponly=True, samesite="strict", secure=self._secure, path="/"
        )
        return response

    def _form(self, following: str, problem: str, code: int) -> Response:
        text = shell.login_page(self._site, _own_path(following), problem)
        return Response(text, code, media_type="text/html")

    async def _logout(self, _request: Request) -> Response:
        response = RedirectResponse("/login", 303)
        response.delete_cookie(COOKIE, path="/")
        return response

    async def missing(self, request: Request, _error: Exception | None) -> Response:
        """Nothing is there: a line for programs, a page for people."""
        code = 405 if getattr(_error, "status_code", 404) == 405 else 404
        if request.url.path.startswith("/api/") or "text/html" not in request.headers.get("accept", ""):
            return say(code, f"nothing is at {request.method} {request.url.path}; docs/http-api.md lists what there is")
        text = shell.shell("missing", "Not here", self._site, {}, operate=False, who="", tokens=False)
        return Response(text, code, media_type="text/html")


def _own_path(following: str) -> str:
    """A path of this page, whatever a link says."""
    own = following.startswith("/") and not following.startswith(("//", "/\\")) and following.isprintable()
    return following if own else "/"
