"""Telling systemd how we are: ready, stopping, a line of status, and the watchdog's beat. Opens a datagram socket.

Without `NOTIFY_SOCKET` in the environment (no systemd, or another `Type=`) every call does nothing.
"""

from __future__ import annotations

import contextlib
import os
import socket
from collections.abc import Mapping


class Notifier:
    """One line per datagram, `man sd_notify`; what cannot be sent is not worth an error."""

    def __init__(self, environment: Mapping[str, str] = os.environ) -> None:
        """Read where to send to, and how often the watchdog wants to hear from us."""
        address = environment.get("NOTIFY_SOCKET", "")
        self._address = "\0" + address[1:] if address.startswith("@") else address
        micros = environment.get("WATCHDOG_USEC", "")
        ours = environment.get("WATCHDOG_PID", str(os.getpid())) == str(os.getpid())
        self.watchdog_seconds = int(micros) / 1e6 if micros.isdigit() and ours and self._address else None

    def tell(self, **states: str | int) -> None:
        """Send `KEY=value` lines: `READY=1`, `STATUS=...`, `WATCHDOG=1`, `STOPPING=1`."""
        if not self._address:
            return
        lines = "\n".join(f"{name}={value}" for name, value in states.items())
        with contextlib.suppress(OSError), socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as out:
            out.sendto(lines.encode(), self._address)
