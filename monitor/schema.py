"""The schema version of a history database: read it, bring it up to date."""

from __future__ import annotations

from dataclasses import dataclass

from alembic import command
from alembic.config import Config as AlembicConfig
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Connection, Engine, inspect

from monitor.database import explained, make_engine
from monitor.errors import DatabaseError
from monitor.models import Base


def alembic_config(connection: Connection | None = None) -> AlembicConfig:
    """Alembic without an ini file: our scripts, and the connection to migrate."""
    config = AlembicConfig()
    config.set_main_option("script_location", "monitor:migrations")
    config.set_main_option("path_separator", "os")
    if connection is not None:
        config.attributes["connection"] = connection
    return config


def migrate(engine: Engine, url: str, revision: str = "head") -> None:
    """Bring the database to `revision` (all in one transaction).

    Raises:
        DatabaseError: it cannot be opened or written, or was written by a newer program.
    """
    with explained(url), engine.begin() as connection:
        check_version(connection, url)
        command.upgrade(alembic_config(connection), revision)


@dataclass(frozen=True, slots=True)
class Schema:
    """Where a database stands: its revision (None = empty), the newest one, and what each step between brings."""

    current: str | None
    head: str
    pending: tuple[str, ...]


def schema_of(url: str) -> Schema:
    """Look at the database at `url` without changing it.

    Raises:
        DatabaseError: it cannot be opened, or was written by a newer program.
    """
    engine = make_engine(url, read_only=True)
    try:
        with explained(url), engine.begin() as connection:
            current = check_version(connection, url)
    finally:
        engine.dispose()
    scripts = ScriptDirectory.from_config(alembic_config())
    head = scripts.get_current_head() or ""
    steps = [] if current == head else list(scripts.iterate_revisions(head, current or "base"))
    return Schema(current, head, tuple(f"{step.revision} {step.doc}" for step in reversed(steps)))


def check_version(connection: Connection, url: str, *, must_be_current: bool = False) -> str | None:
    """Refuse a database whose schema this program does not know; its revision, None for an empty one.

    Raises:
        DatabaseError: written by a newer program, or by another one; or, with `must_be_current`, empty or by an older
            one.
    """
    current = MigrationContext.configure(connection).get_current_revision()
    scripts = ScriptDirectory.from_config(alembic_config())
    known = {script.revision for script in scripts.walk_revisions()}
    where = (connection.engine.url.database or url).removeprefix("file:")
    if current is not None and current not in known:
        raise DatabaseError(f"{where}: schema {current!r} is newer than this program knows; upgrade tribowatch")
    if current is None and (strange := _strange_tables(connection)):
        raise DatabaseError(
            f"{where}: holds another program's table {strange[0]!r}; give tribowatch a database of its own"
        )
    if must_be_current and current != scripts.get_current_head():
        raise DatabaseError(f"{where}: schema {current!r} is older than this program: tribowatch upgrade")
    return current


def _strange_tables(connection: Connection) -> list[str]:
    """Tables in a database without a schema of ours: any in a file; on a server, where others may live, our names."""
    there = set(inspect(connection).get_table_names()) - {"alembic_version"}
    return sorted(there if connection.dialect.name == "sqlite" else there & set(Base.metadata.tables))
