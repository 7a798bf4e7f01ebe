"""Back-ups of the history while the daemon runs, and putting one back: SQLite's online copy; pg_dump for PostgreSQL."""

from __future__ import annotations

import contextlib
import os
import shutil
import sqlite3
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

from sqlalchemy.engine import URL, make_url

from monitor.database import explained
from monitor.errors import DatabaseError
from plant.errors import InputError

PAGES = 4096  # of one step of the copy, so that progress can be told

Progress = Callable[[int, int], None]


def back_up(url: str, target: Path, progress: Progress = lambda _done, _total: None) -> int:
    """Copy the history at `url` to the new file `target`, as of one moment; its size. [bytes]

    The daemon may go on writing. `progress` is told the pages done and in all (SQLite).

    Raises:
        InputError: `target` exists, or cannot be written.
        DatabaseError: the history cannot be read, or the copy is not sound.
    """
    parsed = make_url(url)
    if target.exists():
        raise InputError(f"{target}: exists already; choose another name, back-ups are never overwritten")
    part = target.with_name(target.name + ".part")
    try:
        part.write_bytes(b"")  # here, so that what cannot be written is not taken for what cannot be read
        if parsed.get_backend_name() == "sqlite":
            _copy_sqlite(Path(parsed.database or ""), part, progress)
        else:
            _dump_server(parsed, part)
        part.rename(target)
    except OSError as error:
        raise InputError(f"{target}: cannot be written: {error.strerror or error}") from None
    finally:
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)
    return target.stat().st_size


def _copy_sqlite(source: Path, target: Path, progress: Progress) -> None:
    if not source.is_file():
        raise DatabaseError(f"{source}: no history database here; has the daemon run with this configuration?")
    with explained(f"sqlite:///{source}"), _open(source) as old:
        old.execute("BEGIN")  # one snapshot: what the daemon writes meanwhile does not make the copy begin anew
        old.execute("SELECT count(*) FROM alembic_version").fetchone()
        with _open(target, write=True) as new:
            old.backup(new, pages=PAGES, progress=lambda _status, left, total: progress(total - left, total))
            new.execute("PRAGMA journal_mode=DELETE")  # a single file, without companions
            verdict = new.execute("PRAGMA quick_check").fetchone()[0]
    if verdict != "ok":
        raise DatabaseError(f"{source}: the copy is not sound ({verdict}); check the disk, and the history itself")
    with target.open("rb") as copy:
        os.fsync(copy.fileno())


@contextlib.contextmanager
def _open(path: Path, *, write: bool = False) -> Iterator[sqlite3.Connection]:
    connection = sqlite3.connect(f"file:{path}?mode={'rwc' if write else 'ro'}", uri=True, isolation_level=None)
    try:
        yield connection
    finally:
        connection.close()


def _dump_server(url: URL, target: Path) -> None:
    """By pg_dump, in its own format; the password goes by the environment, where no other user sees it."""
    program = shutil.which("pg_dump")
    if program is None:
        raise InputError("pg_dump is not installed: back up the server with its own means (docs/history.md)")
    plain = url.set(drivername="postgresql", password=None).render_as_string(hide_password=False)
    environment = os.environ | ({"PGPASSWORD": str(url.password)} if url.password else {})
    words = [program, "--format=custom", "--file", str(target), "--dbname", plain]
    done = subprocess.run(words, capture_output=True, text=True, env=environment, check=False)
    if done.returncode:
        line = (done.stderr.strip().splitlines() or ["pg_dump failed"])[0]
        raise DatabaseError(f"{url.render_as_string(hide_password=True)}: {line}")


def restore(source: Path, url: str) -> Path | None:
    """Put the back-up `source` in the place of the history at `url`; where the old one was moved to, None for none.

    No daemon may run there. The back-up stays as it is.

    Raises:
        InputError: `source` is no sound back-up of an SQLite history, or the history is on a server.
        DatabaseError: it is a database of something else, or of a newer program.
    """
    parsed = make_url(url)
    if parsed.get_backend_name() != "sqlite":
        raise InputError("a history on a server is restored with pg_restore: see docs/history.md")
    if not source.is_file():
        raise InputError(f"{source}: no such back-up")
    place = Path(parsed.database or "")
    place.parent.mkdir(parents=True, exist_ok=True)
    fresh = place.with_name(place.name + ".part")
    try:
        _check(source)
        _copy_sqlite(source, fresh, lambda _done, _total: None)
    except DatabaseError as error:
        fresh.unlink(missing_ok=True)
        if error.__cause__ is None:
            raise
        why = str(getattr(error.__cause__, "orig", error.__cause__)).splitlines()[0]
        raise InputError(
            f"{source}: no sound back-up ({why}); take another one, the history here is as it was"
        ) from None
    moved = None
    if place.exists():
        moved = _free_name(place)
        place.rename(moved)
        for tail in ("-wal", "-shm"):  # they belong to the old file
            companion = place.with_name(place.name + tail)
            if companion.exists():
                companion.rename(moved.with_name(moved.name + tail))
    fresh.rename(place)
    return moved


def _check(source: Path) -> None:
    """Refuse what is no history, or one of a newer program."""
    from monitor.database import make_engine
    from monitor.schema import check_version

    engine = make_engine(f"sqlite:///{source}", read_only=True)
    try:
        with explained(f"sqlite:///{source}"), engine.begin() as connection:
            if check_version(connection, str(source)) is None:
                raise DatabaseError(f"{source}: this is no history of tribowatch")
    finally:
        engine.dispose()


def _free_name(place: Path) -> Path:
    names = (place.with_name(f"{place.stem}.before-restore-{k}{place.suffix}") for k in range(1, 10_000))
    return next(name for name in names if not name.exists())
