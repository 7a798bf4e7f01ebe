"""What the daemon stands on gives way under it: disk, database, file handles, workers, clock.

It says so, loses nothing that it acknowledged, and goes on by itself; the table is in docs/operations.md.
"""

import contextlib
import itertools
import os
import resource
import shutil
import signal
import sqlite3
import subprocess

import pytest

from monitor.room import MEGABYTE, Room
from plant.errors import ReachError
from plant.publisher import SamplePublisher
from plant.zenoh_session import open_session
from tests.contracts.command import tribowatch
from tests.scenarios.harness import SITE, START_NS, Plant, blocks_of, burst, wait_for
from tests.scenarios.kill9 import workers_of

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

    def __init__(self, folder, disk, reserve=0, more="", module="monitor"):
        self.database, self.module = disk / "tribowatch.db", module
        history = f'[history]\ndatabase = "sqlite:///{self.database}"\nreserve_mb = {reserve}\n'
        super().__init__(folder, settings=history + "[window]\nhop = 2000\n[identification]\nworkers = 1\n" + more)

    def answers(self, number, timeout=90):
        """Wait until so many windows are answered."""
        query = "select count(*) from estimate"
        wait_for(lambda: read(self, query)[0][0] == number, timeout, f"{number} answers")

    def check(self, bursts):
        """All samples of so many bursts once, all their windows answered, the file sound, no traceback."""
        assert read(self, "select samples, missing from axis") == [(bursts * SAMPLES, 0)]
        assert read(self, "select verdict, count(*) from estimate group by 1") == [("identified", bursts)]
        assert read(self, "pragma integrity_check") == [("ok",)]
        assert "Traceback" not in self.log


@pytest.fixture
def plant(tmp_path):
    """A daemon at work, its database in a folder of its own."""
    (tmp_path / "disk").mkdir()
    with OnDisk(tmp_path, tmp_path / "disk") as plant:
        yield plant.start()


def test_a_disk_that_is_full_and_then_not(tmp_path, small_disk):
    filler = small_disk / "filler"
    with OnDisk(tmp_path, small_disk, reserve=0) as plant:
        plant.start()
        with plant.session() as session:
            with feed(plant, session, 1):
                plant.answers(1)
            with filler.open("wb") as out, contextlib.suppress(OSError):
                while True:
                    out.write(b"\0" * 65536)
                    out.flush()
            with feed(plant, session, 2):
                wait_for(lambda: "the disk is full" in plant.log, 60, "it is said")
                assert plant.process.poll() is None, "the daemon lives"
                filler.unlink()
                plant.answers(2)
        plant.check(2)


def test_an_almost_full_disk_is_watched_but_not_kept(tmp_path, small_disk):
    with OnDisk(tmp_path, small_disk, reserve=1000) as plant:
        plant.start()
        with plant.session() as session, feed(plant, session, 1):
            wait_for(lambda: read(plant, "select count(*) from window where done") == [(1,)], 60, "the window is done")
        assert read(plant, "select count(*) from estimate") == [(0,)]
        assert "the disk is almost full" in plant.log


def test_a_database_locked_by_another_program(plant):
    other = sqlite3.connect(plant.database, isolation_level=None)
    other.execute("begin exclusive")
    with plant.session() as session, feed(plant, session, 1):
        wait_for(lambda: "locked" in plant.log, 60, "it is said")
        other.execute("rollback")
        other.close()
        plant.answers(1)
    plant.check(1)


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


def freeze(folder, how):
    """Make every file in `folder` read-only (`+i`), also to root, or writable again (`-i`)."""
    files = [*folder.iterdir(), folder]
    done = subprocess.run(["chattr", how, *files[:: 1 if how == "+i" else -1]], capture_output=True, text=True)
    if done.returncode:
        pytest.skip(f"no files can be made read-only here: {done.stderr.strip()}")


def test_a_disk_that_turns_read_only_and_back(plant):
    """SQLite's shared memory is a mapped file: the kernel may end the daemon (SIGBUS), which systemd starts again."""
    disk = plant.database.parent
    with plant.session() as session, feed(plant, session, 1):
        plant.answers(1)
        freeze(disk, "+i")
        try:
            with feed(plant, session, 2):
                wait_for(lambda: plant.process.poll() is not None or "nothing is watched" in plant.log, 60, "felt")
                plant.kill()
                plant.launch()
                wait_for(lambda: "may only be read" in plant.log, 60, "it is said")
                freeze(disk, "-i")
                plant.answers(2)
        finally:
            freeze(disk, "-i")
    plant.check(2)


@pytest.mark.parametrize("where", ["state directory", "database"])
def test_a_folder_that_may_only_be_read_ends_the_start_with_one_line(tmp_path, small_disk, where):
    plant = OnDisk(tmp_path, small_disk)
    if where == "state directory":
        plant.config.write_text(f'state_dir = "{small_disk}"\n' + plant.config.read_text())
    subprocess.run(["mount", "-o", "remount,ro", small_disk], check=True)
    code, words = plant.try_another()
    assert code == 3
    assert "writable" in words or "may this user write" in words
    assert len(words.strip().splitlines()) == 1


def test_a_file_damaged_under_the_daemon_is_told_and_a_back_up_takes_its_place(tmp_path, plant):
    with plant.session() as session, feed(plant, session, 1):
        plant.answers(1)
        copy = tmp_path / "copy.db"
        assert tribowatch("history", "backup", copy, "--config", plant.config).returncode == 0
        with feed(plant, session, 2):
            plant.answers(2)
            plant.terminate()  # else the newest pages lie in the log beside the file
            whole = plant.database.read_bytes()
            plant.database.write_bytes(whole[:4096] + os.urandom(len(whole) - 4096))
            code, words = plant.try_another()
            assert (code, len(words.strip().splitlines())) == (3, 1), words
            assert "restore a back-up" in words
            restore = ("history", "restore", copy, "--config", plant.config, "--yes")
            assert tribowatch(*restore).returncode == 0
            plant.start()
            plant.answers(2)  # what came after the back-up, from the publisher's cache
    plant.check(2)


def harm(database):
    """Overwrite the file but for its first page; what lies in the log beside it too, so that pages must be read."""
    with contextlib.closing(sqlite3.connect(database)) as other:
        other.execute("pragma wal_checkpoint(truncate)")
    with database.open("r+b") as file:
        size = file.seek(0, os.SEEK_END)
        file.seek(4096)
        file.write(os.urandom(size - 4096))


def test_pages_damaged_while_it_runs_are_told(plant):
    with plant.session() as session, feed(plant, session, 1):
        plant.answers(1)
        harm(plant.database)
        with feed(plant, session, 2):
            wait_for(lambda: "restore a back-up" in plant.log, 60, "it is said")
            assert plant.process.poll() is None


def test_out_of_file_handles_it_goes_on_and_starts_workers_again_once_there_are_some(plant):
    with plant.session() as session, feed(plant, session, 1):
        plant.answers(1)
        pid = plant.process.pid
        before = resource.prlimit(pid, resource.RLIMIT_NOFILE)
        resource.prlimit(pid, resource.RLIMIT_NOFILE, (3, before[1]))
        with pytest.raises(ReachError), open_session("client", connect=[plant.endpoint], timeout=1.0):
            pass  # nobody new comes in
        with feed(plant, session, 2):
            plant.answers(2)  # who is in is served
            for worker in workers_of(pid):
                os.kill(worker, signal.SIGKILL)
            with feed(plant, session, 3):
                wait_for(lambda: "Too many open files" in plant.log, 60, "it is said")
                query = "select samples from axis"
                wait_for(lambda: read(plant, query) == [(3 * SAMPLES,)], 30, "samples are kept meanwhile")
                assert plant.process.poll() is None
                resource.prlimit(pid, resource.RLIMIT_NOFILE, before)
                plant.answers(3)
    plant.check(3)


def test_a_worker_that_hangs_is_replaced_and_its_window_answered(tmp_path):
    disk = tmp_path / "disk"
    disk.mkdir()
    with OnDisk(tmp_path, disk) as plant:
        text = plant.config.read_text()
        plant.config.write_text(text.replace("workers = 1\n", "workers = 1\ntimeout_seconds = 5.0\n"))
        plant.start()
        with plant.session() as session, feed(plant, session, 1):
            plant.answers(1)
            for worker in workers_of(plant.process.pid):
                os.kill(worker, signal.SIGSTOP)
            with feed(plant, session, 2):
                wait_for(lambda: "worker processes restarted" in plant.log, 60, "it is said")
                plant.answers(2)
        plant.check(2)


def test_steps_of_the_computers_clock_are_nothing_to_it(tmp_path):
    disk = tmp_path / "disk"
    disk.mkdir()
    module = "tests.scenarios.daemon_on_another_clock"
    with OnDisk(tmp_path, disk, more="[intake]\nstale_after = 3600.0\n", module=module) as plant:
        plant.start()
        with plant.session() as session, contextlib.ExitStack() as stack:
            for number, wrong in enumerate((0.0, 86_400.0, -30 * 86_400.0), start=1):
                (tmp_path / "clock.part").write_text(str(wrong))
                (tmp_path / "clock.part").replace(tmp_path / "clock")
                stack.enter_context(feed(plant, session, number))
                plant.answers(number)
        assert read(plant, "select start_ns from window order by 1") == [
            (START_NS + number * 3_600 * 10**9,) for number in (1, 2, 3)
        ]
        assert read(plant, "select count(*) from transition") == [(0,)]
        plant.check(3)
