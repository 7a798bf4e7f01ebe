"""The command `tribowatch`: one file per command; heavy imports happen inside the commands."""

from __future__ import annotations

from monitor.cli.app import app, main

__all__ = ["app", "main"]
