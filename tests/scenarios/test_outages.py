"""The database goes away under a running daemon: disk full, locked, read-only. It says so, and goes on by itself."""

import contextlib
import itertools
import os
import shutil
import sqlite3
import subprocess

import pytest

from monitor.room import MEGABYTE, Room
from plant.publisher import SamplePublisher
from tests.scenarios.harness import SITE, START_NS, Plant, blocks_of, burst, wait_for

SAMPLES = 2000


def test_room_has_hysteresis_and_counts_what_is_not_kept(tmp_path):
    free, ticks = iter((500, 210, 190, 210, 230, 250)), itertools.count(0, 10)
    room = Room(tmp_path, 200, lambda: next(ticks), lambda _folder: next(free) * MEGABYTE)
    kept = [room.keeps() for _ in range(6)]
    assert kept == [True, True, False, False, False, True]
    assert room.not_kept == 3


def test_a_database_server_looks_after_its_own_room():
    assert Room.of_database("postgresql+psycopg://u@h/d", 1e12, lambda: 0.0).keeps()
    assert not Room.of_database("sqlite:///x.db", 1e12, lambda: 0.0).keeps()


def read(plant, query):
    with contextlib.closing(sqlite3.connect(f"file:{plant.database}?mode=ro", uri=True, timeout=30)) as db:
        return db.execute(query).fetchall()


def feed(plant, session, epoch):
    """A burst, with a publisher that keeps what it sent; give it back open."""
    publisher = SamplePublisher(session, SITE, "axis-1", epoch=epoch)
    start = START_NS + epoch * 3_600 * 10**9
    for block in blocks_of("axis-1", epoch, 0, start, *burst(plant.axis, samples=SAMPLES)):
        publisher.put(block)
    return publisher


@pytest.fixture
def small_disk(tmp_path):
    """A disk of 24 MB; needs the right to mount."""
    folder = tmp_path / "disk"
    folder.mkdir()
    done = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=24m", "tmpfs", folder], capture_output=True, text=True)
    if done.returncode:
        pytest.skip(f"cannot mount a small disk: {done.stderr.strip()}")
    yield folder
    subprocess.run(["umount", "-l", folder], check=True)


class OnDisk(Plant):
    """A daemon whose database lies in a folder of its own."""

    def __init__(self, folder, disk, reserve):
        self.database = disk / "tribowatch.db"
        history = f'[history]\ndatabase = "sqlite:///{self.database}"\nreserve_mb = {reserve}\n'
        super().__init__(folder, settings=history + "[window]\nhop = 2000\n[identification]\nworkers = 1")


def test_a_disk_that_is_full_and_then_not(tmp_path, small_disk):
    filler = small_disk / "filler"
    with OnDisk(tmp_path, small_disk, reserve=0) as plant:
        plant.start()
        with plant.session() as session:
            with feed(plant, session, 1):
                wait_for(lambda: read(plant, "select count(*) from estimate") == [(1,)], 60, "the first answer")
            with filler.open("wb") as out, contextlib.suppress(OSError):
                while True:
                    out.write(b"\0" * 65536)
                    out.flush()
            with feed(plant, session, 2):
                wait_for(lambda: "the disk is full" in plant.log, 60, "it is said")
                assert plant.process.poll() is None, "the daemon lives"
                filler.unlink()
                wait_for(lambda: read(plant, "select count(*) from estimate") == [(2,)], 90, "it goes on by itself")
        assert read(plant, "select samples, missing from axis") == [(2 * SAMPLES, 0)]
        assert read(plant, "pragma integrity_check") == [("ok",)]
        assert "Traceback" not in plant.log


def test_an_almost_full_disk_is_watched_but_not_kept(tmp_path, small_disk):
    with OnDisk(tmp_path, small_disk, reserve=1000) as plant:
        plant.start()
        with plant.session() as session, feed(plant, session, 1):
            wait_for(lambda: read(plant, "select count(*) from window where done") == [(1,)], 60, "the window is done")
        assert read(plant, "select count(*) from estimate") == [(0,)]
        assert "the disk is almost full" in plant.log


def test_a_database_locked_by_another_program(tmp_path):
    disk = tmp_path / "disk"
    disk.mkdir()
    with OnDisk(tmp_path, disk, reserve=0) as plant:
        plant.start()
        other = sqlite3.connect(plant.database, isolation_level=None)
        other.execute("begin exclusive")
        with plant.session() as session, feed(plant, session, 1):
            wait_for(lambda: "locked" in plant.log, 60, "it is said")
            other.execute("rollback")
            other.close()
            wait_for(lambda: read(plant, "select count(*) from estimate") == [(1,)], 90, "it goes on by itself")
        assert read(plant, "select samples, missing from axis") == [(SAMPLES, 0)]
        assert "Traceback" not in plant.log


@pytest.mark.parametrize(
    ("harm", "said"), [("corrupt", "database"), ("unreadable", "folder")], ids=["not a database", "no folder"]
)
def test_a_database_that_cannot_be_used_ends_the_start_with_one_line(tmp_path, harm, said):
    disk = tmp_path / "disk"
    plant = OnDisk(tmp_path, disk, reserve=0)
    if harm == "corrupt":
        disk.mkdir()
        plant.database.write_bytes(os.urandom(8192))
    code, words = plant.try_another()
    assert code == 3
    assert said in words
    assert len(words.strip().splitlines()) == 1
    shutil.rmtree(disk, ignore_errors=True)
