"""Where the page listens: the address from the configuration, what it demands, and the socket. Opens a socket."""

from __future__ import annotations

import ipaddress
import socket
from dataclasses import dataclass

from monitor.config_page import PageSection
from monitor.errors import ConfigError, PageError

BACKLOG = 128  # connections that wait for `accept`


@dataclass(frozen=True, slots=True)
class Address:
    """Host and port; `loopback`: nobody but this computer can reach it."""

    host: str
    port: int

    @property
    def loopback(self) -> bool:
        """Whether only this computer can reach it."""
        try:
            return ipaddress.ip_address(self.host).is_loopback
        except ValueError:
            return self.host == "localhost"

    def url(self, *, secure: bool) -> str:
        """What one types into a browser on this computer."""
        own = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(self.host, self.host)
        shown = f"[{own}]" if ":" in own else own
        return f"http{'s' if secure else ''}://{shown}:{self.port}/"


def address_of(page: PageSection) -> Address | None:
    """Where to listen; None where no page is wanted.

    Raises:
        ConfigError: not HOST:PORT, or reachable by others without what protects it.
    """
    if not page.listen:
        return None
    host, _, port = page.listen.rpartition(":")
    if not host or not port.isdecimal() or int(port) > 65535:
        raise ConfigError(f"page.listen = {page.listen!r} must be HOST:PORT, as in 127.0.0.1:8447 or [::1]:8447")
    address = Address(host.strip("[]"), int(port))
    if bool(page.certificate) != bool(page.private_key):
        raise ConfigError("page.certificate and page.private_key belong together: give both, or none")
    if not page.token_file and page.hosts:
        raise ConfigError("page.hosts opens the page to others, who need a token: set page.token_file")
    if not page.token_file and not address.loopback:
        raise ConfigError(
            f"page.listen = {page.listen!r} can be reached by others, who need a token: set page.token_file "
            "(tribowatch token add makes one), or listen on 127.0.0.1"
        )
    return address


def bind(address: Address) -> tuple[socket.socket, Address]:
    """A listening socket, and the address with the port it got.

    Raises:
        PageError: port in use, no such address, or not allowed.
    """
    where = f"{address.host}:{address.port}"
    try:
        family, kind, protocol, _, place = socket.getaddrinfo(
            address.host, address.port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        listener = socket.socket(family, kind, protocol)
    except OSError as error:
        raise PageError(f"page.listen: {where} cannot be used ({error.strerror}); set page.listen") from None
    try:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind(place)
        listener.listen(BACKLOG)
        listener.set_inheritable(False)
    except OSError as error:
        listener.close()
        reason = (error.strerror or str(error)).lower()
        raise PageError(
            f"the page cannot listen on {where}: {reason}; set [page] listen to another port, 0 for any free one, "
            'or "" for no page'
        ) from None
    return listener, Address(address.host, int(listener.getsockname()[1]))
