"""The tables of the daemon's configuration: every key with its type, default, range, unit and meaning."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

Seconds = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Count = Annotated[int, Field(ge=1)]
HttpUrl = Annotated[str, Field(pattern=r"^https?://[^\s/]+")]
AlertKind = Literal["wear", "lubrication", "jam", "model_mismatch", "operating_point", "data_quality", "stale"]


class Section(BaseModel):
    """A table of the configuration: unknown keys are errors, values are frozen."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class ZenohSection(Section):
    """Where streams come from and answers go to."""

    prefix: str = Field(default="tribowatch", description="first part of every key")
    mode: Literal["peer", "client", "router"] = Field(
        default="peer", description="the daemon listens; leaves are clients"
    )
    listen: tuple[str, ...] = Field(default=("tcp/127.0.0.1:7447",), description="endpoints opened here")
    connect: tuple[str, ...] = Field(default=(), description="endpoints of other hubs")


class WindowSection(Section):
    """How a stream is cut into windows, counted in analysis samples."""

    samples: int = Field(default=2000, ge=16, description="samples of one window, after averaging to the analysis rate")
    hop: int = Field(default=500, ge=1, description="samples from one window's start to the next")


class IntakeSection(Section):
    """How much the intake holds, and how long it waits."""

    queue_blocks: Count = Field(
        default=20000, description="blocks waiting for the core; beyond it they are dropped, counted"
    )
    queue_bytes: Count = Field(
        default=200_000_000, description="their payloads together; beyond it they are dropped [B]"
    )
    reorder_seconds: Seconds = Field(default=2.0, description="wait for late blocks before a gap is declared [s]")
    commit_seconds: Seconds = Field(default=0.2, description="longest time a received block waits for its commit [s]")
    stale_after: Seconds = Field(default=7200.0, description="silence on the wall clock that makes an axis stale [s]")


class IdentificationSection(Section):
    """How windows are identified."""

    workers: int = Field(default=0, ge=0, description="processes; 0 = one per processor; with cluster: its processes")
    cluster: str = Field(
        default="", description="Dask scheduler that runs them instead, like tcp://host:8786; empty = this machine"
    )
    method: str = Field(default="ga+polish", description="see tribowatch identify --method")
    retries: int = Field(default=2, ge=0, description="new attempts after a worker died, then the window is bad_data")
    max_lag_seconds: Seconds = Field(
        default=60.0, description="wait of a live axis' window for its answer beyond which every hop is stretched [s]"
    )
    timeout_seconds: Seconds = Field(
        default=300.0, description="a worker busy longer is taken as hung and replaced [s]"
    )


class DriftSection(Section):
    """What counts as a change; see monitor/drift.py."""

    baseline_windows: int = Field(
        default=20, ge=5, description="identified, non-overlapping windows that make the baseline"
    )
    baseline_span: float = Field(
        default=3 * 86400.0,
        ge=0,
        description="time over which those windows are spread at least: three daily cycles of shift and weather [s]",
    )
    min_change: float = Field(
        default=0.03, gt=0, lt=1, description="smallest relative change that is told, however sure it is [1]"
    )
    jam_rise: float = Field(default=0.2, gt=0, description="relative rise within one window that is called a jam [1]")
    limit_rise: float = Field(default=0.5, gt=0, description="rise at which a worn axis ends its life: projection [1]")


class DiagnosisSection(Section):
    """How what the model cannot explain is diagnosed; one axis at a time, after the windows."""

    timeout_seconds: Seconds = Field(default=1800.0, description="a diagnosis busy longer is given up [s]")


class AlarmsSection(Section):
    """How often a healthy axis may cry wolf, and how long conditions last before they count."""

    false_alarms_per_axis_year: float = Field(default=1.0, gt=0, description="all kinds of one axis together [1/a]")
    on_windows: Count = Field(default=1, description="windows a condition lasts before its alarm is raised")
    off_windows: Count = Field(
        default=3, description="windows a condition stays away before its alarm returns to normal"
    )
    on_of_windows: Count = Field(default=1, description="on_windows of the latest so many; less = in a row")
    off_of_windows: Count = Field(default=1, description="off_windows of the latest so many; less = in a row")
    on_delay: float = Field(default=0.0, ge=0, description="event time a condition lasts besides, before it counts [s]")
    off_delay: float = Field(default=0.0, ge=0, description="event time it stays away besides [s]")
    latch: tuple[AlertKind, ...] = Field(default=(), description="kinds that stay until they are acknowledged")
    longest_shelving: Seconds = Field(default=30 * 86400.0, description="longest time an alarm can be shelved [s]")
    bad_windows: Count = Field(default=3, description="bad_data windows in a row that raise data_quality")


class WebhookSection(Section):
    """Who else is told of alerts, by HTTP POST in the format of Prometheus' Alertmanager (v2)."""

    urls: tuple[HttpUrl, ...] = Field(default=(), description="like http://alertmanager:9093/api/v2/alerts")
    token_file: str = Field(default="", description="file with a bearer token; empty = none")
    timeout: Seconds = Field(default=10.0, description="for one request [s]")
    first_retry: Seconds = Field(default=5.0, description="after a failed try; doubled with every further one [s]")
    longest_retry: Seconds = Field(default=600.0, description="longest time between two tries [s]")
    repeat: Seconds = Field(default=300.0, description="time after which alerts that stand are sent again [s]")


class HistorySection(Section):
    """Where history is kept."""

    database: str = Field(default="", description="SQLAlchemy URL; empty = tribowatch.db in state_dir")
    synchronous: Literal["NORMAL", "FULL"] = Field(
        default="NORMAL", description="SQLite: FULL survives power loss, slower"
    )
    reserve_mb: float = Field(
        default=200.0, ge=0, description="SQLite: free disk below which answers are no longer kept, only watched [MB]"
    )
    keep_days: float = Field(default=0.0, ge=0, description="answers older than that become roll-ups; 0 = never [d]")
    keep_evidence_days: float = Field(default=0.0, ge=0, description="evidence older than that goes; 0 = never [d]")
    keep_raw_windows: int = Field(default=4, ge=0, description="newest windows per axis whose raw samples are kept")


class SharingSection(Section):
    """Several daemons watch the axes of one site and take over from each other; see docs/operations.md."""

    member: str = Field(default="", description="name of this daemon among them, on one database; empty = alone")


class SecuritySection(Section):
    """Who may connect: certificates of a private authority, and what each may do; see docs/security.md."""

    identity: str = Field(
        default="",
        description="folder with ca.pem, certificate.pem, key.pem of this daemon; empty = no TLS, loopback only",
    )
    publishers: dict[str, tuple[str, ...]] = Field(
        default={}, description='axes that a certificate\'s common name may publish: { "gateway-1" = ["*"] }'
    )
    viewers: tuple[str, ...] = Field(default=(), description="common names that may read answers, alerts and history")
    operators: tuple[str, ...] = Field(default=(), description="common names that may also acknowledge and shelve")
    recorders: tuple[str, ...] = Field(default=(), description="common names that may get raw samples, to record them")
    log_refused: bool = Field(
        default=True,
        description="log links and messages that are refused; false spares some 5 us per block",
    )


class LogSection(Section):
    """What is logged, on stderr."""

    level: Literal["debug", "info", "warning", "error"] = Field(default="info", description="the least that is said")
    format: Literal["console", "json"] = Field(default="console", description="for people, or json for programs")


class AxisSection(Section):
    """One [[axis]]: the file that describes it."""

    file: Path = Field(description="the axis file, relative to this one")
