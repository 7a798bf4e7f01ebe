"""How the daemon is doing, in numbers: lag, gaps, workers, database, disk. Looks at files and the clock."""

from __future__ import annotations

import contextlib
import platform
import shutil
import time
from importlib.metadata import version
from pathlib import Path
from typing import Any

from sqlalchemy.engine import make_url

from monitor.board import Board
from monitor.config import Config
from monitor.questions import SCHEMA_VERSION
from monitor.times import iso

SILENT = 60.0  # s after which a stream counts as silent on this page; staleness has its own setting


def status(config: Config, board: Board, viewers: int, fleet: dict[str, Any]) -> dict[str, Any]:
    """The system view's numbers.

    Args:
        config: of the daemon.
        board: what it last said.
        viewers: open pages.
        fleet: answer of `/fleet`.
    """
    beat, statuses = board.beat, board.statuses()
    verdicts, durations = board.answers()
    answered = sum(verdicts.values())
    axes = fleet["axes"]
    return {
        "schema_version": SCHEMA_VERSION,
        "site": config.site,
        "version": version("tribowatch"),
        "python": platform.python_version(),
        "time": iso(time.time_ns()),
        "uptime_seconds": round(board.uptime, 1),
        "silence_seconds": round(board.silence, 3),
        "inbox_blocks": beat.inbox,
        "inbox_limit": config.intake.queue_blocks,
        "backlog_windows": beat.backlog,
        "workers": {"processes": config.workers, "windows_in_work": beat.busy},
        "answers": verdicts,
        "identification_seconds_mean": durations.total / answered if answered else None,
        "viewers": viewers,
        "axes": {
            "listed": sum(one["listed"] for one in axes),
            "unlisted": sum(not one["listed"] for one in axes),
            "streaming": sum(_silent(one) is not None and _silent(one) < SILENT for one in statuses.values()),
            "learning": sum(one["listed"] and not one["baseline"]["complete"] for one in axes),
        },
        "samples": sum(one["samples"] for one in axes),
        "missing": sum(one["missing"] for one in axes),
        "gaps": sum(one["gaps"] for one in axes),
        "rejected": sum(one["rejected"] for one in axes),
        "streams": [_stream(name, one) for name, one in sorted(statuses.items())],
        "database": database(config),
        "disk": disk(config.state_dir),
        "alarms": {
            "false_alarms_per_axis_year": config.alarms.false_alarms_per_axis_year,
            "standing": sum(len(one["alarms"]) for one in axes),
        },
    }


def _silent(one: dict[str, Any]) -> Any:
    return one.get("silent_seconds")


def _stream(axis: str, said: dict[str, Any]) -> dict[str, Any]:
    """One line of the table of streams."""
    return {
        "axis": axis,
        "state": said["state"],
        "silent_seconds": said["silent_seconds"],
        "samples": said["samples"],
        "missing": said["missing"],
        "rejected": said["rejected"],
        "held_blocks": said["held_blocks"],
        "pending_windows": said["pending_windows"],
        "last_sample": said["last_sample"],
        "committed": said["committed"],
    }


def database(config: Config) -> dict[str, Any]:
    """Which database, and how big it is where it is a file. [B]"""
    url = make_url(config.database_url)
    kind = url.get_backend_name()
    if kind != "sqlite" or not url.database:
        return {"kind": kind, "where": url.render_as_string(hide_password=True), "bytes": None}
    size = 0
    for suffix in ("", "-wal"):
        with contextlib.suppress(OSError):
            size += Path(url.database + suffix).stat().st_size
    return {"kind": kind, "where": Path(url.database).name, "bytes": size}


def disk(folder: Path) -> dict[str, int] | None:
    """Room where the state is kept. [B]"""
    try:
        found = shutil.disk_usage(folder)
    except OSError:
        return None
    return {"total": found.total, "free": found.free}
