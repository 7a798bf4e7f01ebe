"""The daemon's configuration: one TOML file, overridable by environment variables, unknown keys are errors.

Relative paths are relative to the configuration file. The environment overrides the file:
`TRIBOWATCH_ZENOH__PREFIX=plant` sets `[zenoh] prefix`.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

from pydantic import Field, ValidationError
from pydantic_settings import BaseSettings, PydanticBaseSettingsSource, SettingsConfigDict

from monitor.config_page import PageSection
from monitor.config_sections import (
    AlarmsSection,
    AxisSection,
    DiagnosisSection,
    DriftSection,
    HistorySection,
    IdentificationSection,
    IntakeSection,
    LogSection,
    SecuritySection,
    SharingSection,
    WebhookSection,
    WindowSection,
    ZenohSection,
)
from monitor.errors import ConfigError
from monitor.sharing import token_of
from plant.axis import AXIS_NAME, Axis
from plant.checks import nearest
from plant.errors import ParameterError
from plant.keys import samples_pattern
from plant.toml_files import read_toml

CLOSED = ("tls/", "unixsock-stream/")  # endpoints that ask for a certificate or lie in a folder with permissions
LOOPBACK = re.compile(r"/(127\.\d+\.\d+\.\d+|localhost|\[::1\]):")


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
