"""Who we are on a secured hub: a folder with a certificate, its private key and the authority that signed it.

A folder holds `ca.pem`, `certificate.pem` and `key.pem`; `deploy/security/private-ca.sh` makes such folders. Leaves
(bridge, replay, simulator, subscribers) find theirs by the environment variable `TRIBOWATCH_IDENTITY`.
"""

from __future__ import annotations

import os
from pathlib import Path

from plant.errors import ParameterError

VARIABLE = "TRIBOWATCH_IDENTITY"
AUTHORITY, CERTIFICATE, KEY = "ca.pem", "certificate.pem", "key.pem"
READABLE_BY_OTHERS = 0o077


def identity_from_environment() -> Path | None:
    """The folder that `TRIBOWATCH_IDENTITY` names; None where it names none."""
    named = os.environ.get(VARIABLE, "")
    return Path(named) if named else None


def link_settings(folder: Path) -> list[tuple[str, object]]:
    """Zenoh settings for mutual TLS with the identity in `folder`: both ends show a certificate, or there is no link.

    Raises:
        ParameterError: a file is missing or cannot be read, or the private key is open to other users.
    """
    for name in (AUTHORITY, CERTIFICATE, KEY):
        path = folder / name
        if not os.access(path, os.R_OK) or not path.is_file():
            raise ParameterError(
                "identity", str(path), f"a readable file; a folder with {AUTHORITY}, {CERTIFICATE}, {KEY}"
            )
    mode = (folder / KEY).stat().st_mode & 0o777
    if mode & READABLE_BY_OTHERS:
        raise ParameterError(
            "private key", f"{folder / KEY} with mode {mode:o}", "readable by its owner alone: chmod 600"
        )
    certificate, key = str(folder / CERTIFICATE), str(folder / KEY)
    return [
        ("transport/link/tls/root_ca_certificate", str(folder / AUTHORITY)),
        ("transport/link/tls/enable_mtls", True),
        ("transport/link/tls/listen_certificate", certificate),
        ("transport/link/tls/listen_private_key", key),
        ("transport/link/tls/connect_certificate", certificate),
        ("transport/link/tls/connect_private_key", key),
        ("transport/link/tls/close_link_on_expiration", True),
    ]
