"""A PostgreSQL server of our own: on a unix socket in a scratch folder, gone when the tests are."""

import contextlib
import itertools
import os
import shutil
import signal
import subprocess
import tempfile
from pathlib import Path

PROGRAMS = ("initdb", "pg_ctl", "postgres", "psql")
USER = "tribowatch"
SETTINGS = "-c listen_addresses='' -c fsync=off -c max_connections=100 -c shared_buffers=32MB"
_names = itertools.count(1)


def programs() -> dict[str, str] | None:
    """Paths of the server's programs; Debian keeps them off PATH. None where there is no PostgreSQL."""
    debian = sorted(Path("/usr/lib/postgresql").glob("*/bin"), reverse=True)
    path = os.pathsep.join([os.environ.get("PATH", ""), *map(str, debian)])
    found = {name: shutil.which(name, path=path) for name in PROGRAMS}
    return found if all(found.values()) else None


class Server:
    """A running server; `database()` gives the URL of a new, empty database (a schema: a tenth of the files)."""

    def __init__(self) -> None:
        self.programs = programs()
        self.folder = Path(tempfile.mkdtemp(prefix="tw-pg-"))  # short: a socket's path has at most 107 characters
        self._as = {"user": 65534, "group": 65534, "extra_groups": []} if os.getuid() == 0 else {}  # never as root
        if self._as:
            os.chown(self.folder, 65534, 65534)
        self._run("initdb", "-D", "data", "-A", "trust", "-U", USER, "--no-sync", "-E", "UTF8", "--locale=C")
        self.start()

    def _run(self, program, *words, check=True):
        return subprocess.run(
            [self.programs[program], *words], cwd=self.folder, check=check, capture_output=True, text=True, timeout=120,
            env={"PATH": os.environ["PATH"], "HOME": str(self.folder), "LC_ALL": "C"}, **self._as,
        )  # fmt: skip

    def start(self):
        options = f"-k {self.folder} {SETTINGS}"
        # the server keeps what it inherits: it must not hold our pipes
        subprocess.run(
            [self.programs["pg_ctl"], "-D", "data", "-w", "-t", "60", "-l", "log", "-o", options, "start"],
            cwd=self.folder, check=True, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            timeout=120, env={"PATH": os.environ["PATH"], "HOME": str(self.folder), "LC_ALL": "C"}, **self._as,
        )  # fmt: skip

    def stop(self, mode="fast"):
        """Stop; with mode `immediate` as a crash would."""
        self._run("pg_ctl", "-D", "data", "-m", mode, "-w", "-t", "60", "stop", check=False)

    def crash(self, hard=False):
        """End without a word: told to (`immediate`), or `hard`, by SIGKILL, which its children find out later."""
        if not hard:
            return self.stop("immediate")
        pid = int((self.folder / "data" / "postmaster.pid").read_text().split()[0])
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
        return None

    def query(self, sql) -> str:
        """What psql prints for one statement, without headers."""
        return self._run("psql", "-h", str(self.folder), "-U", USER, "-d", "postgres", "-Atc", sql).stdout.strip()

    def database(self) -> str:
        name = f"t{os.getpid()}_{next(_names)}"
        self.query(f"create schema {name}")
        return f"postgresql://{USER}@/postgres?host={self.folder}&options=-csearch_path%3D{name}"

    def close(self):
        with contextlib.suppress(subprocess.SubprocessError):
            self.stop("immediate")
        shutil.rmtree(self.folder, ignore_errors=True)
