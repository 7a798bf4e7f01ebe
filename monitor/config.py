"""The daemon's configuration: one TOML file, overridable by environment variables, unknown keys are errors.

Relative paths are relative to the configuration file. The environment overrides the file:
`TRIBOWATCH_ZENOH__PREFIX=plant` sets `[zenoh] prefix`.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError
from pydantic_settings import BaseSettings, PydanticBaseSettingsSource, SettingsConfigDict

from monitor.config_page import PageSection
from monitor.errors import ConfigError
from monitor.sharing import token_of
from plant.axis import AXIS_NAME, Axis
from plant.checks import nearest
from plant.errors import ParameterError
from plant.keys import samples_pattern
from plant.toml_files import read_toml

CLOSED = ("tls/", "unixsock-stream/")  # endpoints that ask for a certificate or lie in a folder with permissions
LOOPBACK = re.compile(r"/(127\.\d+\.\d+\.\d+|localhost|\[::1\]):")

Seconds = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Count = Annotated[int, Field(ge=1)]
HttpUrl = Annotated[str, Field(pattern=r"^https?://[^\s/]+")]
AlertKind = Literal["wear", "lubrication", "jam", "model_mismatch", "operating_point", "data_quality", "stale"]


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class ZenohSection(_Section):
    """Where streams come from and answers go to."""

    prefix: str = Field(default="tribowatch", description="first part of every key")
    mode: Literal["peer", "client", "router"] = Field(
        default="peer", description="the daemon listens; leaves are clients"
    )
    listen: tuple[str, ...] = Field(default=("tcp/127.0.0.1:7447",), description="endpoints opened here")
    connect: tuple[str, ...] = Field(default=(), description="endpoints of other hubs")


class WindowSection(_Section):
    """How a stream is cut into windows, counted in analysis samples."""

    samples: int = Field(default=2000, ge=16, description="samples of one window, after averaging to the analysis rate")
    hop: int = Field(default=500, ge=1, description="samples from one window's start to the next")


class IntakeSection(_Section):
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


class IdentificationSection(_Section):
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


class DriftSection(_Section):
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


class DiagnosisSection(_Section):
    """How what the model cannot explain is diagnosed; one axis at a time, after the windows."""

    timeout_seconds: Seconds = Field(default=1800.0, description="a diagnosis busy longer is given up [s]")


class AlarmsSection(_Section):
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


class WebhookSection(_Section):
    """Who else is told of alerts, by HTTP POST in the format of Prometheus' Alertmanager (v2)."""

    urls: tuple[HttpUrl, ...] = Field(default=(), description="like http://alertmanager:9093/api/v2/alerts")
    token_file: str = Field(default="", description="file with a bearer token; empty = none")
    timeout: Seconds = Field(default=10.0, description="for one request [s]")
    first_retry: Seconds = Field(default=5.0, description="after a failed try; doubled with every further one [s]")
    longest_retry: Seconds = Field(default=600.0, description="longest time between two tries [s]")
    repeat: Seconds = Field(default=300.0, description="time after which alerts that stand are sent again [s]")


class HistorySection(_Section):
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


class SharingSection(_Section):
    """Several daemons watch the axes of one site and take over from each other; see docs/operations.md."""

    member: str = Field(default="", description="name of this daemon among them, on one database; empty = alone")


class SecuritySection(_Section):
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


class LogSection(_Section):
    """What is logged, on stderr."""

    level: Literal["debug", "info", "warning", "error"] = Field(default="info", description="the least that is said")
    format: Literal["console", "json"] = Field(default="console", description="for people, or json for programs")


class AxisSection(_Section):
    """One [[axis]]: the file that describes it."""

    file: Path = Field(description="the axis file, relative to this one")


class Config(BaseSettings):
    """The whole configuration; see `deploy/` for an example with every default."""

    model_config = SettingsConfigDict(
        extra="forbid", frozen=True, env_prefix="TRIBOWATCH_", env_nested_delimiter="__", validate_default=True
    )

    site: str = Field(pattern=f"^{AXIS_NAME}$", description="second part of every key")
    state_dir: Path = Field(default=Path("var"), description="database and lock file")
    seed: int = Field(default=0, ge=0, description="with axis, epoch and sample number it seeds each window's search")
    zenoh: ZenohSection = ZenohSection()
    window: WindowSection = WindowSection()
    intake: IntakeSection = IntakeSection()
    identification: IdentificationSection = IdentificationSection()
    drift: DriftSection = DriftSection()
    diagnosis: DiagnosisSection = DiagnosisSection()
    alarms: AlarmsSection = AlarmsSection()
    webhook: WebhookSection = WebhookSection()
    history: HistorySection = HistorySection()
    security: SecuritySection = SecuritySection()
    sharing: SharingSection = SharingSection()
    page: PageSection = PageSection()
    log: LogSection = LogSection()
    axis: tuple[AxisSection, ...] = ()

    @classmethod
    def settings_customise_sources(
        cls,
        settings_cls: type[BaseSettings],  # noqa: ARG003
        init_settings: PydanticBaseSettingsSource,
        env_settings: PydanticBaseSettingsSource,
        dotenv_settings: PydanticBaseSettingsSource,  # noqa: ARG003
        file_secret_settings: PydanticBaseSettingsSource,  # noqa: ARG003
    ) -> tuple[PydanticBaseSettingsSource, ...]:
        """Let the environment win over what `read_config` read from the file."""
        return env_settings, init_settings

    @property
    def database_url(self) -> str:
        """The URL of the history database."""
        return self.history.database or f"sqlite:///{self.state_dir / 'tribowatch.db'}"

    @property
    def receivers(self) -> tuple[str, ...]:
        """Who is told of alerts by webhook."""
        return self.webhook.urls

    @property
    def workers(self) -> int:
        """Worker processes, counted out."""
        return self.identification.workers or os.cpu_count() or 1


def read_config(path: Path) -> Config:
    """Read, merge and check the configuration at `path`; paths come out absolute.

    Raises:
        ConfigError: no such file, no TOML, unknown key (with the nearest allowed one), value out of range.
    """
    path = Path(path)
    values = read_toml(path, "configuration", ConfigError)
    try:
        config = Config(**values)
    except ValidationError as error:
        raise ConfigError(f"{path}: {_first_problem(error)}") from None
    except ValueError as error:  # an environment variable that is not what its key needs
        raise ConfigError(f"{path} with environment: {error}") from None
    base = path.resolve().parent
    axes = tuple(AxisSection(file=base / entry.file) for entry in config.axis)
    identity = str(base / config.security.identity) if config.security.identity else ""
    security = config.security.model_copy(update={"identity": identity})
    files = ("token_file", "certificate", "private_key")
    places = {name: str(base / given) for name in files if (given := getattr(config.page, name))}
    page = config.page.model_copy(update=places)
    state_dir = base / config.state_dir
    config = config.model_copy(update={"state_dir": state_dir, "axis": axes, "security": security, "page": page})
    if problem := name_problem(config) or link_problem(config.zenoh.listen, config.security):
        raise ConfigError(f"{path}: {problem}")
    return config


def name_problem(config: Config) -> str | None:
    """What is wrong with the names that stand in keys, in one line; None where nothing is."""
    try:
        samples_pattern(config.site, config.zenoh.prefix)
        if config.sharing.member:
            token_of(config.sharing.member)
    except ParameterError as error:
        return str(error)
    return None


def link_problem(listen: tuple[str, ...], security: SecuritySection) -> str | None:
    """What is wrong between endpoints and certificates, in one line; None where nothing is."""
    if security.identity:
        plain = [endpoint for endpoint in listen if not endpoint.startswith(CLOSED)]
        if plain:
            return (
                f"zenoh.listen has {plain[0]!r}, which asks nobody for a certificate; with [security] use tls/<address>"
            )
        return None
    if security.publishers or security.viewers or security.operators or security.recorders:
        return "security names roles but no identity; give security.identity, else nobody's certificate is asked for"
    secure = next((endpoint for endpoint in listen if endpoint.startswith("tls/")), None)
    return None if secure is None else f"zenoh.listen has {secure!r}, but security.identity is empty; give its folder"


def open_to_all(config: Config) -> tuple[str, ...]:
    """Endpoints at which anybody on the network may feed, read and command."""
    if config.security.identity:
        return ()
    return tuple(one for one in config.zenoh.listen if not one.startswith(CLOSED) and not LOOPBACK.search(one))


def read_axes(config: Config) -> dict[str, Axis]:
    """Read every listed axis file, by axis name.

    Raises:
        ConfigError: two files with the same axis name.
        AxisFileError: a file that cannot be used.
    """
    from plant.axis_file import read_axis

    axes: dict[str, Axis] = {}
    for entry in config.axis:
        axis = read_axis(entry.file)
        if axis.name in axes:
            raise ConfigError(f"{entry.file}: axis {axis.name!r} is listed twice; give every axis its own name")
        axes[axis.name] = axis
    return axes


def _first_problem(error: ValidationError) -> str:
    """Say the first problem in one line: the key, what is wrong with it, what is allowed."""
    problem = min(error.errors(include_url=False), key=lambda one: one["type"] != "extra_forbidden")  # typos first
    where = ".".join(str(part) for part in problem["loc"])
    if problem["type"] == "extra_forbidden":
        key = str(problem["loc"][-1])
        return f"unknown key {where!r}; {nearest(key, sorted(_allowed_keys(problem['loc'][:-1])))}"
    if problem["type"] == "missing":
        return f"key {where!r} is missing"
    message = re.sub(r"^Input should", "should", problem["msg"])
    return f"{where} = {problem['input']!r} {message}"


def _allowed_keys(where: tuple[int | str, ...]) -> list[str]:
    """Names allowed in the section at `where`."""
    model: Any = Config
    for part in where:
        if isinstance(part, str):
            model = AxisSection if part == "axis" else model.model_fields[part].annotation
    return list(model.model_fields)
