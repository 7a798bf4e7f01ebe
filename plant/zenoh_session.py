"""Opening a Zenoh session: no scouting, only the endpoints that are named, and a clear word when nobody answers."""

from __future__ import annotations

import json
import re
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import zenoh

from plant.errors import ParameterError, ReachError
from plant.identity_files import VARIABLE, identity_from_environment, link_settings

Mode = Literal["client", "peer", "router"]
_ENDPOINT = r"(tcp|tls|udp|quic|ws|unixsock-stream|serial|vsock)/\S+"
_RETRY = {"period_init_ms": 200, "period_max_ms": 2000, "period_increase_factor": 1.5}


def session_config(
    mode: Mode,
    listen: Sequence[str] = (),
    connect: Sequence[str] = (),
    *,
    open_timeout: float = 5.0,
    identity: Path | None = None,
    extra: Sequence[tuple[str, object]] = (),
) -> zenoh.Config:
    """Make a configuration without multicast, gossip and shared memory.

    Args:
        mode: "peer" for the one that listens (the daemon), "client" for every leaf: two peers on one hub do not hear
            each other.
        listen: endpoints, `tcp/127.0.0.1:7447`; none means none, never all interfaces.
        connect: endpoints of the daemon.
        open_timeout: longest wait for a handshake. [s]
        identity: folder with our certificate, for `tls/` endpoints; default is what `TRIBOWATCH_IDENTITY` names.
        extra: further Zenoh keys and values (access control), as `insert_json5` takes them.

    Raises:
        ParameterError: an endpoint or a key of `extra` that Zenoh does not know, or a `tls/` endpoint without identity.
    """
    for endpoint in (*listen, *connect):
        if not re.fullmatch(_ENDPOINT, endpoint):
            raise ParameterError("endpoint", repr(endpoint), "<protocol>/<address>, like tcp/127.0.0.1:7447")
    secured = [endpoint for endpoint in (*listen, *connect) if endpoint.startswith("tls/")]
    identity = identity or identity_from_environment()
    if secured and identity is None:
        raise ParameterError("endpoint", repr(secured[0]), f"with an identity: set {VARIABLE} to its folder")
    config = zenoh.Config()
    settings: list[tuple[str, object]] = [
        ("mode", mode),
        ("scouting/multicast/enabled", False),
        ("scouting/gossip/enabled", False),
        ("listen/endpoints", list(listen)),
        ("connect/endpoints", list(connect)),
        ("connect/retry", _RETRY),
        ("timestamping/enabled", True),
        ("transport/unicast/open_timeout", max(1, round(open_timeout * 1000))),
        ("transport/link/tx/lease", 5000),
        ("transport/link/rx/max_message_size", 4 << 20),
        ("transport/shared_memory/enabled", False),
        *(link_settings(identity) if secured and identity else ()),
        *extra,
    ]
    for key, value in settings:
        try:
            config.insert_json5(key, json.dumps(value))
        except zenoh.ZError as error:
            raise ParameterError(f"zenoh setting {key}", json.dumps(value), f"known to Zenoh ({error})") from None
    return config


def open_session(
    mode: Mode,
    listen: Sequence[str] = (),
    connect: Sequence[str] = (),
    *,
    timeout: float = 5.0,
    identity: Path | None = None,
    extra: Sequence[tuple[str, object]] = (),
) -> zenoh.Session:
    """Open a session; use it as a context manager, an unclosed one can hang the interpreter at exit.

    A client tries again until `timeout`: Zenoh itself gives up at once, or waits for ever. Once open it reconnects.

    Args:
        mode: see `session_config`, as are `listen`, `connect`, `identity` and `extra`.
        listen: endpoints to listen on.
        connect: endpoints to connect to.
        timeout: how long a client keeps trying. [s]
        identity: folder with our certificate.
        extra: further Zenoh settings.

    Raises:
        ReachError: nobody answers at `connect`, or `listen` cannot be had; says which and what to do.
        ParameterError: an endpoint or setting that Zenoh does not know.
    """
    config = session_config(mode, listen, connect, open_timeout=timeout, identity=identity, extra=extra)
    deadline = time.monotonic() + timeout
    pause = 0.05
    while True:
        try:
            return zenoh.open(config)
        except zenoh.ZError as error:
            if mode != "client" or time.monotonic() + pause > deadline:
                raise _unreached(mode, listen, connect, str(error)) from None
        time.sleep(pause)
        pause = min(2 * pause, 0.5)


def _unreached(mode: Mode, listen: Sequence[str], connect: Sequence[str], said: str) -> ReachError:
    if mode == "client" and any(endpoint.startswith("tls/") for endpoint in connect):
        return ReachError(
            f"no link to {', '.join(connect)}: nobody listens there, or the certificates are not of one authority, not "
            "for this address, or expired (openssl x509 -noout -dates -ext subjectAltName -in certificate.pem)"
        )
    if mode == "client":
        return ReachError(f"no daemon at {', '.join(connect)}: start it with 'tribowatch run --config FILE'")
    if "in use" in said.lower():
        return ReachError(
            f"cannot listen on {', '.join(listen)}: the port is in use; stop the other program or choose another port"
        )
    reason = re.sub(r" at \S+\.rs:\d+\.?", "", said.splitlines()[0])[:200]
    return ReachError(f"cannot open a Zenoh session (listen {', '.join(listen) or 'none'}): {reason}")
