"""The page's own thread in the daemon: uvicorn on a socket bound before, so that a used port is one clear line."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
import ssl
import threading
from pathlib import Path
from typing import Any

import structlog
import uvicorn
from uvicorn.protocols.http.h11_impl import H11Protocol

from monitor.board import Board
from monitor.commands import CommandBox
from monitor.config import Config
from monitor.errors import ConfigError
from monitor.http_address import Address, address_of, bind
from monitor.http_app import Page
from monitor.http_events import Hub
from monitor.http_guard import tell_refused
from monitor.http_readers import Readers
from monitor.token_files import TokenFile

log = structlog.get_logger()
HEAD_SECONDS = 10.0  # s a client may take to say what it wants
IDLE_SECONDS = 30  # s a connection is kept open for the next request
CONNECTIONS = 400  # at once; beyond it 503
LONGEST_HEAD = 16_384  # bytes of request line and headers
CLOSE_SECONDS = 2.0  # s to end open streams
OWN_NAMES = ("localhost", "127.0.0.1", "[::1]")  # of this computer: a page of another name must not reach it


class PageServer:
    """Serves the page until closed. Made before the daemon takes samples, so that its troubles are told at once.

    Raises:
        ConfigError: the address, the certificate or the tokens cannot be used.
        PageError: port in use.
    """

    def __init__(self, config: Config, address: Address, board: Board, commands: CommandBox) -> None:
        """Bind and start to serve."""
        page = config.page
        tokens = TokenFile(Path(page.token_file)) if page.token_file else None
        secure = _check_certificate(page.certificate, page.private_key)
        self._socket, self.address = bind(address)
        self._hub = Hub(page.viewers)
        self._readers = Readers(config.database_url)
        self._page = Page(config, board, self._hub, self._readers, commands, tokens, secure)
        hosts = None if tokens is not None and not page.hosts else (*OWN_NAMES, *map(str.lower, page.hosts))
        self._server = _Server(
            uvicorn.Config(
                self._page.application(hosts),
                http=_Patient,
                ws="none",
                lifespan="off",
                log_config=None,
                access_log=False,
                server_header=False,
                proxy_headers=False,
                timeout_keep_alive=IDLE_SECONDS,
                timeout_graceful_shutdown=1,
                limit_concurrency=CONNECTIONS,
                h11_max_incomplete_event_size=LONGEST_HEAD,
                ssl_certfile=page.certificate or None,
                ssl_keyfile=page.private_key or None,
            ),
            self._hub,
        )
        logging.getLogger("uvicorn.error").setLevel(logging.CRITICAL)  # our own log says what matters
        if tokens is not None and not secure and not address.loopback:
            log.warning("the page's tokens travel unencrypted; set [page] certificate, or put a TLS proxy before it")
        self._thread = threading.Thread(target=self._serve, name="page", daemon=True)
        self._thread.start()
        self.url = self.address.url(secure=secure)

    def _serve(self) -> None:
        try:
            self._server.run(sockets=[self._socket])
        except Exception:
            log.exception("the page has ended; the watch goes on without it")

    def hear(self, what: str, axis: str, content: dict[str, Any]) -> None:
        """Tell open pages what is published; never waits."""
        self._hub.hear(what, axis, content)

    def close(self) -> None:
        """End open streams, stop listening."""
        self._server.should_exit = True
        self._thread.join(CLOSE_SECONDS)
        with contextlib.suppress(OSError):
            self._socket.close()
        self._readers.close()


def serve_page(config: Config, board: Board, commands: CommandBox) -> PageServer | None:
    """The page where the configuration wants one.

    Raises:
        ConfigError: it cannot be served as configured.
        PageError: it cannot listen.
    """
    address = address_of(config.page)
    return None if address is None else PageServer(config, address, board, commands)


class _Server(uvicorn.Server):
    """Ends the open streams when it is told to stop, instead of waiting for them."""

    def __init__(self, config: uvicorn.Config, hub: Hub) -> None:
        super().__init__(config)
        self._hub = hub

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        self._hub.start(asyncio.get_running_loop())
        await super().startup(sockets)

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        self._hub.close()
        await super().shutdown(sockets)


class _Patient(H11Protocol):
    """Hangs up on a client that does not say what it wants in time: at first, and at each further request."""

    _impatience: asyncio.TimerHandle | None = None

    def connection_made(self, transport: Any) -> None:
        super().connection_made(transport)
        self._impatience = self.loop.call_later(HEAD_SECONDS, self._hang_up)

    def data_received(self, data: bytes) -> None:
        if self._impatience is None and not self._answering:
            self._impatience = self.loop.call_later(HEAD_SECONDS, self._hang_up)
        super().data_received(data)
        if self._answering:
            self._calm()

    def connection_lost(self, exc: Exception | None) -> None:
        self._calm()
        super().connection_lost(exc)

    @property
    def _answering(self) -> bool:
        """Whether a whole head has come and its answer is under way."""
        cycle: Any = self.cycle  # None before the first request, which its stub does not say
        return cycle is not None and not cycle.response_complete

    def _hang_up(self) -> None:
        """Nothing whole has come: a slow client, or one that only holds the line (not one that waits between two)."""
        if self.conn.trailing_data[0]:
            tell_refused(self.client, "(no whole request)", 408)
        self.transport.close()

    def _calm(self) -> None:
        if self._impatience is not None:
            self._impatience.cancel()
            self._impatience = None


def _check_certificate(certificate: str, key: str) -> bool:
    """Whether the line is encrypted; complains about files that cannot be used."""
    if not certificate:
        return False
    try:
        ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(certificate, key)
    except (OSError, ssl.SSLError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise ConfigError(f"page.certificate = {certificate} with {key} cannot be used: {reason}") from None
    return True
