"""Engines: the one place that knows which database it is, and what its errors mean to a user."""

from __future__ import annotations

import contextlib
import sqlite3
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from sqlalchemy import URL, Connection, Engine, create_engine, event
from sqlalchemy.engine import make_url
from sqlalchemy.exc import ArgumentError, NoSuchModuleError, SQLAlchemyError

from monitor.errors import DatabaseError

BUSY_MS = 5000  # how long SQLite waits for another writer


def make_engine(url: str, *, read_only: bool = False, synchronous: str = "NORMAL") -> Engine:
    """An engine for `url`; SQLite gets WAL, foreign keys and explicit transactions.

    Raises:
        DatabaseError: no such kind of database, or the SQLite file is missing where only reading was asked for.
    """
    try:
        parsed = make_url(url)
        if parsed.get_backend_name() != "sqlite":
            return _server_engine(parsed, read_only)
    except (ArgumentError, NoSuchModuleError, ModuleNotFoundError) as error:
        raise DatabaseError(f"database URL {url!r} cannot be used: {error}") from None
    path = Path(parsed.database or "")
    if read_only:
        if not path.is_file():
            raise DatabaseError(f"{path}: no history database here; has the daemon run with this configuration?")
        url = f"sqlite:///file:{path}?mode=ro&uri=true"
    engine = create_engine(url, connect_args={"timeout": BUSY_MS / 1000, "check_same_thread": False})
    _prepare_sqlite(engine, read_only, synchronous)
    return engine


def _server_engine(url: URL, read_only: bool) -> Engine:
    """PostgreSQL: what a reader asks in one go is one snapshot, and it cannot write."""
    if url.drivername == "postgresql":
        url = url.set(drivername="postgresql+psycopg")
    options: dict[str, Any] = {"isolation_level": "REPEATABLE READ", "postgresql_readonly": True} if read_only else {}
    return create_engine(url, pool_pre_ping=True, execution_options=options)


def _prepare_sqlite(engine: Engine, read_only: bool, synchronous: str) -> None:
    @event.listens_for(engine, "connect")
    def connect(connection: sqlite3.Connection, _record: Any) -> None:
        connection.isolation_level = None  # the driver's own BEGIN would come too late for a snapshot
        pragmas = [f"busy_timeout={BUSY_MS}", "foreign_keys=ON"]
        if not read_only:
            pragmas += ["journal_mode=WAL", f"synchronous={synchronous}"]
        for pragma in pragmas:
            connection.execute(f"PRAGMA {pragma}")

    @event.listens_for(engine, "begin")
    def begin(connection: Connection) -> None:
        connection.exec_driver_sql("BEGIN" if read_only else "BEGIN IMMEDIATE")


@contextlib.contextmanager
def explained(url: str) -> Iterator[None]:
    """Turn what the driver says into one line that says what to do."""
    try:
        yield
    except (SQLAlchemyError, sqlite3.Error) as error:
        raise DatabaseError(explain(error, url)) from error


def explain(error: Exception, url: str) -> str:
    """One line for `error` of the database at `url`: what, where, what to do."""
    where = make_url(url).render_as_string(hide_password=True)
    if where.startswith("sqlite"):
        where = make_url(url).database or where
    whole = str(getattr(error, "orig", None) or error) or type(error).__name__
    known = {
        "file is not a database": "this file is not a database; move it away or set state_dir to another folder",
        "malformed": "the database is damaged; stop the daemon and restore a back-up, or move the file away",
        "unable to open database file": "cannot be opened; does the folder exist, and may this user write there?",
        "readonly database": "may only be read; make file and folder writable for this user",
        "disk is full": "the disk is full; make room, the daemon goes on by itself",
        "database is locked": f"another program has kept it locked for {BUSY_MS / 1000:g} s; close that program",
        "connection refused": "the database server does not answer; is it running, and is the URL right?",
        "is the server running": "the database server does not answer; is it running, and is the URL right?",
        "terminating connection": "the database server was stopped; start it, the daemon goes on by itself",
        "server closed the connection": "the database server went away; start it, the daemon goes on by itself",
        "password authentication failed": "the database server refuses this user or password",
        "disk i/o error": "the disk reports an error; check it, and whether the folder is still mounted",
    }
    for words, advice in known.items():
        if words in whole.lower():
            return f"{where}: {advice}"
    return f"{where}: {whole.splitlines()[0]}"
